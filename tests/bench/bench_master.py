"""Master curves of elastomers at random, fitted to 5 to 200 Hz at several temperatures: do intervals hold, how wide are
they, by frequency and temperature? Materials are sums of relaxations, not the fitted law."""

import time

import numpy as np

from analysis.direct.master_fit import fit_master_curve
from tests.analysis.direct.materials import REFERENCE, Material

MATERIALS = 40
SWEPT = ((-10.0, 5.0, 23.0, 40.0), (8.0, 23.0, 38.0))
ASKED = ((400.0, 23.0), (1000.0, 23.0), (1000.0, 40.0), (1000.0, 5.0), (100.0, 15.0))
OUTSIDE = (3000.0, 30000.0)  # Hz, at the coldest temperature


def main() -> None:
    """Print a table for each set of temperatures."""
    for temperatures in SWEPT:
        asked_of = (*ASKED, *((frequency, min(temperatures)) for frequency in OUTSIDE))
        held, half, inside, seconds = [], [], [], []
        for seed in range(MATERIALS):
            random = np.random.default_rng([seed, 7])
            material = Material.drawn(random)
            points = material.sweeps(temperatures, random)
            began = time.perf_counter()
            curve = fit_master_curve(*points, reference=REFERENCE)
            seconds.append(time.perf_counter() - began)
            for asked in asked_of:
                true, found = material.stiffness(*asked), curve.at(*asked)
                k, gamma = found.stiffness, found.loss_factor
                held.append([k.low < true.real < k.high, gamma.low < true.imag / true.real < gamma.high])
                half.append([k.high / k.value - 1, (gamma.high - gamma.low) / 2 / gamma.value])
                inside.append(not found.beyond)
        held_by, half_by, inside_by = (
            np.array(each).reshape(MATERIALS, len(asked_of), -1) for each in (held, half, inside)
        )
        print(
            f"sweeps at {temperatures}: {100 * np.mean(held):.1f} % of {np.size(held)} hold; {np.median(seconds):.1f} s"
        )
        for place, (frequency, temperature) in enumerate(asked_of):
            share, width = np.mean(held_by[:, place], axis=0), np.median(half_by[:, place], axis=0)
            print(
                f"  {frequency:g} Hz at {temperature:g}: k {100 * share[0]:.0f} %, gamma {100 * share[1]:.0f} % hold; "
                f"half-widths {100 * width[0]:.1f} and {100 * width[1]:.1f} %; covered in "
                f"{100 * np.mean(inside_by[:, place]):.0f} %",
                flush=True,
            )


if __name__ == "__main__":
    main()
