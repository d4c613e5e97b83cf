"""Stiffness that is spread over a length of the beam."""

from dataclasses import replace

import numpy as np

from analysis.frequency_response import Complex
from analysis.gap.bench import BeamBench
from analysis.gap.effect import Effect
from analysis.gap.effects.joint_geometry import ContactPatch, SpreadContactPatch
from analysis.gap.effects.tester import FrameCompliance
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.verdict import leading, weigh
from analysis.gap.measurement import Measurement
from analysis.gap.search.forward_selection import ForwardSelection, selected
from analysis.gap.search.single_effects import TRIED_ANYWAY
from analysis.gap.simulation.beam_rig import BeamRig
from tests.analysis.gap.conftest import Made, search_among

LENGTH, PIECES = 0.03, 15


def bench_of(effects: tuple[Effect, ...], empty: Measurement) -> tuple[BeamRig, BeamBench]:
    """The rig of the first hammer set, and the bench with its joints; a patch has the length `LENGTH`."""
    simulation = search_among(empty, set()).simulation(effects)
    own = [parameter.score(LENGTH) for effect in effects for parameter in effect.parameters]
    scores = np.append(np.zeros(len(simulation.baseline.parameters)), own)
    group, values = simulation.groups[0], simulation.values(scores.tolist())
    around = simulation.surroundings(values, group.setting)
    joints = simulation.joints(values, group.setting, around.pole, np.ones((len(group.numbers), 2)))
    return group.rig, replace(around, joints=joints)


def read(rig: BeamRig, bench: BeamBench) -> Complex:
    return rig.response(bench, np.zeros((2, len(rig.inputs)))).accelerance


def test_a_patch_on_a_beam_that_bends_is_many_small_joints_side_by_side(empty: Measurement) -> None:
    rig, bench = bench_of((), empty)
    assert not rig.joint_mass.any(), "they would have to be shared, too"
    beside = LENGTH * ((np.arange(PIECES) + 0.5) / PIECES - 0.5)
    places = (bench.joint_position[:, None] + beside).ravel()
    small = np.repeat(bench.joints, PIECES, axis=2) / PIECES
    many = replace(bench, joints=small, joint_position=places, joint_reach=np.zeros(places.size))
    expected = read(replace(rig, joint_mass=np.zeros(places.size)), many)
    bending, straight = (read(*bench_of((law,), empty)) for law in (SpreadContactPatch(), ContactPatch()))
    assert np.linalg.norm(bending - expected) < 0.1 * np.linalg.norm(straight - expected)


def test_a_patch_is_fitted_although_one_step_promises_less_of_it_than_of_others(made: Made) -> None:
    search = search_among(made((), (), 3), {"contact_patch", "impact_position", "loss_law"})
    none = search.fit_paper_model()
    best = {each.effect.id for each in search.screened(none, search.candidates, always=TRIED_ANYWAY)}
    fitted = {effect.id for each in selected(search, none, UNCALIBRATED) for effect in each.effects}
    assert "contact_patch" not in best
    assert fitted == {*best, "contact_patch"}


def test_a_patch_is_fitted_by_this_law_beside_a_clean_leader(made: Made) -> None:
    measurement = made((FrameCompliance(), SpreadContactPatch()), (0.6, 1.4))
    search = search_among(measurement, {"contact_patch", "frame_compliance"})
    found = ForwardSelection(search, search.fit_paper_model(), UNCALIBRATED)
    leader = max(search.singles(found.none), key=lambda each: each.log_evidence)
    assert (leader.ids, leader.clean) == (("frame_compliance",), True)
    found.add_to(leader)
    assert SpreadContactPatch() in {effect for each in found.visited for effect in each.effects}


def test_a_patch_is_named(made: Made) -> None:
    search = search_among(made((SpreadContactPatch(),), (1.4,)), {"contact_patch", "sensor_gain", "joint_mass"})
    none = search.fit_paper_model()
    assert leading(weigh(none, selected(search, none, UNCALIBRATED), UNCALIBRATED)).effects == ("contact_patch",)
