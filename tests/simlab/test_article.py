import dataclasses

import numpy as np
import pytest

from simlab.article import ECCENTRICITIES, NODE_POSITIONS, TOLERANCES, lateral_stiffness, with_kinks
from simlab.beam import SimulatedBeam
from simlab.elastomer import BLOW_AMPLITUDE
from simlab.ordinary import CYLINDERS, draw_article
from tests.simlab.specimens import built_of, stiffness_of


@pytest.mark.parametrize(("name", "sign"), [("I", 1), ("II", -1)])
def test_a_joint_as_drawn_is_what_its_two_cylinders_give(name: str, sign: int) -> None:
    """Eq. (11) with the sign of k12 that Table 2 has, above the frequencies where the elastomer relaxes."""
    cylinder = CYLINDERS[name]
    a, b, c = cylinder.shear, cylinder.compression, cylinder.rotation
    expected = [
        [a + b, sign * (b - a), 0],
        [sign * (b - a), a + b, 0],
        [0, 0, 2 * c + ECCENTRICITIES[1] ** 2 * (a + b)],
    ]
    joint = draw_article(1, tolerances=0.0).joints[name]
    stiffness = joint.dynamic_stiffness(BLOW_AMPLITUDE, 400.0)[0]
    np.testing.assert_allclose(stiffness.real, expected, rtol=1e-9, atol=1e-6)


@pytest.mark.parametrize("seed", range(5))
def test_every_drawn_joint_is_symmetric_and_takes_energy_in_every_direction(seed: int) -> None:
    for joint in draw_article(seed).joints.values():
        frequency = np.array([5.0, 900.0])
        cylinders = np.array([each.dynamic_stiffness(BLOW_AMPLITUDE, frequency) for each in joint.cylinders])
        for stiffness in (joint.dynamic_stiffness(BLOW_AMPLITUDE, frequency), lateral_stiffness(cylinders)):
            np.testing.assert_allclose(stiffness, stiffness.swapaxes(1, 2), rtol=1e-12)
            assert np.all(np.linalg.eigvalsh(stiffness.imag) > 0)
            assert np.all(np.linalg.eigvalsh(stiffness.real) > 0)


def test_what_is_drawn_stays_within_the_tolerances_and_differs_by_seed() -> None:
    articles = [draw_article(seed) for seed in range(60)]
    modulus = np.array([article.beam.youngs_modulus for article in articles]) / 207e9 - 1
    assert 0.3 * TOLERANCES["youngs_modulus"] < modulus.std() < 0.7 * TOLERANCES["youngs_modulus"]
    assert np.abs(modulus).max() <= TOLERANCES["youngs_modulus"] * (1 + 1e-9)
    edge = 1 + 1e-9
    for article in articles:
        assert abs(article.joints["II"].position - NODE_POSITIONS[9]) <= TOLERANCES["node_position"] * edge
        assert abs(article.sensor_position - NODE_POSITIONS[2]) <= TOLERANCES["node_position"] * edge
        assert abs(article.joints["I"].inclinations_deg[1] - 135.0) <= TOLERANCES["inclination_deg"] * edge
    assert draw_article(7) == articles[7]


def test_without_tolerances_the_article_is_the_drawing() -> None:
    article = draw_article(5, tolerances=0.0)
    assert article.beam == SimulatedBeam()
    assert article == draw_article(6, tolerances=0.0)
    assert dataclasses.asdict(article)["sensor_position"] == NODE_POSITIONS[2]


def test_the_beam_has_its_kinks_where_joints_and_accelerometer_really_are() -> None:
    article = draw_article(3)
    places = [article.joints["I"].position, article.sensor_position, article.joints["II"].position]
    assert with_kinks(article).beam.kinks == tuple(places)


def test_the_tester_gets_the_cylinders_of_the_joints() -> None:
    article = draw_article(3)
    lower, upper = article.joints["II"].cylinders
    assert lower != upper
    each = [cylinder.dynamic_stiffness(5e-6, 100.0) for cylinder in (lower, upper)]
    built = built_of(article)
    assert stiffness_of(built, "II", "compression", 5e-6, 100.0) == pytest.approx(each[0][1])
    assert stiffness_of(built, "II", "shear", 5e-6, 100.0) == pytest.approx(each[0][0] + each[1][0])
