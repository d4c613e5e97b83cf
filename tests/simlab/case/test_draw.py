"""Drawing: everything from the seed, nothing that the kind does not have, laws and sizes as asked."""

import pytest

from simlab.article import TOLERANCES
from simlab.case.draw import EFFECTS, NOVELTIES, Case, CaseKind, draw_case

PROMISED = [
    "amplitude_dependence",
    "cubic_stiffness",
    "coulomb_friction",
    "frequency_dependence",
    "loss_law",
    "temperature_shift",
    "preload_stiffening",
    "conditioning_drift",
    "joint_mass",
    "support_position",
    "cylinder_angle",
    "vertical_offset",
    "contact_patch",
    "foundation_compliance",
    "youngs_modulus",
    "density",
    "beam_damping",
    "out_of_plane_bending",
    "accelerometer_mass",
    "sensor_gain",
    "channel_delay",
    "highpass_corner",
    "exponential_window",
    "cross_axis_sensitivity",
    "impact_angle",
    "impact_position",
    "frame_compliance",
    "fixture_inertia",
    "frame_resonance",
    "transducer_lag",
]


def content(case: Case) -> object:
    return (
        case.article,
        case.campaign.setups,
        case.campaign.points.time.tolist(),
        [(effect.name, effect.size, effect.law, dict(effect.values)) for effect in case.effects],
    )


def test_every_promised_effect_can_be_drawn_and_ten_novelties_more() -> None:
    assert set(PROMISED) <= set(EFFECTS)
    assert len(NOVELTIES) >= 10
    assert not set(NOVELTIES) & set(EFFECTS)


@pytest.mark.parametrize("kind", list(CaseKind))
def test_a_seed_draws_the_same_case_again_and_another_seed_another(kind: CaseKind) -> None:
    assert content(draw_case(5, kind)) == content(draw_case(5, kind))
    assert content(draw_case(5, kind)) != content(draw_case(6, kind))


@pytest.mark.parametrize(
    ("kind", "count"), [(CaseKind.NONE, 0), (CaseKind.SINGLE, 1), (CaseKind.PAIR, 2), (CaseKind.NOVEL, 1)]
)
def test_a_kind_has_its_number_of_different_effects(kind: CaseKind, count: int) -> None:
    for seed in range(20):
        names = {effect.name for effect in draw_case(seed, kind).effects}
        assert len(names) == count
        assert names <= set(NOVELTIES if kind is CaseKind.NOVEL else EFFECTS)


def test_article_and_campaign_do_not_tell_the_kind() -> None:
    none, single = draw_case(9, CaseKind.NONE), draw_case(9, CaseKind.SINGLE)
    assert none.article == single.article
    assert none.campaign.setups == single.campaign.setups


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_is_drawn_by_name_and_size(name: str) -> None:
    (effect,) = draw_case(1, CaseKind.SINGLE, [name], size=0.4).effects
    assert (effect.name, effect.size) == (name, 0.4)
    assert all(isinstance(value, (float, str)) for value in effect.values.values())


def test_rival_laws_come_up() -> None:
    laws = {draw_case(seed, CaseKind.SINGLE, ["amplitude_dependence"]).effects[0].law for seed in range(40)}
    assert laws == {"kraus", "contacts", "power"}


def test_nothing_of_the_article_is_off_by_more_than_two_tolerances() -> None:
    for seed in range(50):
        case = draw_case(seed, CaseKind.NONE)
        assert abs(case.article.beam.youngs_modulus / 207e9 - 1) <= 2 * TOLERANCES["youngs_modulus"] + 1e-12
        assert abs(case.article.beam.density / 7850 - 1) <= 2 * TOLERANCES["density"] + 1e-12
        for setup in case.campaign.setups:
            assert abs(setup.gain - 1) <= 2 * TOLERANCES["sensor_gain"] + 1e-12
            assert max(map(abs, setup.offsets)) <= 2 * TOLERANCES["impact_position"]


@pytest.mark.parametrize(
    ("kind", "effects", "size", "says"),
    [
        (CaseKind.SINGLE, ["gremlins"], None, "no effect 'gremlins'"),
        (CaseKind.SINGLE, ["absorber"], None, "no effect 'absorber' for a single case"),
        (CaseKind.PAIR, ["density"], None, "a pair case has 2 effects, not 1"),
        (CaseKind.PAIR, ["density", "density"], None, "once"),
        (CaseKind.NONE, ["density"], None, "a none case has 0 effects"),
        (CaseKind.SINGLE, ["density"], 1.5, "a size of 1.5"),
        (CaseKind.SINGLE, ["density"], 0.0, "a size of 0.0"),
    ],
)
def test_what_cannot_be_drawn_is_refused(kind: CaseKind, effects: list[str], size: float | None, says: str) -> None:
    with pytest.raises(ValueError, match=says):
        draw_case(1, kind, effects, size)
