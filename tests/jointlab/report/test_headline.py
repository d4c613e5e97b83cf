"""The results of a run in short, as page and report say them."""

import re
from dataclasses import replace

import pytest

from jointlab.identification.pipeline import Identification
from jointlab.identification.save import stored_comparison
from jointlab.report.headline import (
    UNMEASURED,
    Headline,
    comparison_sentence,
    gap_sentence,
    joint_table,
    read_headline,
)
from jointlab.report.section import NO_BREAK, Unknown, ends, with_ends
from store.catalogue import Catalogue
from store.measurements.runs import get_run, start_run
from tests.api.page.diagnosis import add_example_diagnosis, example_document


@pytest.fixture
def headline(measured_catalogue: Catalogue) -> Headline:
    return read_headline(measured_catalogue, measured_catalogue.read(get_run, 1))


def rows(found: Headline, name: str) -> dict[str, tuple[object, object]]:
    return {str(title): (hammer, tester) for title, hammer, tester in joint_table(found, name).rows}


def test_each_joint_has_the_intervals_of_both_methods_side_by_side_with_the_sign_of_the_verdict(
    headline: Headline, identified: Identification
) -> None:
    assert headline.joints == ("I", "II")
    compared = {(each.joint, each.element): stored_comparison(each) for each in identified.comparison}
    for name in headline.joints:
        found = rows(headline, name)
        assert len(found) == 9
        own = compared[name, "k22"]
        assert own.inverse is not None
        hammer, tester = found["k22 (MN/m)"]
        for shown, interval in ((hammer, own.inverse), (tester, own.direct)):
            assert f"[{ends([end / 1e6 for end in interval])}]" in str(shown).replace(NO_BREAK, " ")
        assert str(tester).startswith({"agree": "✓", "differ": "✗"}[own.verdict])
        assert isinstance(found["k11 (MN/m)"][0], Unknown)  # the hammer sees the sum of both alone


def test_h_of_the_tester_lies_between_the_smallest_and_the_largest_product_of_k_and_gamma(headline: Headline) -> None:
    k, gamma = (next(e for e in headline.compared if (e.joint, e.element) == ("II", n)) for n in ("k12", "gamma12"))
    (low, high), (least, most) = k.direct, gamma.direct
    assert high < 0 < least  # the largest stiffness has the smallest product
    expected = ends([low * most / 1e6, high * least / 1e6])
    assert f"[{expected}]" in str(rows(headline, "II")["h12 (MN/m)"][1]).replace(NO_BREAK, " ")


def test_without_a_comparison_the_tester_has_what_it_measured_and_says_where(headline: Headline) -> None:
    alone = replace(headline, inverse={}, compared=[])
    assert joint_table(alone, "I").caption == "Joint I; tester at 0.01 mm peak to peak, 98 Hz"
    hammer, tester = rows(alone, "I")["h22 (MN/m)"]
    assert hammer == "–"
    damping = headline.direct["I"][1].k22.damping_estimate
    low, high = damping.interval()
    assert str(tester).replace(" ", NO_BREAK) == with_ends(damping.value / 1e6, (low / 1e6, high / 1e6)).replace(
        " ", NO_BREAK
    )
    assert rows(replace(alone, direct={}), "I")["h22 (MN/m)"][1] == UNMEASURED


def test_a_run_without_results_has_an_empty_headline(measured_catalogue: Catalogue) -> None:
    with measured_catalogue.writing() as session:
        run = start_run(session, kind="sequence", title="t", article="a", setup={})
    found = read_headline(measured_catalogue, run)
    assert (found.joints, found.failed, list(found.compared), found.diagnosis) == ((), False, [], None)


def test_the_newest_diagnosis_of_the_run_is_told_in_one_sentence(measured_catalogue: Catalogue) -> None:
    number = add_example_diagnosis(measured_catalogue, run_id=1)
    found = read_headline(measured_catalogue, measured_catalogue.read(get_run, 1))
    assert found.diagnosis is not None
    assert found.diagnosis.analysis_id == number
    said = gap_sentence(found.diagnosis.document)
    assert "the gap falls from 12.3 % to 3.1 %" in said
    assert re.search(r"; probability \d+ %\.$", said)
    assert said == gap_sentence(example_document())
    assert gap_sentence(None) == "The gap between simulation and measurement was not diagnosed."


def test_what_disagrees_is_named(headline: Headline) -> None:
    first, second, *others = [each for each in headline.compared if each.verdict == "agree"]
    assert "none differs" in comparison_sentence(headline.compared, "")
    said = comparison_sentence([replace(first, verdict="differ"), second, *others], "")
    assert said.endswith(f"compared quantities: {first.element} of {first.joint}.")
    assert comparison_sentence([], "the fit failed") == "Not compared: the fit failed."
    assert "takes both of them" in comparison_sentence([], "")
