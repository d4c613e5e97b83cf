"""A base that all joints share: the right response, and the answer that no foundation of one joint caused it."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.gap.effect import Effect
from analysis.gap.effects.joint_amplitude import AmplitudeDependence
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.verdict import UNKNOWN, leading, weigh
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.measurement import Measurement
from analysis.gap.outside_catalogue.common_base import CommonBase, common_base
from analysis.gap.search.forward_selection import selected
from tests.analysis.gap.conftest import Made, search_among, simulation_of
from tests.analysis.gap.simulation.test_two_rigs import analytic, numeric

FREQUENCY, STIFFNESS, LOSS = CommonBase.own_parameters


def readings(measurement: Measurement, *effects: Effect, scores: tuple[float, ...] = ()) -> np.ndarray:
    likelihood = Likelihood(simulation_of(measurement, *effects))
    own, at = len(likelihood.simulation.baseline.parameters), np.zeros(likelihood.unknowns)
    at[own : own + len(scores)] = scores
    return likelihood.predict(at, derivatives=()).accelerances[0]


def test_a_common_base_is_unknown_although_foundations_resemble_it(made: Made, empty: Measurement) -> None:
    search = search_among(made((CommonBase(),), (0.3, 0.2, 0.0)).thinned(42), {"foundation_compliance"})
    search = replace(search, rivals=common_base(empty))
    none = search.fit_paper_model()
    verdict = leading(weigh(none, selected(search, none, UNCALIBRATED), UNCALIBRATED))
    assert verdict.effects == UNKNOWN
    assert isinstance(verdict.model.effects[0], CommonBase)


def test_a_base_that_cannot_move_changes_nothing(empty: Measurement) -> None:
    rigid = (FREQUENCY.score(1e6), STIFFNESS.score(1e18), 0.0)
    moved, plain = readings(empty, CommonBase(), scores=rigid), readings(empty)
    assert np.max(np.abs(moved - plain)) < 1e-9 * np.max(np.abs(plain))


def test_a_base_adds_a_motion_that_holds_the_forces_of_all_joints(empty: Measurement) -> None:
    """The base's own equation of motion: its dynamic stiffness times its motion is the force of the joints on it."""
    simulation = simulation_of(empty, CommonBase())
    values = simulation.values([0.2] * len(simulation.shared))
    setting = simulation.groups[0].setting
    around = simulation.surroundings(values, setting)
    joints = simulation.joints(values, setting, around.pole, np.ones((1, 2)))
    response = simulation.groups[0].rig.response(replace(around, joints=joints), np.zeros((2, len(setting.inputs))))
    force = np.einsum("sljpq,rljq->rljp", joints, response.joint_motion)
    of_beam = np.moveaxis(response.by_row(np.moveaxis(response.motion[:, :, :6, 3:], 2, 0)), 0, -1)
    base = of_beam.reshape(force.shape)[..., 1] - response.joint_motion[..., 1]
    assert np.allclose(base[..., 0], base[..., 1], rtol=1e-9, atol=0)
    assert np.allclose(force[..., 1].sum(axis=-1), around.base * base[..., 0], rtol=1e-9, atol=0)


def test_derivatives_are_exact_where_joints_follow_their_deformation_on_the_base(empty: Measurement) -> None:
    likelihood = Likelihood(simulation_of(empty.thinned(60), AmplitudeDependence(), CommonBase()))
    scores = 0.2 * np.random.default_rng(3).standard_normal(likelihood.unknowns)
    predicted, own = likelihood.predict(scores), len(likelihood.simulation.baseline.parameters)
    for place in range(own, own + len(AmplitudeDependence.own_parameters)):
        difference = (4 * numeric(likelihood, scores, place, 5e-4) - numeric(likelihood, scores, place, 1e-3)) / 3
        exact = analytic(predicted, place)
        assert np.linalg.norm(difference - exact) < 1e-5 * np.linalg.norm(exact), likelihood.parameters[place].name


@pytest.mark.parametrize("missing", ["blows", "a second joint"])
def test_a_base_is_sought_under_several_joints_that_were_struck(empty: Measurement, missing: str) -> None:
    drawing = replace(empty.drawing, joints=empty.drawing.joints[:1])
    lacking = replace(empty, sets=()) if missing == "blows" else replace(empty, drawing=drawing)
    assert common_base(lacking) == ()
    assert len(common_base(empty)) == 1
