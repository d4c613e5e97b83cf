"""The direct method against the truth: how often it is right, and how right once the tester has been corrected for.

No wires: the simulated actuator and elastomer in process, settled by the rig's own rules. Every seed is another bench,
another machine and other noise, and one of the six mountings with the paper's 120 points of it.
"""

import time
from collections.abc import Callable, Sequence
from itertools import product

import numpy as np

from analysis.direct.corrections import TesterEffect, correct
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.law_fit import fit_elastomer_law
from analysis.direct.rig_calibration import CalibrationRun, KnownSpecimen, calibrate_rig
from analysis.frequency_response import Real
from analysis.interval import Estimate
from simlab.bench import ordinary_bench
from simlab.tester_frame import PIECES, TesterFrame
from tests.bench.wireless_tester import HandClock, Measured, calibration_sweep, paper_sweep
from tests.simlab.specimens import stiffness_of

SWEEPS = 204
CORRECTED_SWEEPS = 24
LAW_SWEEPS = 24
MOUNTINGS = tuple(product(("I", "II"), ("compression", "shear", "angled")))
FRAME = TesterFrame(compliance=0.03e-6, fixture_mass=0.15, delay=150e-6)
BLOW_PP = 4e-6  # m
ASKED_PP = (BLOW_PP, 0.7e-5, 1.5e-5, 3e-5, 7e-5)  # where nothing was measured
ASKED_FREQUENCIES = (8.0, 33.0, 77.0, 187.0)  # Hz


def main() -> None:
    """Print a table for each question."""
    began = time.perf_counter()
    sweeps = [paper_sweep(seed, *MOUNTINGS[seed % 6], TesterFrame()) for seed in range(SWEEPS)]
    points = [measured for sweep in sweeps for measured in sweep]
    print(f"{len(sweeps)} sweeps, {len(points)} points, {time.perf_counter() - began:.0f} s")
    show_coverage(points)
    show_corrections(sweeps[:CORRECTED_SWEEPS])
    show_law(sweeps[:LAW_SWEEPS])


def show_coverage(points: Sequence[Measured]) -> None:
    """Whether errors are what they say: 99 % within 3 standard errors, 95 % intervals that hold 93 to 97 %."""
    print(f"  {'':<28} points     k: inside 95 %  within 3 se  rms z   gamma: inside 95 %  within 3 se  rms z")
    show_row("all", points)
    for wanted_pp in (1e-4, 5e-5, 1e-5):
        show_row(f"{1e3 * wanted_pp:g} mm", [each for each in points if each.wanted_pp == wanted_pp])
    for low, high in ((0, 22), (22, 62), (62, 201)):
        inside = [each for each in points if low < each.point.frequency < high]
        show_row(f"{inside[0].point.frequency:.0f} to {max(e.point.frequency for e in inside):.0f} Hz", inside)


def show_row(name: str, points: Sequence[Measured]) -> None:
    """One line of `show_coverage`."""
    k = standing([(each.point.stiffness_estimate, each.truth.real) for each in points])
    gamma = standing([(each.point.loss_factor_estimate, each.truth.imag / each.truth.real) for each in points])
    print(f"  {name:<28} {len(points):6d} {k:>36} {gamma:>40}", flush=True)


def standing(pairs: Sequence[tuple[Estimate, float]]) -> str:
    """Share inside the intervals, share within three standard errors, and root mean square of errors over theirs."""
    z = np.array([(estimate.value - truth) / estimate.standard_error for estimate, truth in pairs])
    inside = np.mean([low <= truth <= high for (low, high), truth in ((e.interval(), t) for e, t in pairs)])
    return f"{100 * inside:.1f} %      {100 * np.mean(np.abs(z) < 3):.1f} %   {np.sqrt(np.mean(z**2)):.2f}"


def show_corrections(without: Sequence[Sequence[Measured]]) -> None:
    """Frame, fixture and lag on: how far off as measured, as corrected, and in the same sweeps `without` them."""
    began = time.perf_counter()
    before: list[Real] = []
    after: list[Real] = []
    corrected: list[Measured] = []
    for seed in range(len(without)):
        calibration = calibrate_rig(
            [
                CalibrationRun(
                    KnownSpecimen(PIECES["blank"].stiffness), tuple(calibration_sweep(seed, "blank", 1e-5, FRAME))
                ),
                CalibrationRun(KnownSpecimen(), tuple(calibration_sweep(seed + 1000, "empty", 1e-4, FRAME))),
            ]
        )
        sweep = paper_sweep(seed, *MOUNTINGS[seed % 6], FRAME)
        found = correct([measured.point for measured in sweep], calibration.corrections)
        before.append(relative_errors([measured.point for measured in sweep], sweep))
        after.append(relative_errors(found, sweep))
        corrected += [Measured(p, each.truth, each.wanted_pp) for p, each in zip(found, sweep, strict=True)]
        if seed == 0:
            for effect in TesterEffect:
                estimate = calibration.corrections.estimate(effect)
                print(
                    f"  {effect:<18} found {estimate.value:.5g} +- {estimate.standard_error:.2g}, true {true(effect)}"
                )
            print(
                f"  chi-square {calibration.chi_square:.1f} on {calibration.degrees_of_freedom}", calibration.warnings
            )
    print(f"{len(without)} sweeps with frame, fixture and lag, {time.perf_counter() - began:.0f} s")
    plain = [relative_errors([measured.point for measured in sweep], sweep) for sweep in without]
    print(f"  {'error that 99 % of points are within, and the worst':<54} k_d              k                 gamma")
    for name, parts in (("as measured", before), ("as corrected", after), ("without frame, fixture and lag", plain)):
        errors = 100 * np.concatenate(parts)
        columns = zip(np.quantile(errors, 0.99, axis=0), np.max(errors, axis=0), strict=True)
        print(f"  {name:<50}" + "".join(f"{usual:7.2f} {worst:6.2f} %" for usual, worst in columns))
    show_row("as corrected", corrected)


def true(effect: TesterEffect) -> float:
    """The parameter that the tester really has."""
    return {
        TesterEffect.TRANSDUCER_LAG: FRAME.delay,
        TesterEffect.FRAME_COMPLIANCE: FRAME.compliance,
        TesterEffect.FIXTURE_INERTIA: FRAME.fixture_mass,
    }[effect]


def relative_errors(points: Sequence[DynamicStiffness], sweep: Sequence[Measured]) -> Real:
    """(points, 3) of the complex stiffness, of k and of gamma."""
    return np.array(
        [
            (
                abs(point.complex_stiffness / each.truth - 1),
                abs(point.stiffness / each.truth.real - 1),
                abs(point.loss_factor / (each.truth.imag / each.truth.real) - 1),
            )
            for point, each in zip(points, sweep, strict=True)
        ]
    )


def show_law(sweeps: Sequence[Sequence[Measured]]) -> None:
    """The fitted law where nothing was measured, an amplitude below all that was measured among them."""
    seconds: list[float] = []
    found: dict[float, list[tuple[DynamicStiffness, complex]]] = {amplitude: [] for amplitude in ASKED_PP}
    for seed, sweep in enumerate(sweeps):
        began = time.perf_counter()
        law = fit_elastomer_law([measured.point for measured in sweep])
        seconds.append(time.perf_counter() - began)
        truth = truth_of(seed)
        for amplitude_pp, frequency in product(ASKED_PP, ASKED_FREQUENCIES):
            found[amplitude_pp].append((law.at(amplitude_pp, frequency), truth(amplitude_pp, frequency)))
    print(f"law through {len(sweeps[0])} points: {np.median(seconds):.2f} s, {len(sweeps)} of them")
    for amplitude_pp, pairs in found.items():
        off = [abs(point.stiffness / true.real - 1) for point, true in pairs]
        known = [point.stiffness_estimate.half_width() / point.stiffness for point, _ in pairs]
        k = standing([(point.stiffness_estimate, true.real) for point, true in pairs])
        gamma = standing([(point.loss_factor_estimate, true.imag / true.real) for point, true in pairs])
        print(
            f"  {1e3 * amplitude_pp:5.3f} mm  k off by {100 * np.median(off):.1f} % (worst {100 * max(off):.1f} %), "
            f"interval +-{100 * np.median(known):.1f} %, {k}   gamma {gamma}"
        )


def truth_of(seed: int) -> Callable[[float, float], complex]:
    """Stiffness at a peak-to-peak amplitude in m and a frequency in Hz, in the middle of the room's temperatures."""
    bench = ordinary_bench(seed, HandClock())
    specimen, configuration = MOUNTINGS[seed % 6]
    temperature = bench.temperature(0.0)
    return lambda amplitude_pp, frequency: complex(
        stiffness_of(bench.built, specimen, configuration, amplitude_pp / 2, frequency, temperature)
    )
