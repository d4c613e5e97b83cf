"""The smooth function that takes up what no law explains: its place, its values within their band, its likeness."""

import numpy as np
import pytest

from analysis.frequency_response import Complex
from analysis.gap.bench import Setting
from analysis.gap.catalogue import effect_ids
from analysis.gap.diagnosis import diagnose
from analysis.gap.effect import Effect, Given
from analysis.gap.evidence.verdict import Status
from analysis.gap.findings.shape_search import found_shape, resemblance
from analysis.gap.fitting.held_out import Gap, HeldOut
from analysis.gap.measurement import Measurement, Rig, TesterPoints
from analysis.gap.outside_catalogue.local_change import FixedAcross, local_changes
from analysis.gap.outside_catalogue.shape import (
    KNOTS,
    ChainShape,
    FoundShape,
    JointOverSets,
    Smooth,
    TesterShape,
    shape_at,
    shapes_of_readings,
)
from analysis.gap.parameter import Parameter
from analysis.gap.search.single_effects import search_of
from tests.analysis.gap.conftest import Made

LINES = 40
BEFORE = Gap(50.0, 50.0, 50.0, 50.0)
DEPTH = Parameter("depth", "1", 0.0, 1.0)
AT = np.linspace(20.0, 500.0, 60)


class Wave(ChainShape):
    """A reading that waves with frequency, which no law of the catalogue does."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (DEPTH,)

    def relative(self, given: Given, setting: Setting) -> Complex:
        return given["depth"] * wave(setting.frequency)[None]


class TesterWave(TesterShape):
    """The same in the tester."""

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (DEPTH,)

    def tester(self, given: Given, stiffness: Complex, points: TesterPoints) -> Complex:
        return np.asarray(stiffness * (1 + given["depth"] * wave(points.frequency)))


def wave(frequency: np.ndarray) -> Complex:
    return np.asarray(np.sin(frequency / 90.0) + 0.5j * np.cos(frequency / 120.0))


def found(measurement: Measurement, *rivals: Effect) -> FoundShape:
    search = search_of(measurement, (), LINES)
    none = search.fit_paper_model()
    visited = search.fitted_everywhere(none, rivals, [none]) if rivals else []
    shape = found_shape(search, none, visited, measurement.thinned(LINES), HeldOut(BEFORE, BEFORE, (0.0, 0.0)))
    assert shape is not None
    return shape


def within(shape: FoundShape, truth: Complex) -> float:
    """Share of the range over which the band holds both parts of the truth."""
    real = (shape.low.real <= truth.real) & (truth.real <= shape.high.real)
    imaginary = (shape.low.imag <= truth.imag) & (truth.imag <= shape.high.imag)
    return float(np.mean(real & imaginary))


def test_a_reading_that_waves_is_found_in_the_channel(made: Made) -> None:
    shape = found(made((Wave(),), (0.08,)), *some_places(made))
    assert shape.place == {"rig": Rig.BEAM, "at": "channel"}
    assert (shape.over, shape.unit) == ("frequency", "1")
    assert shape.after < 5.0
    size = float(np.max(np.abs(shape.value)))
    assert size == pytest.approx(0.08, rel=0.4)


def test_a_damper_at_a_joint_is_found_there_and_looks_like_one(made: Made) -> None:
    places = some_places(made)
    measurement = made((places[0],), (0.0, 1.5, 0.0, 0.3))
    shape = found(measurement, *places)
    own = {each.name: each.value(score) for each, score in zip(places[0].parameters, (0.0, 1.5, 0.0, 0.3), strict=True)}
    assert shape.place["motion"] == "y"
    assert shape.place["position"] == pytest.approx(own["position"], abs=0.02)
    assert shape.resembles == "dashpot"
    assert within(shape, np.asarray(2j * np.pi * shape.at * own["c"])) >= 0.8


def test_a_tester_that_waves_is_found_in_the_tester(made: Made) -> None:
    shape = found(made((TesterWave(),), (0.05,)), *some_places(made))
    assert shape.place["rig"] == Rig.TESTER
    assert shape.over == "frequency"


def test_a_joint_that_differs_from_set_to_set_is_found(made: Made) -> None:
    step = JointOverSets(Smooth(0.0, 1.0), joint=1)
    shape = found(made((step,), (0.8,) + (0.0,) * 15), *some_places(made))
    assert shape.place == {"rig": Rig.BEAM, "at": "joint II"}
    assert shape.over == "set"


def some_places(made: Made) -> list[FixedAcross]:
    """Two of the places from which a search begins."""
    known = [each for each in local_changes(made()) if type(each) is FixedAcross]
    return [known[3], known[5]]


@pytest.mark.parametrize(
    ("value", "name"),
    [
        (-0.02 * (2 * np.pi * AT) ** 2, "mass"),
        (np.full(60, 3e4), "spring"),
        (2j * np.pi * AT * 12.0, "dashpot"),
        (1e5 - 0.02 * (2 * np.pi * AT) ** 2, "mass and spring"),
        (-1e5 + 2j * np.pi * AT * 40.0, "negative spring and dashpot"),
        (2e4 * np.sin(AT / 20), ""),
    ],
)
def test_a_function_resembles_something_simple_or_nothing(empty: Measurement, value: Complex, name: str) -> None:
    shape = shape_at(FixedAcross(0.5, 0.9, 9.0, 3e4), empty)
    half = np.full(60, 0.02 * (1 + 1j) * np.max(np.abs(value)))
    assert resemblance(shape, AT, np.asarray(value, dtype=complex), half) == name


def test_a_late_channel_resembles_a_delay(empty: Measurement) -> None:
    value = np.exp(-2j * np.pi * AT * 3e-5) - 1
    assert resemblance(next(shapes_of_readings(empty)), AT, value, np.full(60, 1e-3 * (1 + 1j))) == "delay"


def test_heights_follow_the_covariance_of_the_process(points: TesterPoints) -> None:
    smooth = Smooth(1.0, 5.0, length=0.4, size=0.2)
    knots = np.linspace(1.0, 5.0, KNOTS)
    covariance = smooth.basis(knots) @ smooth.basis(knots).T
    distance = (knots[:, None] - knots) / 4.0
    np.testing.assert_allclose(covariance, 0.04 * np.exp(-((distance / 0.4) ** 2) / 2), atol=1e-4 * 0.04)
    given = {each.name: 1.0 for each in smooth.parameters}
    assert smooth.at(given, points.amplitude).shape == points.amplitude.shape


def test_a_diagnosis_without_an_answer_shows_the_shape(made: Made) -> None:
    damper = some_places(made)[0]
    measurement = made((damper,), (0.0, 1.5, 0.0, 0.3)).thinned(LINES)
    diagnosis = diagnose(measurement, without=frozenset(effect_ids()) - {"highpass_corner"})
    assert diagnosis.status is Status.UNKNOWN
    curve = diagnosis.remainder.curve
    assert curve is not None
    assert (curve.place["motion"], curve.resembles) == ("y", "dashpot")
    assert curve.after < curve.before / 2
    assert curve.before == diagnosis.before.overall.percent
