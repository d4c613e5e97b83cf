"""Stiffness that is spread over a length of the beam."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.beam_rig import BeamRig
from analysis.gap.calibration import UNCALIBRATED
from analysis.gap.effect import Effect
from analysis.gap.effects.joint_geometry import ContactPatch, SpreadContactPatch
from analysis.gap.effects.tester import FrameCompliance
from analysis.gap.forward_selection import ForwardSelection, selected
from analysis.gap.measurement import Measurement
from analysis.gap.search import TRIED_ANYWAY
from analysis.gap.simulation import Simulation
from analysis.gap.verdict import leading, weigh
from tests.analysis.gap.conftest import Made, search_among

LENGTH, PIECES = 0.03, 15


def read(simulation: Simulation, scores: Real) -> tuple[BeamRig, Complex, Callable[..., Complex]]:
    """The rig, its readings, and a function that reads it with other joints at other places."""
    group, values = simulation.groups[0], simulation.values(scores.tolist())
    around = simulation.surroundings(values, group.setting)
    stiffness = simulation.joints(values, group.setting, around.pole, np.ones((len(group.numbers), 2)))
    none = np.zeros(len(group.rig.inputs))

    def at(joints: Complex, places: Real) -> Complex:
        rig = replace(group.rig, joint_mass=np.zeros(len(places)))
        bench = replace(around, joints=joints, joint_position=places, joint_reach=np.zeros(len(places)))
        return rig.answer(bench, none).accelerance

    return group.rig, group.rig.answer(replace(around, joints=stiffness), none).accelerance, at


def test_a_patch_on_a_beam_that_bends_is_many_small_joints_side_by_side(empty: Measurement) -> None:
    without = search_among(empty, set()).simulation()
    scores = np.zeros(len(without.shared))
    rig, _, at = read(without, scores)
    group, values = without.groups[0], without.values(scores.tolist())
    around = without.surroundings(values, group.setting)
    each = without.joints(values, group.setting, around.pole, np.ones((len(group.numbers), 2))) / PIECES
    beside = LENGTH * ((np.arange(PIECES) + 0.5) / PIECES - 0.5)
    places = (around.joint_position[:, None] + beside).ravel()
    expected = at(np.repeat(each, PIECES, axis=2), places)

    def left(effect: Effect) -> float:
        score = effect.parameters[0].score(LENGTH)
        _, found, _ = read(search_among(empty, set()).simulation((effect,)), np.append(scores, score))
        return float(np.linalg.norm(found - expected))

    bending, straight = left(SpreadContactPatch()), left(ContactPatch())
    assert not rig.joint_mass.any()
    assert bending < 0.1 * straight


def test_a_patch_is_fitted_although_one_step_promises_less_of_it_than_of_others(made: Made) -> None:
    search = search_among(made((), (), 2), {"contact_patch", "impact_position", "loss_law"})
    none = search.without_effects()
    best = {each.effect.id for each in search.screened(none, search.candidates, always=TRIED_ANYWAY)}
    fitted = {effect.id for each in selected(search, none, UNCALIBRATED) for effect in each.effects}
    assert "contact_patch" not in best
    assert fitted == {*best, "contact_patch"}


def test_a_patch_is_fitted_by_this_law_beside_a_clean_leader(made: Made) -> None:
    measurement = made((FrameCompliance(), SpreadContactPatch()), (0.6, 1.4))
    search = search_among(measurement, {"contact_patch", "frame_compliance"})
    found = ForwardSelection(search, search.without_effects(), UNCALIBRATED)
    leader = max(search.singles(found.none), key=lambda each: each.log_evidence)
    assert (leader.ids, leader.clean) == (("frame_compliance",), True)
    found.add_to(leader)
    assert SpreadContactPatch() in {effect for each in found.visited for effect in each.effects}


def test_a_patch_is_named(made: Made) -> None:
    search = search_among(made((SpreadContactPatch(),), (1.4,)), {"contact_patch", "sensor_gain", "joint_mass"})
    none = search.without_effects()
    assert leading(weigh(none, selected(search, none, UNCALIBRATED), UNCALIBRATED)).effects == ("contact_patch",)
