"""The demo's accuracy over several benches: each seed is another bench, another hand and other noise.

For each seed the whole campaign through the wires; printed are the errors against what the bench really is.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from api.commands.sequences import BUILT_IN, named_sequence
from api.commands.terminal import instruments_of
from api.identification.pipeline import Identification, identify
from api.identification.source import measurement_of_run
from api.simulated import SimulatedOperator, simulated_settings
from api.truth import SineTruth, by_amplitude, sine_truths
from rig.run import run_sequence
from simlab.laboratory import LaboratoryProcess
from store.catalogue import Catalogue

SEEDS = range(1, 9)
TERMS = {"k11": (0, 0), "k12": (0, 1), "k22": (1, 1)}


def main() -> None:
    """Print one block a seed, and the shares over all of them."""
    inside: list[bool] = []
    within_3: list[bool] = []
    for seed in SEEDS:
        began = time.perf_counter()
        found, truth, sines = campaign(seed)
        print(f"seed {seed} ({time.perf_counter() - began:.0f} s)")
        assert found.inverse is not None
        modes = found.inverse.modal.modes
        for name, measured, true in (
            ("frequency", modes.frequency, truth["modes"]["frequency_hz"]),
            ("loss factor", modes.loss_factor, truth["modes"]["loss_factor"]),
        ):
            errors = [100 * (a / b - 1) for a, b in zip(measured, true, strict=True)]
            print(f"  {name:<12}", " ".join(f"{error:+7.3f} %" for error in errors))
        for joint, estimate in found.inverse.joints.items():
            k = np.array(truth["inverse"][joint]["k"])
            off = {term: estimate.stiffness[at] / k[at] - 1 for term, at in TERMS.items()}
            inside += [bool(estimate.k_ci95[at][0] <= k[at] <= estimate.k_ci95[at][1]) for at in TERMS.values()]
            within_3.append(abs(off["k22"]) <= 0.03)
            print(f"  joint {joint:<6}", " ".join(f"{term} {100 * each:+5.1f} %" for term, each in off.items()))
        for amplitude, deviations, covered in by_amplitude(sines):
            worst, share = 100 * np.abs(deviations).max(axis=0), 100 * covered.mean(axis=0)
            print(
                f"  {amplitude:g} mm: k within {worst[0]:.2f} %, gamma within {worst[1]:.2f} %, "
                f"95 % intervals hold {share[0]:.0f} % and {share[1]:.0f} %",
                flush=True,
            )
    print(f"k22 within 3 %: {sum(within_3)} of {len(within_3)}")
    print(f"terms inside their 95 % intervals: {sum(inside)} of {len(inside)}")


def campaign(seed: int) -> tuple[Identification, dict[str, Any], tuple[SineTruth, ...]]:
    """Measure and identify the bench of `seed`, then ask it what it is."""
    sequence = named_sequence(BUILT_IN)
    with tempfile.TemporaryDirectory() as folder, LaboratoryProcess(seed, 100.0) as laboratory:
        settings = simulated_settings(laboratory.addresses)
        with Catalogue.open(f"sqlite:///{Path(folder) / 'campaign.db'}") as catalogue:
            run = run_sequence(sequence, instruments_of(settings), catalogue, SimulatedOperator(laboratory.hand))
            found = identify(measurement_of_run(catalogue, run))
        return found, laboratory.hand.do("truth"), sine_truths(found.measurement.points, laboratory.hand.do("dwells"))
