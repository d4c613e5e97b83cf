"""Text as people read it: signs of print, and quantities on one line."""

import pytest

from jointlab.report.section import NO_BREAK, THIN, number
from jointlab.report.typography import JOINER, NO_BREAK_HYPHEN, kept_together, with_signs


@pytest.mark.parametrize(
    ("written", "shown"),
    [
        ("inverse less direct is 2.4 +- 4.7 % of it", "inverse less direct is 2.4 ± 4.7 % of it"),
        ("is known to +-24 EI/L^3 (one)", "is known to ±24 EI/L³ (one)"),
        ("k23(I) is known to +-3 EI/L^2", "k23(I) is known to ±3 EI/L²"),
        ("0.25 +-0.5 (of all motions)", "0.25 ± 0.5 (of all motions)"),
        ("0.00593 (0.0057 .. 0.00617), 0.2", f"0.00593 (0.0057{THIN}–{THIN}0.00617), 0.2"),
        ("-2.3e-05 .. -1e-06 m", f"-2.3e-05{THIN}–{THIN}-1e-06 m"),
        ("k11(I) - k11(II)", "k11(I) - k11(II)"),
        ("it ends here ... 3", "it ends here ... 3"),
    ],
)
def test_a_text_of_the_analysis_is_shown_with_the_signs_of_print(written: str, shown: str) -> None:
    assert with_signs(written) == shown


@pytest.mark.parametrize(
    ("text", "kept"),
    [
        ("0.1 mm, 98 Hz", "0.1_mm, 98_Hz"),
        ("2.68 [1.82 … 3.54] MN/m", "2.68 [1.82_…_3.54]_MN/m"),
        ("78.1 … 78.2 Hz", "78.1_… 78.2_Hz"),
        ("58.1 N m and 3 N more", "58.1_N_m and 3_N more"),
        ("0.702 ± 0.0014 %", "0.702_± 0.0014_%"),
        ("uncertainty, k = 2; 5, %", "uncertainty, k_=_2; 5,_%"),
        ("mm p-p", "mm p~p"),
        ("3 sets of 10 minutes", "3 sets of 10 minutes"),
        ("2026-11-27 00:24 to 2026-11-27 00:25 UTC", "2026~11~27_00:24 to 2026~11~27_00:25 UTC"),
    ],
)
def test_no_line_breaks_between_a_number_and_its_unit(text: str, kept: str) -> None:
    assert kept_together(text) == kept.replace("_", NO_BREAK).replace("~", NO_BREAK_HYPHEN)


def test_no_line_breaks_behind_the_dash_of_an_interval() -> None:
    assert kept_together(with_signs("0.0057 .. 0.00617")) == f"0.0057{THIN}–{JOINER}{THIN}0.00617"


def test_no_line_breaks_within_a_number() -> None:
    assert number(1234567.0) == f"1{THIN}234{THIN}567"
    assert THIN == "\u202f"  # unlike a thin space, U+2009
