"""Well damped structures through rounded UFF text, noise not stated: are all modes found, and none invented?

Each draw has two to six modes from 500 to 3600 Hz with loss factors of 0.03 to 0.15, no two closer than the mean of
their bandwidths, and two beyond the band. Half of them are damped viscously. Five rows on lines of 2 Hz carry noise
that rises with frequency, by a power of 1 to 4, to 1 to 30 % of the median accelerance, and the file has six digits. A
draw is found where there are as many modes as were drawn, each within a tenth of its bandwidth and 20 % of its loss
factor.

The generator shares no code with the fit: an oscillator for each mode, and poles in closed form.
"""

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyuff
from numpy.typing import NDArray

from analysis.errors import AnalysisError
from analysis.modal.estimation import ModalEstimate, estimate_modes
from jointlab.notebook import read_uff

DRAWS = 100
LINES = np.arange(0.0, 4000.5, 2.0)
ROWS = 5


@dataclass(frozen=True)
class Draw:
    """A structure as it was measured.

    Attributes:
        frequency, loss_factor: (modes,) true ones, Hz and 1, of the modes within the band.
        accelerance: (rows, lines) with noise, (m/s^2)/N.
    """

    frequency: NDArray[np.float64]
    loss_factor: NDArray[np.float64]
    accelerance: NDArray[np.complex128]


def main() -> None:
    """Print the share of draws that are found, what the others gave, and how many intervals hold."""
    found, held, started = 0, [], time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(DRAWS):
            drawn = draw(seed)
            try:
                estimate = estimated(drawn, Path(folder) / "holder.unv")
            except AnalysisError as error:
                print(f"  {seed}: {error}", flush=True)
                continue
            if is_found(drawn, estimate):
                found += 1
                held.append(intervals_held(drawn, estimate))
            else:
                print(f"  {seed}: {pairs(drawn.frequency, drawn.loss_factor)} came out as "
                      f"{pairs(estimate.modes.frequency, estimate.modes.loss_factor)}", flush=True)  # fmt: skip
    share = 100 * np.mean(np.concatenate(held, axis=1), axis=1)
    print(f"{found} of {DRAWS} found; intervals hold {share[0]:.1f} % of frequencies, {share[1]:.1f} % of loss factors")
    print(f"{(time.perf_counter() - started) / DRAWS:.2f} s each")


def draw(seed: int) -> Draw:
    """Draw number `seed`."""
    rng = np.random.default_rng([seed, 2611])
    while True:
        modes = int(rng.integers(2, 7))
        frequency = np.sort(rng.uniform(500.0, 3600.0, modes))
        loss_factor = rng.uniform(0.03, 0.15, modes)
        bandwidth = frequency * loss_factor
        if np.all(np.diff(frequency) > (bandwidth[1:] + bandwidth[:-1]) / 2):
            break
    natural = 2 * np.pi * np.append(frequency, rng.uniform(4600.0, 9000.0, 2))
    damping = np.append(loss_factor, rng.uniform(0.03, 0.15, 2))
    shapes = rng.uniform(0.4, 1.0, (modes + 2, ROWS)) * rng.choice([-1.0, 1.0], (modes + 2, ROWS))
    viscous = rng.random() < 0.5
    omega = 2 * np.pi * LINES
    accelerance = np.zeros((ROWS, LINES.size), dtype=np.complex128)
    for w, eta, shape in zip(natural, damping, shapes, strict=True):
        lag = eta * w * omega if viscous else eta * w**2
        accelerance += np.outer(shape * shape[0], -(omega**2) / (w**2 - omega**2 + 1j * lag))
    sigma = np.median(np.abs(accelerance)) * 10 ** rng.uniform(-2.0, -0.5) * (LINES / 4000) ** rng.uniform(1.0, 4.0)
    noise = sigma * (rng.standard_normal(accelerance.shape) + 1j * rng.standard_normal(accelerance.shape))
    if viscous:  # lambda^2 of the pole -eta/2 +- i sqrt(1 - eta^2/4)
        frequency, loss_factor = (
            frequency * np.sqrt(1 - loss_factor**2 / 2),
            loss_factor * np.sqrt(1 - loss_factor**2 / 4) / (1 - loss_factor**2 / 2),
        )
    return Draw(frequency, loss_factor, accelerance + noise)


def estimated(drawn: Draw, path: Path) -> ModalEstimate:
    """Modes by way of a text file in single precision at `path`."""
    sets = [
        {
            "type": 58, "func_type": 4, "binary": 0, "ord_data_type": 5, "data": row, "x": LINES,
            "abscissa_min": LINES[0], "abscissa_inc": LINES[1] - LINES[0], "abscissa_spacing": 1, "num_pts": LINES.size,
            "rsp_node": 1, "rsp_dir": 2, "ref_node": node, "ref_dir": 2, "id1": "holder",
            "abscissa_spec_data_type": 18, "ordinate_spec_data_type": 12, "orddenom_spec_data_type": 13,
        }
        for node, row in enumerate(drawn.accelerance, start=1)
    ]  # fmt: skip
    pyuff.UFF(str(path)).write_sets(sets, mode="overwrite", force_double=False)
    return estimate_modes(read_uff(path))


def is_found(drawn: Draw, estimate: ModalEstimate) -> bool:
    """Whether there are the drawn modes and no other."""
    modes = estimate.modes
    if modes.poles.size != drawn.frequency.size:
        return False
    off = np.abs(modes.frequency - drawn.frequency) < 0.1 * drawn.loss_factor * drawn.frequency
    return bool(np.all(off & (np.abs(modes.loss_factor - drawn.loss_factor) < 0.2 * drawn.loss_factor)))


def intervals_held(drawn: Draw, estimate: ModalEstimate) -> NDArray[np.bool_]:
    """(2, modes) whether the intervals of frequency and of loss factor hold the truth."""
    ends = np.stack([estimate.frequency_ci95, estimate.loss_factor_ci95])
    true = np.stack([drawn.frequency, drawn.loss_factor])
    return np.asarray((ends[..., 0] <= true) & (true <= ends[..., 1]))


def pairs(frequency: NDArray[np.float64], loss_factor: NDArray[np.float64]) -> str:
    """Frequencies and loss factors in short."""
    return " ".join(f"{f:.0f}/{eta:.3f}" for f, eta in zip(frequency, loss_factor, strict=True))


if __name__ == "__main__":
    main()
