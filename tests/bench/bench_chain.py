"""The whole inverse identification: 110 blows of 2 s at 4096 Hz, time histories to joint matrices with intervals.

The simulated joints are about those of the paper's Table 2, so intervals stand beside the paper's own.
"""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np

from analysis.frequency_response import Real
from analysis.inverse.identification import identify_joints
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.inverse.tolerances import FREEHAND_LEAN
from analysis.modal.blow_check import BlowLimits, check_blow
from analysis.modal.estimation import estimate_modes
from analysis.modal.spectra import responses_from_blows
from analysis.structure.beam import Beam, Mesh, assemble
from analysis.structure.converged import assemble_converged
from simlab.article import JOINT_NODES, NODE_POSITIONS
from simlab.bench import SimulatedBench, ordinary_bench
from simlab.clock import Clock
from tests.bench.bench_joint_likelihood import STATED
from tests.bench.bench_modes import POINTS, SENSOR
from tests.bench.paper_bench import INTERVALS

RATE = 4096.0
SAMPLES = 8192
PRE_TRIGGER = 205
BLOWS = 10
HIGHEST = 1024.0
LOWEST = 20.0
REPEATS = 5
BEAM = Beam(0.914, 0.0254, 0.0507874, youngs_modulus=207e9, poisson_ratio=0.3, density=7850.0)  # as drawn
DAMPING = (0.004, 0.001, 0.001)
BY_HAND = replace(STATED, blow_lean=FREEHAND_LEAN)

Result = TypeVar("Result")


def main() -> None:
    """Print the least seconds of each step out of a few repeats, on one thread."""
    bench = ordinary_bench(1, Clock())
    force, acceleration = records(bench)
    limits = BlowLimits(lowest_peak_force=30.0, highest_frequency=HIGHEST)
    free_beam = assemble(BEAM, Mesh.through(NODE_POSITIONS), damping_ratios=DAMPING)
    converged = assemble_converged(BEAM, Mesh.through(NODE_POSITIONS, 8), damping_ratios=DAMPING)

    def verdicts() -> list[bool]:
        return [
            check_blow(f, a, RATE, PRE_TRIGGER, limits).accepted
            for forces, accelerations in zip(force, acceleration, strict=True)
            for f, a in zip(forces, accelerations, strict=True)
        ]

    accepted, checking = timed(verdicts)
    responses, spectra = timed(
        lambda: responses_from_blows(force, acceleration, RATE, SENSOR, POINTS, HIGHEST, pre_trigger=PRE_TRIGGER // 2)
    )
    modal, fitting = timed(lambda: estimate_modes(responses, (LOWEST, HIGHEST)))
    joints, joining = timed(lambda: identify_joints(free_beam, modal.modes, JOINT_NODES))
    fit, likelihood = timed(
        lambda: identify_from_responses(
            converged, responses, [joint.joint for joint in joints.values()], tolerances=BY_HAND
        )
    )
    print(f"{sum(accepted)} of {len(accepted)} blows accepted, {modal.modes.poles.size} modes")
    for name, seconds in (
        ("check of the blows", checking),
        ("accelerances with variance", spectra),
        ("modes with covariance", fitting),
        ("joint matrices, paper's method", joining),
        ("joint matrices, likelihood", likelihood),
        ("together", checking + spectra + fitting + joining + likelihood),
    ):
        print(f"  {name:<32}{1e3 * seconds:7.0f} ms")
    print(f"  likelihood: {'converged' if fit.checks[-1].passed else 'not converged'}; 95 % intervals, MN/m")
    for name in joints:
        true = bench.truth()["inverse"][name]["k"]
        for term, at in (("k12", (0, 1)), ("k22", (1, 1))):
            (low, high), (paper_low, paper_high) = fit.joints[name].k_ci95[at], INTERVALS[name][term][0]
            by_modes = "{:.3f} .. {:.3f}".format(*(joints[name].k_ci95[at] / 1e6))
            narrower = abs((paper_high - paper_low) / (paper_high + paper_low)) / abs((high - low) / (high + low))
            print(
                f"  {term}({name}) true {true[at[0]][at[1]] / 1e6:.4f}: paper's method {by_modes}, likelihood "
                f"{low / 1e6:.4f} .. {high / 1e6:.4f}, {narrower:.1f} times narrower than Table 2's"
            )


def records(bench: SimulatedBench) -> tuple[list[Real], list[Real]]:
    """Force and acceleration (blows, samples) of clean blows at every point."""
    force, acceleration, time_of_blow = [], [], 1.0
    for point in POINTS:
        pairs = []
        for _ in range(BLOWS):
            bench.strike(point.node, str(point.direction), at=time_of_blow, what="clean")
            start = round((time_of_blow * RATE) - PRE_TRIGGER) / RATE
            pairs.append(bench.hammer_signals(start, RATE, SAMPLES))
            time_of_blow += 5.0
        force.append(np.array([pair["hammer"] for pair in pairs]))
        acceleration.append(np.array([pair["accelerometer"] for pair in pairs]))
    return force, acceleration


def timed(work: Callable[[], Result]) -> tuple[Result, float]:
    """What the work gives, and the least seconds it took."""
    took = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        result = work()
        took.append(time.perf_counter() - began)
    return result, min(took)


if __name__ == "__main__":
    main()
