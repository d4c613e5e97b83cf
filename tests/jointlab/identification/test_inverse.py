"""A prior for terms that the accelerances leave open: only on request, and reported with its share and its bias."""

import math

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.structure.bench_design import HIGHEST_STIFFNESS_RATIO, joint_design
from analysis.structure.forward import accelerance
from analysis.structure.joints import Cylinder, Joint, joint_from_cylinders
from api.commands.sequences import named_sequence
from jointlab.identification.inverse import Inverse, inverse_of
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.options import Options
from jointlab.identification.statements import MOSTLY, regularisation_statements
from jointlab.identification.structure import free_beam_of
from jointlab.report.inverse import inverse_sections
from jointlab.report.section import Table
from store.dof import StoredDof
from store.exchange.blow_window import BlowWindow
from store.exchange.bundle_setup import Article
from store.measurements.frequency_responses import FrequencyResponseSet

NOISE = 0.003
POINTS = (*(f"{node}y" for node in (1, 3, 4, 5, 6, 7, 8, 9, 11)), "1x", "11x")
COARSE = Options(elements=2)


def joints_of(article: Article, stiffer: float) -> list[Joint]:
    """Of cylinders so many times as stiff as the paper's."""
    lossy = stiffer * (1 + 0.1j)
    cylinder = Cylinder(0.4e6 * lossy, 2.5e6 * lossy, 20.0 * lossy)
    return [
        joint_from_cylinders(
            each.name,
            each.node,
            (cylinder, cylinder),
            [math.radians(a) for a in each.inclinations_deg],
            each.eccentricity,
        )
        for each in article.joints
    ]


NO_WINDOW = BlowWindow()


def measured(stiffer: float, window: BlowWindow = NO_WINDOW) -> MeasuredArticle:
    article = named_sequence("paper").article
    frequency = np.arange(20.0, 1024.5, 1.0)
    clean = accelerance(
        free_beam_of(article, elements=2), joints_of(article, stiffer), frequency, Dof.parse("3y"),
        tuple(map(Dof.parse, POINTS)), window.decay,
    ).accelerance  # fmt: skip
    parts = np.random.default_rng(1).standard_normal((2, *clean.shape))
    struck = FrequencyResponseSet(
        number=1, response=StoredDof.parse("3y"), inputs=tuple(map(StoredDof.parse, POINTS)), frequency=frequency,
        accelerance=clean + NOISE * (parts[0] + 1j * parts[1]), averages=10, peak_force=100.0, temperature_c=23.0,
        window=str(window), sample_rate=5120.0, block_seconds=1.0, estimator="H1",
        variance=np.full(clean.shape, NOISE**2),
    )  # fmt: skip
    return MeasuredArticle("stiff joints", article, (struck,), (), raw=False)


@pytest.fixture(scope="module")
def held() -> Inverse:
    return inverse_of(measured(1.0), options=Options(elements=2, regularise=0.05))


def test_terms_are_free_by_default() -> None:
    found = inverse_of(measured(1.0), options=COARSE)
    assert found.regularised is None
    assert np.all(found.fit.prior_effect.share == 0)
    assert np.all(found.fit.prior_effect.bias == 0)


def test_joints_far_beyond_the_papers_stiffness_ratio_need_no_prior() -> None:
    found = inverse_of(measured(100.0), options=COARSE)
    for joint, true in zip(found.fit.joints.values(), joints_of(measured(1.0).article, 100.0), strict=True):
        assert joint_design(found.free_beam.beam, true).stiffness_ratio > 80 * HIGHEST_STIFFNESS_RATIO
        assert joint.observable[1, 1]
        assert joint.k_ci95[1, 1, 0] < true.dynamic_stiffness[1, 1].real < joint.k_ci95[1, 1, 1]


def test_what_the_prior_decides_is_named_and_is_not_called_observable(held: Inverse) -> None:
    texts = regularisation_statements(held.fit, 0.05)
    assert "within 5 % of its size" in texts[0]
    assert "k11(I), " in texts[1]
    shares = held.fit.prior_effect.share.reshape(2, 2, 6)
    for joint, share in zip(held.fit.joints.values(), shares, strict=True):
        assert share[0, 0] > MOSTLY
        assert not joint.observable[0, 0]
        assert share[0, 3] < 0.1  # k22 is the data's


def test_the_report_shows_share_and_bias_of_every_term(held: Inverse) -> None:
    sections = inverse_sections(held, measured(1.0))
    tables = [part for section in sections for part in section.content if isinstance(part, Table)]
    (table,) = [each for each in tables if each.caption == "Effect of the prior on each term"]
    assert [row[0] for row in table.rows] == [f"{letter}{pq}" for letter in "kh" for pq in (11, 12, 13, 22, 23, 33)]
