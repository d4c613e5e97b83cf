"""The catalogue knows every effect, and offers those that could show."""

from dataclasses import replace

from analysis.gap.catalogue import candidates, effect_ids, laws, mechanism_of, shows
from analysis.gap.effect import Effect, Mechanism, acts_on
from analysis.gap.effects.joint_geometry import (
    SupportPosition,
)
from analysis.gap.effects.measuring_chain import SensorGain
from analysis.gap.effects.tester import FrameCompliance
from analysis.gap.measurement import Measurement

ELASTOMER = frozenset(
    {
        *("amplitude_dependence", "cubic_stiffness", "coulomb_friction", "frequency_dependence", "loss_law"),
        *("temperature_shift", "preload_stiffening", "conditioning_drift"),
    }
)
JOINTS = frozenset(
    {
        *("joint_mass", "support_position", "cylinder_angle", "vertical_offset", "contact_patch"),
        "foundation_compliance",
    }
)
BEAM = frozenset({"youngs_modulus", "density", "beam_damping", "mesh_error", "out_of_plane_bending"})
BEAM_CHAIN = frozenset(
    {
        *("accelerometer_mass", "sensor_gain", "channel_delay", "highpass_corner", "exponential_window"),
        *("cross_axis_sensitivity", "impact_angle", "impact_position"),
    }
)
TESTER = frozenset({"frame_compliance", "fixture_inertia", "frame_resonance", "transducer_lag"})
IN_RECORDS = frozenset({"double_hit", "mains_hum"})
"""Found in records, before anything is fitted."""


def ids(found: tuple[Effect, ...]) -> set[str]:
    return {each.id for each in found}


def test_every_effect_of_a_real_bench_is_there() -> None:
    assert set(effect_ids()) >= ELASTOMER | JOINTS | BEAM | BEAM_CHAIN | TESTER | IN_RECORDS


def test_there_is_no_other() -> None:
    assert set(effect_ids()) <= ELASTOMER | JOINTS | BEAM | BEAM_CHAIN | TESTER | IN_RECORDS


def test_ids_are_unique_and_rival_laws_have_names_of_their_own() -> None:
    assert len(set(effect_ids())) == len(effect_ids())
    names = [(law.id, law.law) for law in laws()]
    assert len(set(names)) == len(names)
    titles = {law.id: {each.title for each in laws() if each.id == law.id} for law in laws()}
    assert all(len(each) == 1 for each in titles.values())
    assert len({title for each in titles.values() for title in each}) == len(titles)


def test_every_effect_belongs_to_the_mechanism_that_its_file_is_named_after() -> None:
    for law in laws():
        file = law.__module__.rpartition(".")[2]
        assert file == law.mechanism or file.startswith(f"{law.mechanism}_"), law  # such as beam_out_of_plane
    assert {law.mechanism for law in laws()} == set(Mechanism)
    assert mechanism_of("coulomb_friction") is Mechanism.JOINT_AMPLITUDE


def test_every_candidate_has_a_title_and_parameters_with_units_and_starts(empty: Measurement) -> None:
    for effect in candidates(empty):
        assert effect.title, effect.id
        names = [parameter.name for parameter in effect.parameters]
        assert names, effect.id
        assert len(set(names)) == len(names), effect.id
        for parameter in effect.parameters:
            assert parameter.unit, (effect.id, parameter.name)
            assert parameter.spread > 0, (effect.id, parameter.name)
            assert all(parameter.value(start) >= parameter.least for start in parameter.starts), effect.id


def test_every_variant_of_a_law_is_a_candidate_of_its_own(empty: Measurement) -> None:
    found = candidates(empty)
    assert ids(found) == set(effect_ids()) - IN_RECORDS
    assert len(set(found)) == len(found)
    joints = [each for each in found if each.id == "cylinder_angle"]
    assert len(joints) == len(empty.drawing.joints) * len({each.law for each in joints})


def test_an_effect_can_be_left_out(empty: Measurement) -> None:
    left = frozenset({"joint_mass", "loss_law"})
    assert ids(candidates(empty, without=left)) == set(effect_ids()) - IN_RECORDS - left


def test_effects_of_the_tester_are_not_offered_without_it(empty: Measurement) -> None:
    found = ids(candidates(replace(empty, points=None)))
    assert not found & TESTER
    assert found >= JOINTS | BEAM | BEAM_CHAIN


def test_effects_of_the_beam_rig_are_not_offered_without_it(empty: Measurement) -> None:
    found = ids(candidates(replace(empty, sets=())))
    assert not found & (BEAM | BEAM_CHAIN | {"joint_mass", "foundation_compliance"})
    assert found >= TESTER | {"frequency_dependence", "conditioning_drift", "cylinder_angle"}


def test_an_effect_that_changes_nothing_of_the_rig_measured_with_does_not_show(empty: Measurement) -> None:
    in_tester, in_beam = replace(empty, sets=()), replace(empty, points=None)
    assert shows(FrameCompliance(), in_tester)
    assert not shows(FrameCompliance(), in_beam)
    assert shows(SensorGain(), in_beam)
    assert not shows(SensorGain(), in_tester)
    assert not shows(SupportPosition(names=()), empty)  # no joints, nothing to vary


def test_elastomer_and_leaning_act_in_both_rigs_and_every_instrument_in_one(empty: Measurement) -> None:
    both = {
        *("amplitude_dependence", "cubic_stiffness", "coulomb_friction", "frequency_dependence", "loss_law"),
        *("temperature_shift", "preload_stiffening", "conditioning_drift"),
        *("cylinder_angle", "support_position", "contact_patch", "vertical_offset"),
    }
    for effect in candidates(empty):
        in_both = acts_on(effect, "cylinders") or acts_on(effect, "mounting")
        assert in_both == (effect.id in both), effect.id
        if not in_both:
            in_beam = acts_on(effect, "joints") or acts_on(effect, "beam")
            assert in_beam != acts_on(effect, "tester"), effect.id
