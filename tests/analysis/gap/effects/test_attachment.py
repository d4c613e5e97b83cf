"""Foundations of more than one mode."""

import numpy as np
import pytest

from analysis.frequency_response import Complex
from analysis.gap.effects.attachment import FoundationCompliance, FoundationOfTwoModes
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.verdict import leading, weigh
from analysis.gap.search.forward_selection import selected
from tests.analysis.gap.conftest import Made, at_centre, search_among

POLE: Complex = np.asarray(2j * np.pi * np.linspace(20.0, 800.0, 60), dtype=np.complex128)
ONE, TWO = FoundationCompliance(1), FoundationOfTwoModes(1)


def test_the_compliance_of_a_foundation_is_the_sum_of_its_modes() -> None:
    given = at_centre(TWO, second_over_first=0.5, f_second=90.0, eta_second=0.2)
    second = at_centre(ONE, k_f=given["k_f"] / 0.5, f=90.0, eta=0.2)
    compliance = 1 / ONE.foundation(given, POLE) + 1 / ONE.foundation(second, POLE)
    np.testing.assert_allclose(TWO.foundation(given, POLE), 1 / compliance)


def test_a_second_mode_that_gives_nothing_way_leaves_the_first() -> None:
    given = at_centre(TWO, second_over_first=1e-12)
    np.testing.assert_allclose(TWO.foundation(given, POLE), ONE.foundation(given, POLE), rtol=1e-9)


def test_a_foundation_on_a_foundation_is_named_alone(made: Made) -> None:
    """With one mode alone, masses and losses would take up the rest."""
    search = search_among(
        made((TWO,), (-0.5, 0.0, 0.0, 0.9, 0.5, 0.0)), {"foundation_compliance", "joint_mass", "loss_law"}
    )
    none = search.fit_paper_model()
    verdict = leading(weigh(none, selected(search, none, UNCALIBRATED), UNCALIBRATED))
    assert (verdict.effects, verdict.laws) == ((ONE.id,), (TWO.law,))
    assert verdict.model.fit.value("f_second") == pytest.approx(200.0 * np.exp(0.9), rel=0.03)
