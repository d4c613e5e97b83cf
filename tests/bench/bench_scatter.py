"""Intervals of modes and joints from blows of the simulated hand, with and without the scatter of single blows.

Every bench has its own beam, hand and marks. The hand lands a millimetre beside the mark, leans by a degree and strikes
by a tenth harder or softer; each mark itself is painted half a millimetre off, which no blow can tell. True modes are
those of exact accelerances at the drawing's points, at the mean temperature, for the mean force; true joints likewise.
"""

from dataclasses import replace

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.modal.estimation import estimate_modes
from analysis.modal.spectra import responses_from_blows
from analysis.modes import Modes
from analysis.structure.beam import Mesh
from analysis.structure.converged import assemble_converged
from analysis.structure.joints import Joint
from simlab.article import JOINT_NODES, NODE_POSITIONS
from simlab.bench import SimulatedBench, ordinary_bench
from simlab.clock import Clock
from simlab.elastomer import BLOW_AMPLITUDE
from simlab.ordinary import BenchConditions
from simlab.truth import BLOW_BAND
from tests.bench.bench_chain import BEAM, BY_HAND, DAMPING, HIGHEST, LOWEST, PRE_TRIGGER, RATE, records
from tests.bench.bench_modes import FREQUENCY, POINTS, SENSOR, exact_responses, true_modes, values

SEEDS = range(300, 348)
FORCE = 100.0  # N
BLOWS_END = 550.0  # s of bench time
TERMS = {(0, 0): 0, (0, 1): 1, (1, 1): 3}  # and their places among the six of a matrix

Held = tuple[float, bool, float]
"""Error over standard deviation, whether the 95 % interval holds, and its half-width over the term."""


def main() -> None:
    """Print rms of error over standard deviation, and the share of 95 % intervals that hold."""
    found: dict[str, list[tuple[Real, Real]]] = {"noise of lines": [], "scatter of blows": []}
    joints: list[dict[str, Held]] = []
    converged = assemble_converged(BEAM, Mesh.through(NODE_POSITIONS, 8), damping_ratios=DAMPING)
    for seed in SEEDS:
        bench = ordinary_bench(seed, Clock(), BenchConditions(gain_error=0.0))
        force, acceleration = records(bench)
        measured = responses_from_blows(
            force, acceleration, RATE, SENSOR, POINTS, HIGHEST, pre_trigger=PRE_TRIGGER // 2
        )
        true = truth(bench)
        for name, responses in (("noise of lines", replace(measured, scatter=None)), ("scatter of blows", measured)):
            modes = estimate_modes(responses, (LOWEST, HIGHEST)).modes
            assert modes.poles.size == true.poles.size, f"bench {seed}: {modes.poles.size} modes"
            found[name].append(deviations(modes, true))
        exact = true_joints(bench)
        start = [Joint(name, JOINT_NODES[name], 1.05 * z) for name, z in exact.items()]
        fit = identify_from_responses(converged, measured, start, tolerances=BY_HAND)
        joints.append(held(fit, exact))
    along = np.array([point.direction == "x" for point in POINTS] * 2)
    print(f"{len(SEEDS)} benches, 110 blows each; rms error over standard deviation, and 95 % intervals that hold")
    for name, runs in found.items():
        poles, constants = (np.array(each) for each in zip(*runs, strict=True))
        for what, over in (
            ("frequencies", poles[..., 0]),
            ("loss factors", poles[..., 1]),
            ("constants across", constants[..., ~along]),
            ("constants along", constants[..., along]),
        ):
            rms, share = np.sqrt(np.mean(over**2)), 100 * np.mean(np.abs(over) < 1.96)
            print(f"  {name:<18}{what:<18}{rms:6.2f}{share:7.0f} %", flush=True)
    print("joints by maximum likelihood: mean and rms error over standard deviation, intervals that hold, half-width")
    for term in joints[0]:
        over, inside, half = (np.array(column) for column in zip(*(each[term] for each in joints), strict=True))
        print(
            f"  {term:<10}{np.mean(over):+7.2f}{np.sqrt(np.mean(over**2)):7.2f}{100 * np.mean(inside):6.0f} %"
            f"{100 * np.median(half):9.2f} %"
        )


def true_joints(bench: SimulatedBench) -> dict[str, Complex]:
    """k + i h of each joint while the bench was struck, the mean over the band that identification states it for."""
    amplitude, temperature = BLOW_AMPLITUDE * FORCE / 100.0, mean_temperature(bench)
    return {
        name: joint.dynamic_stiffness(amplitude, BLOW_BAND, temperature).mean(axis=0)
        for name, joint in bench.built.article.joints.items()
    }


def held(fit: JointFit, exact: dict[str, Complex]) -> dict[str, Held]:
    """By term of each joint; ``checks`` counts fits that passed all of theirs."""
    found: dict[str, Held] = {}
    for name, joint in fit.joints.items():
        deviation = np.sqrt(np.diag(joint.covariance)).reshape(2, -1)
        parts = zip("kh", (joint.stiffness, joint.damping), (joint.k_ci95, joint.h_ci95), deviation, strict=True)
        for letter, value, ends, deviations_of_part in parts:
            true = exact[name].real if letter == "k" else exact[name].imag
            for at, place in TERMS.items():
                low, high = ends[at]
                found[f"{letter}{at[0] + 1}{at[1] + 1}({name})"] = (
                    float((value[at] - true[at]) / deviations_of_part[place]),
                    bool(low <= true[at] <= high),
                    float((high - low) / 2 / abs(true[at])),
                )
    found["checks"] = (0.0, fit.passed, 0.0)
    return found


def mean_temperature(bench: SimulatedBench) -> float:
    """In degrees Celsius, while it was struck."""
    return float(np.mean([bench.temperature(time) for time in np.linspace(0.0, BLOWS_END, 111)]))


def truth(bench: SimulatedBench) -> Modes:
    """Modes of the bench as it was while it was struck."""
    temperature = mean_temperature(bench)
    exact = np.array(
        [
            bench.accelerance(FREQUENCY, point.node, point.direction, peak_force=FORCE, temperature=temperature)
            for point in POINTS
        ]
    )
    return true_modes(replace(exact_responses(bench), accelerance=exact))


def deviations(modes: Modes, true: Modes) -> tuple[Real, Real]:
    """Errors over standard deviations: (modes, 2) of frequency and loss factor, (modes, 2 rows) of the constants."""
    assert modes.pole_covariance is not None
    assert modes.shape_covariance is not None
    error = modes.shapes - true.shapes
    spread = np.sqrt(np.diagonal(modes.shape_covariance, axis1=1, axis2=2))
    pole_spread = np.sqrt(np.diag(modes.pole_covariance)).reshape(-1, 2)
    return (values(modes) - values(true)) / pole_spread, np.concatenate([error.real, error.imag], axis=1) / spread


if __name__ == "__main__":
    main()
