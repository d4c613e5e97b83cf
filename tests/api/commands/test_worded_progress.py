"""The line of words under a progress bar."""

import re

import pytest

from api.commands.terminal import progress_bar

ANSWER = "first answer, not final: mass at the joints (joint_mass), explains 40 % of the misfit"
CODES = re.compile(r"\x1b\[[0-9;?]*[A-Za-z]")


def drawn(shown: str) -> list[str]:
    """Every picture of the bar, one after the other, without codes of the terminal."""
    return CODES.sub("", shown).split("diagnosis  ")[1:]


@pytest.mark.usefixtures("terminal")
def test_the_latest_words_are_under_the_bar_and_go_with_it(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_bar("diagnosis", 100) as advance:
        advance(40, "trying single effects")
        advance(2, ANSWER)
        pictures = drawn(capsys.readouterr().err)
        assert "trying single effects" in "".join(pictures)
        assert "42/100" in pictures[-1]
        assert pictures[-1].rstrip().endswith(ANSWER)
        assert "trying single effects" not in pictures[-1]
    assert "first answer" not in drawn(capsys.readouterr().err)[-1]


@pytest.mark.usefixtures("terminal")
def test_work_that_fails_leaves_no_answer_on_the_screen(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ValueError, match="no"):
        _fail()
    pictures = drawn(capsys.readouterr().err)
    assert ANSWER in "".join(pictures)
    assert ANSWER not in pictures[-1]


def _fail() -> None:
    with progress_bar("diagnosis", 100) as advance:
        advance(42, ANSWER)
        raise ValueError("no")


@pytest.mark.usefixtures("terminal")
def test_control_characters_in_titles_are_shown_and_not_obeyed(capsys: pytest.CaptureFixture[str]) -> None:
    with progress_bar("diagnosis", 100) as advance:
        advance(1, "a title \x1b[2J of somebody's own effect")
        shown = capsys.readouterr().err
    assert r"a title \x1b[2J of" in shown
    assert "\x1b[2J" not in shown


def test_where_standard_error_is_no_terminal_one_line_says_when_all_is_done(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with progress_bar("diagnosis", 100) as advance:
        advance(42, ANSWER)
        advance(58)
    assert re.fullmatch(r"diagnosis: 100 in \d+\.\d s\n", capsys.readouterr().err)
