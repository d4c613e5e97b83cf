"""Reasons and weak combinations read as sentences."""

import math

import pytest

from analysis.dof import Dof
from analysis.inverse.experiment_remedies import (
    CylindersAsParameters,
    EqualTerms,
    Remedy,
    RemedyChange,
    SecondAccelerometer,
    WiderBand,
)
from analysis.inverse.undetermined_terms import (
    CommonFactor,
    KnownInSum,
    LeftBy,
    Reason,
    TooWide,
    Unobservable,
    WeakDirection,
)
from jointlab.identification.undetermined_text import reason_text, remedy_text, weak_direction_text


@pytest.mark.parametrize(
    ("reason", "text"),
    [
        (Unobservable.INCLUDES_ZERO, "its 95 % interval includes zero"),
        (KnownInSum("k11(I)", "k11(II)", is_sum=True, weighted=False), "only k11(I) + k11(II) is seen"),
        (KnownInSum("k22(I)", "k22(II)", is_sum=False, weighted=False), "only k22(I) - k22(II) is seen"),
        (
            KnownInSum("k12(I)", "k33(II)", is_sum=True, weighted=True),
            "only a weighted sum of k12(I) and k33(II) is seen",
        ),
        (
            KnownInSum("k12(I)", "k33(II)", is_sum=False, weighted=True),
            "only a weighted difference of k12(I) and k33(II) is seen",
        ),
        (
            TooWide(LeftBy.DATA, 1.96, ("k22(I)",)),
            "the 95 % interval that these data leave at best is wider than the value; it goes with k22(I)",
        ),
        (
            TooWide(LeftBy.TOLERANCES, math.inf),
            "the 95 % interval that the bench's tolerances leave at best is wider than the value",
        ),
    ],
)
def test_a_reason_is_a_sentence(reason: Reason, text: str) -> None:
    assert reason_text(reason) == text


@pytest.mark.parametrize("reason", Unobservable)
def test_every_reason_without_figures_has_words(reason: Unobservable) -> None:
    assert reason_text(reason)


@pytest.mark.parametrize(("width", "said"), [(0.2502, "25.02"), (0.2504, "25.04"), (0.254, "25.4"), (0.26, "26")])
def test_a_width_has_the_decimals_that_show_it_is_too_much(width: float, said: str) -> None:
    text = reason_text(TooWide(LeftBy.DATA, width))
    assert text == f"these data leave ±{said} % at best (95 %), less than ±25 % would be enough"


@pytest.mark.parametrize(
    ("weak", "text"),
    [
        (
            WeakDirection((("k11(I)", 1.0), ("k11(II)", -1.0)), 26.0, 0.0014142),
            "k11(I) - k11(II) is known to +-26 EI/L^3 (one standard deviation), k11(I) + k11(II) to 0.0014",
        ),
        (
            WeakDirection((("h22(I)", 1.0), ("h12(I)", -0.4)), 3.0, 1.0),
            "h22(I) - 0.4 h12(I) is known to +-3 EI/L^3 (one standard deviation), h22(I) + 0.4 h12(I) to 1",
        ),
        (WeakDirection((("k12(3)", 1.0),), 3.0), "k12(3) is known to +-3 EI/L^3 (one standard deviation)"),
        (WeakDirection((("k23(I)", 1.0),), 3.0), "k23(I) is known to +-3 EI/L^2 (one standard deviation)"),
        (WeakDirection((("k33(I)", 1.0),), 3.0), "k33(I) is known to +-3 EI/L (one standard deviation)"),
        (
            WeakDirection((("k12(I)", 1.0), ("k23(I)", 1.0), ("k33(I)", 1.0)), 9.0),
            "k12(I) + k23(I) + k33(I) is known to +-9 (one standard deviation; terms in EI/L^3, EI/L^2 and EI/L)",
        ),
        (
            CommonFactor(0.0023, 0.0004),
            "a common factor of all terms is known to 0.23 % (one standard deviation), as well as gain, density and "
            "Young's modulus are; without it the best known term to 0.04 %",
        ),
    ],
)
def test_a_weak_combination_is_a_sentence(weak: WeakDirection | CommonFactor, text: str) -> None:
    assert weak_direction_text(weak) == text


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (EqualTerms(), "taking k11 = k22 in each joint within 3 %"),
        (EqualTerms(("I", "III")), "taking k11 = k22 in joint I, joint III within 3 %"),
        (CylindersAsParameters(), "the cylinders as parameters"),
        (SecondAccelerometer(Dof.parse("11x")), "a second accelerometer at 11x"),
        (WiderBand(3068.2), "lines up to 3068 Hz at the same noise"),
    ],
)
def test_a_remedy_is_told_with_its_effect(change: RemedyChange, words: str) -> None:
    assert remedy_text(Remedy(change, 0.52, 0.013, ("EI/L^3",))) == f"{words}: from +-0.52 EI/L^3 to +-0.013 EI/L^3"
