"""Intervals of modes from blows of the simulated hand, with and without the scatter of single blows.

Every bench has its own beam, hand and marks. The hand lands a millimetre beside the mark, leans by a degree and strikes
by a tenth harder or softer; each mark itself is painted half a millimetre off, which no blow can tell. True modes are
those of exact accelerances at the drawing's points, at the mean temperature, for the force that the average weighs.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from analysis.frequency_response import Real
from analysis.modal.estimation import estimate_modes
from analysis.modal.spectra import responses_from_blows
from analysis.modes import Modes
from simlab.bench import Bench, Conditions
from simlab.clock import Clock
from tests.bench.bench_chain import HIGHEST, LOWEST, PRE_TRIGGER, RATE, records
from tests.bench.bench_modes import FREQUENCY, POINTS, SENSOR, exact_responses, true_modes, values

SEEDS = range(300, 315)
FORCE = 102.0  # N: blows of 100 N that scatter by a tenth, weighed by their square
BLOWS_END = 550.0  # s of bench time


def main() -> None:
    """Print rms of error over standard deviation, and the share of 95 % intervals that hold."""
    found: dict[str, list[tuple[Real, Real]]] = {"noise of lines": [], "scatter of blows": []}
    for seed in SEEDS:
        bench = Bench(seed, Clock(), Conditions(gain_error=0.0))
        force, acceleration = records(bench)
        measured = responses_from_blows(
            force, acceleration, RATE, SENSOR, POINTS, HIGHEST, pre_trigger=PRE_TRIGGER // 2
        )
        true = truth(bench)
        for name, responses in (
            ("noise of lines", replace(measured, scatter=None)),
            ("scatter of blows", measured),
        ):
            modes = estimate_modes(responses, (LOWEST, HIGHEST)).modes
            assert modes.poles.size == true.poles.size, f"bench {seed}: {modes.poles.size} modes"
            found[name].append(deviations(modes, true))
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
            rms, held = np.sqrt(np.mean(over**2)), 100 * np.mean(np.abs(over) < 1.96)
            print(f"  {name:<18}{what:<18}{rms:6.2f}{held:7.0f} %", flush=True)


def truth(bench: Bench) -> Modes:
    """Modes of the bench as it was while it was struck."""
    temperature = float(np.mean([bench.temperature(time) for time in np.linspace(0.0, BLOWS_END, 111)]))
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
