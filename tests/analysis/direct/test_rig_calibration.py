import math
from dataclasses import replace

import numpy as np
import pytest

from analysis.direct.corrections import TesterEffect
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.rig_calibration import CalibrationRun, KnownSpecimen, RigCalibration, calibrate_rig
from analysis.errors import AnalysisError
from tests.analysis.direct.points import from_polar, measured_stiffness

LAG, FRAME, INERTIA = TesterEffect.TRANSDUCER_LAG, TesterEffect.FRAME_COMPLIANCE, TesterEffect.FIXTURE_INERTIA
VALUES = {LAG: 120e-6, FRAME: 0.2e-6, INERTIA: 0.12}
BLANK, RIGID, MASS, EMPTY = (
    KnownSpecimen(stiffness=2e8),
    KnownSpecimen(stiffness=math.inf),
    KnownSpecimen(mass=0.5),
    KnownSpecimen(),
)


def run(
    specimen: KnownSpecimen,
    rng: np.random.Generator | None = None,
    error: float = 0.002,
    values: dict[TesterEffect, float] = VALUES,
    frequencies: tuple[float, ...] = (20.0, 50.0, 80.0, 110.0, 140.0, 170.0, 200.0),
) -> CalibrationRun:
    """Points with `error` of their magnitude, or exact ones where there is no `rng`."""
    points = []
    for frequency in frequencies:
        if specimen.is_rigid:
            seen = measured_stiffness(1e20, frequency, values)
        else:
            seen = measured_stiffness(
                specimen.stiffness - (2 * math.pi * frequency) ** 2 * specimen.mass, frequency, values
            )
        noise = 0j if rng is None else complex(*rng.standard_normal(2)) * error * abs(seen)
        points.append(replace(bare(frequency, abs(seen), error), complex_stiffness=seen + noise))
    return CalibrationRun(specimen, tuple(points))


def bare(frequency: float, magnitude: float, error: float) -> DynamicStiffness:
    return from_polar(frequency, 1e-5, magnitude, 0.0, error)


@pytest.mark.parametrize("specimens", [(BLANK, EMPTY), (RIGID, MASS), (BLANK, RIGID, MASS, EMPTY), (MASS, EMPTY)])
def test_exact_runs_give_the_parameters_exactly(specimens: tuple[KnownSpecimen, ...]) -> None:
    found = calibrate_rig([run(specimen) for specimen in specimens])
    for effect, value in VALUES.items():
        assert found.corrections.values[effect] == pytest.approx(value, rel=1e-6)
    assert found.chi_square == pytest.approx(0, abs=1e-6)
    assert found.warnings == ()


def repeated(runs: int) -> list[RigCalibration]:
    rng = np.random.default_rng(2)
    return [calibrate_rig([run(BLANK, rng), run(EMPTY, rng)]) for _ in range(runs)]


def test_errors_are_those_of_repeats_and_chi_square_is_its_degrees_of_freedom() -> None:
    found = repeated(300)
    for effect, value in VALUES.items():
        z = [
            (each.corrections.values[effect] - value) / each.corrections.estimate(effect).standard_error
            for each in found
        ]
        # 300 repeats know a standard deviation to 4 %
        assert np.std(z) == pytest.approx(1, abs=0.13)
        assert np.mean(z) == pytest.approx(0, abs=0.18)
    assert np.mean([each.chi_square / each.degrees_of_freedom for each in found]) == pytest.approx(1, abs=0.06)


def test_a_rigid_blank_alone_leaves_the_inertia_undetermined_and_says_so() -> None:
    found = calibrate_rig([run(RIGID)])
    assert set(found.corrections.values) == {LAG, FRAME}
    assert found.warnings == ("fixture_inertia: these runs do not determine m; it is taken to be zero",)


def test_an_effect_that_is_left_out_is_not_sought() -> None:
    values = {LAG: 0.0, FRAME: 0.2e-6, INERTIA: 0.0}
    found = calibrate_rig([run(BLANK, values=values)], effects=(FRAME,))
    assert dict(found.corrections.values) == pytest.approx({FRAME: 0.2e-6})


def test_runs_of_two_rigs_are_called_inconsistent_and_widen_the_errors() -> None:
    rng = np.random.default_rng(0)
    other = VALUES | {FRAME: 0.21e-6}
    runs = [run(BLANK, rng), run(EMPTY, rng), run(BLANK, rng, values=other)]
    found = calibrate_rig(runs)
    assert any("contradict" in warning for warning in found.warnings)
    honest = calibrate_rig(runs[:2]).corrections.estimate(FRAME).standard_error
    assert found.corrections.estimate(FRAME).standard_error > honest


def test_too_few_points_are_warned_about() -> None:
    found = calibrate_rig([run(BLANK, frequencies=(50.0,)), run(EMPTY, frequencies=(50.0,))])
    assert any("too few" in warning for warning in found.warnings)


def test_a_parameter_lost_in_its_error_is_warned_about() -> None:
    rng = np.random.default_rng(1)
    values = VALUES | {LAG: 0.0}
    found = calibrate_rig([run(BLANK, rng, values=values), run(EMPTY, rng, values=values)])
    assert any(warning.startswith("transducer_lag: tau =") for warning in found.warnings)


def test_what_is_not_known_of_the_blank_is_not_known_of_the_frame() -> None:
    blank = replace(BLANK, stiffness_standard_error=2e6)
    found = calibrate_rig([run(blank), run(EMPTY)])
    assert found.corrections.estimate(FRAME).standard_error > 2e6 / 2e8**2


def test_runs_without_a_point_are_refused() -> None:
    with pytest.raises(AnalysisError, match="no point"):
        calibrate_rig([CalibrationRun(EMPTY, ())])


def test_a_rigid_blank_without_a_frame_to_find_is_refused() -> None:
    with pytest.raises(AnalysisError, match="rigid blank"):
        calibrate_rig([run(RIGID)], effects=(LAG,))


def test_asking_for_nothing_is_refused() -> None:
    with pytest.raises(AnalysisError, match="no effect to look for"):
        calibrate_rig([run(EMPTY)], effects=())
