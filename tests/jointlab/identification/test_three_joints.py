"""A beam on three joints, which the paper does not have: identified as one on two is."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.structure.forward import accelerance
from analysis.structure.joints import Joint
from jointlab.identification.inverse import inverse_of
from jointlab.identification.load import measurement_of_bundle
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.structure import free_beam_of
from jointlab.identification.undetermined_text import remedy_text, weak_direction_text
from simlab.case.bundle import write_case
from simlab.case.draw import CaseKind, draw_case
from store.dof import StoredDof
from store.exchange.bundle import read_bundle

NOISE = 0.003
STIFFNESS = {"I": (2.6e6, 1.9e6), "M": (1.1e6, 0.4e6), "II": (3.2e6, -2.2e6)}  # k22 and k12, N/m


@pytest.fixture(scope="module")
def measurement(tmp_path_factory: pytest.TempPathFactory) -> MeasuredArticle:
    """Another joint amid the two of a drawn bench; accelerances from a mesh twice as fine as the identification's."""
    folder = tmp_path_factory.mktemp("case") / "bundle"
    write_case(draw_case(12, CaseKind.NONE), folder)
    drawn = measurement_of_bundle(read_bundle(folder))
    one, two = drawn.article.joints
    amid = one.model_copy(update={"name": "M", "node": 6})
    article = drawn.article.model_copy(update={"joints": (one, amid, two)})
    joints = []
    for joint in article.joints:
        k22, k12 = STIFFNESS[joint.name]
        k = np.array([[k22, k12, 0.0], [k12, k22, 0.0], [0.0, 0.0, 130.0]])
        joints.append(Joint(joint.name, joint.node, k * (1 + 0.09j)))
    stored = drawn.sets[0]
    points = (*(f"{node}y" for node in range(1, 12)), "1x", "6x", "11x")  # along the beam a point for each joint
    frequency = stored.frequency[stored.frequency >= 10.0]
    clean = accelerance(
        free_beam_of(article, elements=16), joints, frequency, Dof.parse("3y"), tuple(map(Dof.parse, points))
    ).accelerance
    rng = np.random.default_rng(1)
    noise = NOISE * (rng.standard_normal(clean.shape) + 1j * rng.standard_normal(clean.shape))
    made = replace(
        stored,
        inputs=tuple(StoredDof(int(point[:-1]), point[-1]) for point in points),
        frequency=frequency,
        accelerance=clean + noise,
        coherence=None,
        variance=np.full(clean.shape, NOISE**2),
    )
    return MeasuredArticle("three joints", article, (made,), (), raw=False)


def test_three_joints_are_identified_within_their_intervals(measurement: MeasuredArticle) -> None:
    found = inverse_of(measurement)
    assert found.fit.passed
    for name, (k22, k12) in STIFFNESS.items():
        joint = found.likelihood.joints[name]
        for at, true in (((1, 1), k22), ((0, 1), k12)):
            low, high = joint.k_ci95[at]
            assert low - 0.5 * (high - low) < true < high + 0.5 * (high - low), (name, at)
            assert high - low < 0.03 * abs(true)
    assert "k11(M)" in " ".join(map(weak_direction_text, found.fit.weak_directions))
    assert {remedy_text(remedy).split(":")[0] for remedy in found.remedies} == {
        "the cylinders as parameters",
        "taking k11 = k22 in each joint within 3 %",
        "a second accelerometer at 1x",
        "a second accelerometer at 11x",
    }
    assert found.remedies[0].after < found.remedies[0].before
