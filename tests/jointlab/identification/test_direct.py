"""The direct method: a sine point that no specimen can have costs itself alone."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

from analysis.inverse.frequency_law import FrequencyLaw
from jointlab.errors import JointlabError
from jointlab.identification.direct import Direct, direct_of
from jointlab.identification.document import identification_document
from jointlab.identification.law import laws_of
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.options import Options
from jointlab.identification.pipeline import identify
from jointlab.report.identification import write_report
from jointlab.report.summary import summary_sections
from store.states import CONFIGURATIONS
from tests.jointlab.identification.layouts import LAYOUTS, article_of, measured
from tests.jointlab.identification.tester import AMPLITUDES, FREQUENCIES, sine_points

LAYOUT = LAYOUTS["nine nodes"]


def on_tester(*joints: str, wrong: tuple[str, str, float, float] | None = None) -> MeasuredArticle:
    return MeasuredArticle("tester", article_of(LAYOUT), (), sine_points(*joints, wrong=wrong), raw=False)


@cache
def clean() -> Direct:
    return direct_of(on_tester("I"))["I"]


@pytest.mark.parametrize(
    ("configuration", "said"),
    [
        ("compression", "0.01 mm, 100 Hz: k is -2.3e+06 N/m (compression)"),
        ("shear", "0.01 mm, 100 Hz: k is -7.2e+05 N/m (shear)"),
        ("angled", "0.01 mm, 100 Hz: k is -2.66e+06 N/m (angled)"),
    ],
)
def test_a_swapped_sign_of_the_force_leaves_that_point_out_and_the_law_as_it_was(configuration: str, said: str) -> None:
    found = direct_of(on_tester("I", wrong=("I", configuration, 0.01, 100.0)))["I"]
    assert found.left_out == (said,)
    assert [len(terms) for terms in found.joint.values()] == [len(FREQUENCIES), len(FREQUENCIES) - 1]
    assert found.lean.angle == pytest.approx(clean().lean.angle, abs=1e-6)
    assert {amplitude: len(check.points) for amplitude, check in found.superposition.items()} == {0.1: 5, 0.01: 4}
    assert all(point.measured.stiffness > 0 for check in found.superposition.values() for point in check.points)
    assert clean().left_out == ()
    at, as_before = (each.law.at(2e-5, 100.0).k22 for each in (found, clean()) if each.law is not None)
    assert at.stiffness == pytest.approx(as_before.stiffness, rel=2e-3)


def test_a_joint_whose_cylinders_mirror_each_other_has_no_coupling_in_the_tester_either() -> None:
    """The one leans as much to the left as the other to the right."""
    measurement = on_tester("I")
    drawn = tuple(
        joint.model_copy(update={"inclinations_deg": (-45.0, 45.0)}) if joint.name == "I" else joint
        for joint in measurement.article.joints
    )
    article = measurement.article.model_copy(update={"joints": drawn})
    found = direct_of(replace(measurement, article=article))["I"]
    opposed = clean()
    assert found.law is not None
    assert opposed.law is not None
    for terms, other in (
        (found.joint[0.1][0], opposed.joint[0.1][0]),
        (found.law.at(1e-4, 50.0), opposed.law.at(1e-4, 50.0)),
    ):
        assert abs(terms.k12.complex_stiffness) < 1e-9 * other.k12.magnitude
        assert terms.k22.complex_stiffness == pytest.approx(other.k22.complex_stiffness, rel=1e-6)


def test_an_amplitude_without_a_point_of_positive_stiffness_has_no_superposition() -> None:
    measurement = on_tester("I")
    swapped = tuple(
        replace(point, result=replace(point.result, complex_stiffness=-point.result.complex_stiffness))
        if (point.configuration, point.amplitude_pp_mm) == ("angled", 0.1)
        else point
        for point in measurement.points
    )
    found = direct_of(replace(measurement, points=swapped))["I"]
    assert set(found.superposition) == set(found.joint) == {0.01}


def turned(measurement: MeasuredArticle, *names: str, sign: float = -1.0) -> MeasuredArticle:
    """With the loss of some configurations below zero."""
    points = tuple(
        replace(
            point,
            result=replace(
                point.result,
                complex_stiffness=complex(point.result.stiffness, sign * point.result.damping),
            ),
        )
        if point.configuration in names
        else point
        for point in measurement.points
    )
    return replace(measurement, points=points)


def test_points_that_feed_energy_are_in_no_term_and_one_sentence_names_them() -> None:
    found = direct_of(turned(on_tester("I"), "shear", "angled"))["I"]
    assert found.law is None
    assert not found.cylinders
    assert len(found.left_out) == len(AMPLITUDES)
    assert found.left_out[0].startswith("0.1 mm, 5 frequencies from 20 to 200 Hz: h is below zero (shear, angled)")
    with pytest.raises(JointlabError, match="check the sign of the phase: force leads displacement"):
        laws_of(turned(on_tester("I"), *CONFIGURATIONS))
    slightly = direct_of(turned(on_tester("I"), *CONFIGURATIONS, sign=-0.01))["I"]
    assert slightly.left_out == ()  # within three standard errors


def test_points_whose_wrong_sign_noise_hides_are_left_out_with_the_rest_of_their_configuration() -> None:
    measurement = turned(on_tester("I"), "shear")
    hidden = tuple(
        replace(point, result=replace(point.result, covariance=1e4 * point.result.covariance))
        if point.frequency == 20.0
        else point
        for point in measurement.points
    )
    assert not direct_of(replace(measurement, points=hidden))["I"].cylinders


def test_there_is_no_law_where_too_few_points_have_a_stiffness() -> None:
    measurement = on_tester("I")
    swapped = tuple(
        replace(point, result=replace(point.result, complex_stiffness=-point.result.complex_stiffness))
        if point.frequency > 50.0
        else point
        for point in measurement.points
    )
    measurement = replace(measurement, points=swapped)
    found = direct_of(measurement)["I"]
    assert found.law is None
    assert len(found.left_out) == 3 * len(AMPLITUDES)
    with pytest.raises(JointlabError, match=r"it needs 6 points of positive stiffness.*joint I 4"):
        laws_of(measurement)


def test_the_hammers_results_survive_a_sine_point_that_no_specimen_can_have() -> None:
    points = sine_points("I", "II", wrong=("II", "shear", 0.1, 50.0))
    options = Options(joint_law=FrequencyLaw.CONSTANT)
    found = identify(replace(measured(LAYOUT), points=points), options)
    assert found.inverse is not None
    assert found.inverse.fit.passed
    assert {"I", "II"} <= {each.joint for each in found.comparison}
    said = "0.1 mm, 50 Hz: k is -9.8e+05 N/m (shear)"
    assert identification_document(found)["direct_left_out"] == {"I": [], "II": [said]}
    shown = [str(item) for section in summary_sections(found) for item in section.content]
    assert any("In no law and no comparison: joint II, 0.1 mm, 50 Hz" in item for item in shown)


def with_tester(share_of_noise: float, *joints: str) -> MeasuredArticle:
    """Both experiments; the noise of the accelerances is stated as a share of what it is."""
    measurement = measured(LAYOUT)
    (struck,) = measurement.sets
    assert struck.variance is not None
    stated = replace(struck, variance=share_of_noise**2 * struck.variance)
    return replace(measurement, sets=(stated,), points=sine_points(*joints))


@pytest.mark.parametrize(
    ("share_of_noise", "joints", "said"),
    [
        (0.7, ("I", "II"), "the fit to the accelerances failed its checks (fit)"),
        (1.0, ("I",), "the tester has no terms of joint II, as not all configurations were measured"),
    ],
)
def test_what_cannot_be_compared_says_why(
    share_of_noise: float, joints: tuple[str, ...], said: str, tmp_path: Path
) -> None:
    found = identify(with_tester(share_of_noise, *joints), Options(joint_law=FrequencyLaw.CONSTANT))
    assert found.comparison == ()
    assert found.not_compared == said
    assert identification_document(found)["not_compared"] == said
    assert any(f"Not compared: {said}." in str(item) for each in summary_sections(found) for item in each.content)
    write_report(found, tmp_path / "report.html")
    assert f"Not compared: {said}." in (tmp_path / "report.html").read_text(encoding="utf-8")
