"""How far joints move under a blow, and joints that follow it."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
import pytest

from analysis.frequency_response import Real
from analysis.gap.bench import BlowAmplitudes, Mounting
from analysis.gap.effect import Effect
from analysis.gap.effects.joint_amplitude import CubicStiffness
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.verdict import leading, weigh
from analysis.gap.fitting.fit import as_unknowns, evaluated, fit
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.stages import CLOSE
from analysis.gap.measurement import Measurement
from analysis.gap.search.forward_selection import selected
from analysis.gap.simulation.blow_motion import (
    CONTACT,
    MOTION_DECAY,
    MOTION_LINES,
    POINT_SCATTER,
    BlowMotion,
    blow_amplitudes_of,
    half_sine,
)
from tests.analysis.gap.conftest import Made, search_among, simulation_of

POLE = np.asarray(MOTION_DECAY + 2j * np.pi * MOTION_LINES, dtype=complex)
STILL = np.zeros((1, POLE.size, 3, 3), dtype=complex)
Amplitudes = Callable[..., BlowAmplitudes]


def likelihood_of(measurement: Measurement, *effects: Effect) -> Likelihood:
    """Of a measurement and some effects."""
    return Likelihood(simulation_of(measurement, *effects))


def scores_of(likelihood: Likelihood, values: Mapping[str, float]) -> Real:
    """(unknowns,) zero but for some parameters by name."""
    scores = np.zeros(likelihood.unknowns)
    for place, each in enumerate(likelihood.simulation.shared):
        if each.name in values:
            scores[place] = values[each.name]
    return scores


@pytest.fixture
def amplitudes(empty: Measurement) -> Amplitudes:
    """Amplitudes of the joints at the centre of the priors under a cubic law with some scores."""

    def at(measurement: Measurement = empty, **values: float) -> BlowAmplitudes:
        likelihood = likelihood_of(measurement, CubicStiffness())
        found = likelihood.state(scores_of(likelihood, values)).groups[0].setting.blow_amplitudes
        assert found is not None
        return found

    return at


def test_a_half_sine_has_the_transform_of_its_samples() -> None:
    time = np.linspace(0.0, CONTACT, 20001)
    force = np.sin(np.pi * time / CONTACT)
    summed = [np.trapezoid(force * np.exp(-pole * time), time) for pole in POLE]
    assert np.allclose(half_sine(POLE), summed, rtol=1e-6)


def test_the_amplitude_is_that_of_a_mean_square_that_forgets() -> None:
    mounting = Mounting(np.array([[np.pi / 4, -3 * np.pi / 4]]), np.zeros((1, 2)), np.zeros(1), np.zeros(1))
    own, decay, impulse = 2 * np.pi * 80.0, 25.0, 3e-3
    moved = np.zeros((1, POLE.size, 1, 3), dtype=complex)
    moved[0, :, 0, 1] = impulse / ((POLE + decay) ** 2 + own**2)
    time = np.linspace(0.0, 0.3, 300_001)
    motion = impulse / own * np.exp(-decay * time) * np.sin(own * time)
    square = 2 * MOTION_DECAY * np.trapezoid(motion**2 * np.exp(-2 * MOTION_DECAY * time), time)
    shear, compression = np.exp(
        BlowMotion(moved, STILL, np.zeros(1, dtype=np.intp), np.ones(1, dtype=bool), mounting).logarithm[0]
    )
    assert np.hypot(shear, compression) == pytest.approx(np.sqrt(2 * square), rel=0.02)
    assert shear == pytest.approx(compression)


def test_each_row_moves_each_joint_by_the_blows_of_its_own(amplitudes: Amplitudes, empty: Measurement) -> None:
    own = amplitudes().own[:, 1, :, 0]
    rows = len(empty.sets[0].inputs)
    assert own.shape == (2, 2 * rows)
    assert np.allclose(own[:, rows:], 4 * own[:, :rows])  # four times the force, where stiffness is constant
    assert own[0, 0] > 1.2 * own[1, 0]  # blows on the left end
    assert own[1, 4] > 1.2 * own[0, 4]  # on the right end


def test_the_amplitude_lies_between_one_value_for_a_set_and_each_rows_own() -> None:
    logarithm = np.log(np.array([[2e-6, 4e-6], [8e-6, 4e-6], [1e-5, 1e-5]]))
    found = blow_amplitudes_of(logarithm, np.array([[0.5, 0.5, 0.0], [0.0, 0.0, 1.0]]), np.array([0, 0, 1]))
    assert np.allclose(found.amplitude(1.0, 1.0, 1.0, 1.0)[0, :, :, 0].T, np.exp(logarithm))
    assert np.allclose(found.amplitude(2.0, 1.0, 0.0, 1.0)[0, :, :2, 0], 8e-6)
    assert np.allclose(found.amplitude(1.0, 1.0, 0.0, 0.0)[0, :, 2, 0], 1e-5)
    off = replace(found, error=np.exp(0.1))
    assert np.allclose(off.amplitude(1.0, 1.0, 0.5, 0.5), np.exp(0.1) * found.amplitude(1.0, 1.0, 0.5, 0.5))


def test_joints_and_their_motion_agree(amplitudes: Amplitudes, empty: Measurement) -> None:
    """A stiffening joint moves less than in proportion to force, and the stiffness is that of the motion it makes."""
    rows = len(empty.sets[0].inputs)
    own = amplitudes(beta=20.0).own[:, 1, :, 0]
    assert np.all(own[:, rows:] < 3.9 * own[:, :rows])
    likelihood = likelihood_of(empty, CubicStiffness())
    (group,) = likelihood.state(scores_of(likelihood, {"beta": 20.0})).groups
    assert group.moving is not None
    agreed = group.moving.linearisation
    means = [agreed.motion.logarithm[:rows], agreed.motion.logarithm[rows:]]
    assert group.moving.setting.blow_amplitudes is not None
    stiffness = likelihood.simulation.joints(
        likelihood.simulation.values(
            scores_of(likelihood, {"beta": 20.0})[: len(likelihood.simulation.shared)].tolist()
        ),
        replace(
            group.moving.setting,
            blow_amplitudes=blow_amplitudes_of(
                np.array([np.mean(each, axis=0) for each in means]), np.eye(2), np.arange(2)
            ),
        ),
        group.moving.pole,
        group.moving.setups,
    )
    assert np.allclose(stiffness, agreed.stiffness, rtol=1e-7)


@pytest.mark.parametrize("by_row", [-1.0, 1.0])
def test_derivatives_hold_while_motion_follows_stiffness(empty: Measurement, by_row: float) -> None:
    likelihood = likelihood_of(empty, CubicStiffness())
    scores = scores_of(likelihood, {"beta": 10.0, "by_row": by_row})
    predicted = likelihood.predict(scores)
    places = {name: place for place, name in enumerate(each.name for each in likelihood.simulation.shared)}
    rows, errors = len(empty.sets[0].inputs), likelihood.amplitudes_of_point(empty.sets[0].inputs[3])
    of_error = np.zeros_like(np.concatenate(predicted.accelerances))
    of_error[[3, rows + 3]] = [POINT_SCATTER * each[2, 3] for each in predicted.by_amplitude]
    shared = [(place, np.concatenate([each[place] for each in predicted.by_shared])) for place in places.values()]
    for place, exact in (*[shared[places[name]] for name in ("a(I)", "beta", "by_joint")], (errors[2], of_error)):
        step = np.zeros_like(scores)
        step[place] = 1e-4
        up, down = (likelihood.predict(scores + sign * step, ()).accelerances for sign in (1, -1))
        difference = (np.concatenate(up) - np.concatenate(down)) / 2e-4
        assert np.linalg.norm(difference - exact) < 1e-3 * np.linalg.norm(exact)


def test_a_bench_of_either_kind_of_amplitude_is_fitted(empty: Measurement) -> None:
    """Joints may follow each blow's own motion, or one amplitude for each force: one model fits both."""
    few = [each.lines(np.arange(3, each.frequency.size, 5)) for each in empty.sets]
    for by_row in (-1.0, 1.0):
        likelihood = likelihood_of(replace(empty, sets=tuple(few)), CubicStiffness())
        there = scores_of(likelihood, {"beta": 3.0, "by_row": by_row, "fall": -0.625})
        read = likelihood.predict(there, ())
        sets = tuple(replace(each, accelerance=a) for each, a in zip(few, read.accelerances, strict=True))
        assert empty.points is not None
        bench = replace(empty, sets=sets, points=replace(empty.points, stiffness=read.stiffness))
        model = likelihood_of(bench, CubicStiffness())
        start = scores_of(model, {"beta": 2.0, "fall": -0.625})
        assert evaluated(model, start).chi_square > 100.0
        found = fit(model.simulation, start, CLOSE, 1e-2)
        assert found.chi_square < 1.0
        assert found.value("beta") == pytest.approx(3e8, rel=0.1)


def test_amplitude_errors_are_added_and_left_out_with_the_effect_that_has_them(empty: Measurement) -> None:
    with_motion, without = likelihood_of(empty, CubicStiffness()), likelihood_of(empty)
    assert with_motion.unknowns - without.unknowns == len(CubicStiffness().parameters) + 4 * 3 * len(
        empty.sets[0].inputs
    )
    longer = as_unknowns(np.ones(with_motion.first_blow[-1]), with_motion)
    assert longer.size == with_motion.unknowns
    assert not np.any(longer[with_motion.first_blow[-1] :])
    assert as_unknowns(np.ones(with_motion.unknowns), without).size == without.unknowns


@pytest.mark.parametrize("by_row", [-1.0, 1.0])
def test_an_effect_of_amplitude_is_named_without_a_companion(made: Made, by_row: float) -> None:
    """Whether joints follow each blow or one amplitude a set: one law was fitted beside another, or none at all."""
    bench = made((CubicStiffness(),), (3.0, 0.0, 0.0, by_row, 1.0, -0.625))
    few = tuple(each.lines(np.arange(3, each.frequency.size, 3)) for each in bench.sets)
    search = search_among(replace(bench, sets=few), {"amplitude_dependence", "cubic_stiffness", "coulomb_friction"})
    none = search.fit_paper_model()
    found = weigh(none, selected(search, none, UNCALIBRATED), UNCALIBRATED)
    assert leading(found).effects == ("cubic_stiffness",)
    assert leading(found).probability > 0.9
