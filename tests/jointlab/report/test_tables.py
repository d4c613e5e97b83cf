"""Tables of stored results."""

from dataclasses import replace

import numpy as np
import pytest

from jointlab.identification.document import plain
from jointlab.identification.undetermined_text import INTERVAL_WIDER_THAN_VALUE
from jointlab.report.section import Unknown, ends
from jointlab.report.tables import matrix_tables, over_frequency_tables, unit_notices
from store.results.comparisons import Comparison
from tests.store.conftest import joint_matrix


def test_a_loss_factor_that_is_wider_than_itself_is_greyed_with_the_reason() -> None:
    stored = joint_matrix("I", 2)
    assert stored.loss_factor_ci95 is not None
    wide = stored.loss_factor_ci95.copy()
    wide[2, 2] = [-0.02, 0.25]
    joint = replace(stored, loss_factor_ci95=wide, observable=np.ones((3, 3), dtype=bool))
    stiffness, _, loss_factor = matrix_tables(joint, "a method", {})
    assert isinstance(stiffness.rows[2][3], str)
    cell = loss_factor.rows[2][3]
    assert isinstance(cell, Unknown)
    assert cell.why == INTERVAL_WIDER_THAN_VALUE
    assert isinstance(loss_factor.rows[1][2], str)


def test_a_joint_over_frequency_has_a_row_for_each_and_greys_what_is_not_observable() -> None:
    matrix, not_known = np.full((3, 3), 2.0e6), np.full((3, 3), np.nan)
    limits, observable = np.stack([0.9 * matrix, 1.1 * matrix], axis=-1), np.ones((3, 3), dtype=bool)
    observable[0, 1] = False
    found = {"law": "zener", "frequency_hz": [100.0], "k": [matrix], "k_ci95": [limits], "gamma": [not_known]}
    found |= {"gamma_ci95": [np.stack([not_known, not_known], axis=-1)], "observable": [observable]}
    (table,) = over_frequency_tables({"I": plain(found)})
    assert "a fractional Zener law" in table.caption
    ((frequency, k12, k22, *gammas),) = table.rows
    assert (frequency, k22) == ("100", "2.000 [1.800 … 2.200]")
    assert isinstance(k12, Unknown)
    assert gammas[1] == "– [–]"


@pytest.mark.parametrize(
    ("interval", "shown"),
    [
        ((0.1311, 0.1314), "0.13110 … 0.13140"),
        ((2.0, 3.0), "2.00 … 3.00"),
        ((-1e-5, 1e-5), "-1.00e-05 … 1.00e-05"),
        ((207.0, 207.0), "207 … 207"),
    ],
)
def test_the_ends_of_an_interval_differ_as_shown(interval: tuple[float, float], shown: str) -> None:
    assert ends(interval) == shown


def test_stiffnesses_that_share_a_factor_of_a_thousand_ask_for_the_unit() -> None:
    compared = [
        Comparison("I", "k22", (2.4e6, 2.8e6), (2.5e3, 2.7e3), "differ"),
        Comparison("I", "k12", (-1.9e6, -1.8e6), (-1.9e3, -1.8e3), "differ"),
        Comparison("I", "gamma22", (0.1, 0.2), (0.1, 0.2), "agree"),
        Comparison("II", "k22", (2.4e6, 2.8e6), (2.5e6, 2.7e6), "agree"),
        Comparison("II", "k11", None, (2.5e6, 2.7e6), "not comparable"),
    ]
    (notice,) = unit_notices(compared)
    assert notice.text.startswith("The stiffness of joint I by the hammer is about 1000 times that by the tester")
    assert "kN for N or mm for m?" in notice.text
    assert unit_notices(compared[3:]) == []
