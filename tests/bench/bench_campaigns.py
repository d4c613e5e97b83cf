"""The demo's accuracy over several benches: each seed is another bench, another hand and other noise.

For each seed the whole campaign through the wires; printed are the errors against what the bench really is.
"""

import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from analysis.frequency_response import Real
from analysis.inverse.joint_estimate import IdentifiedJoint
from api.commands.sequences import named_sequence
from jointlab.identification.inverse import METHODS
from jointlab.identification.load import measurement_of_run
from jointlab.identification.pipeline import Identification, identify
from jointlab.instruments import instruments_of
from jointlab.runs.carry_out import run_sequence
from jointlab.sequences import BUILT_IN
from jointlab.trials.simulated_laboratory import simulated_settings
from jointlab.trials.simulated_operator import SimulatedOperator
from jointlab.trials.simulated_truth import SineTruth, by_amplitude, sine_truths
from simlab.laboratory import LaboratoryProcess
from store.catalogue import Catalogue

SEEDS = range(1, 9)
TERMS = {"k11": (0, 0), "k12": (0, 1), "k22": (1, 1)}


def main() -> None:
    """Print one block a seed, and the shares over all of them."""
    tallies = {name: Tally([], [], []) for name in METHODS.values()}
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
        for route in found.inverse.results:
            tally = tallies[METHODS[route.method]]
            for joint, estimate in route.joints.items():
                off = tally.add(estimate, np.array(truth["inverse"][joint]["k"]))
                print(f"  joint {joint:<3} {route.method:<36} {off}")
        for amplitude, deviations, covered in by_amplitude(sines):
            worst, share = 100 * np.abs(deviations).max(axis=0), 100 * covered.mean(axis=0)
            print(
                f"  {amplitude:g} mm: k within {worst[0]:.2f} %, gamma within {worst[1]:.2f} %, "
                f"95 % intervals hold {share[0]:.0f} % and {share[1]:.0f} %",
                flush=True,
            )
    for method, tally in tallies.items():
        print(f"{method}: {tally}")


@dataclass
class Tally:
    """What adds up over joints: errors of k22 and k12, and whether the intervals of observable terms hold the truth."""

    k22: list[float]
    k12: list[float]
    inside: list[bool]

    def add(self, estimate: IdentifiedJoint, k: Real) -> str:
        """Count one joint and say how far off it is."""
        off = {term: float(estimate.stiffness[at] / k[at] - 1) for term, at in TERMS.items()}
        self.k22.append(abs(off["k22"]))
        self.k12.append(abs(off["k12"]))
        ends = {at: estimate.k_ci95[at] for at in TERMS.values() if estimate.observable[at]}
        self.inside += [bool(low <= k[at] <= high) for at, (low, high) in ends.items()]
        return " ".join(f"{term} {100 * each:+6.2f} %" for term, each in off.items())

    def __str__(self) -> str:
        return (
            f"k22 within {100 * max(self.k22):.2f} %, within 3 % in {sum(k <= 0.03 for k in self.k22)} of "
            f"{len(self.k22)}; k12 within {100 * max(self.k12):.2f} %; observable terms inside their intervals: "
            f"{sum(self.inside)} of {len(self.inside)}"
        )


def campaign(seed: int) -> tuple[Identification, dict[str, Any], tuple[SineTruth, ...]]:
    """Measure and identify the bench of `seed`, then ask it what it is."""
    sequence = named_sequence(BUILT_IN)
    with tempfile.TemporaryDirectory() as folder, LaboratoryProcess(seed, 100.0) as laboratory:
        settings = simulated_settings(laboratory.addresses)
        with Catalogue.open(f"sqlite:///{Path(folder) / 'campaign.db'}") as catalogue:
            run = run_sequence(sequence, instruments_of(settings), catalogue, SimulatedOperator(laboratory.operator))
            found = identify(measurement_of_run(catalogue, run))
        return (
            found,
            laboratory.operator.do("truth"),
            sine_truths(found.measurement.points, laboratory.operator.do("dwells")),
        )
