"""`jointlab history`, and runs by day."""

from tests.api.conftest import Command

ARTICLE = "steel beam on two joints of inclined cylinders"


def test_a_specimen_over_its_runs_is_shown_at_the_point_that_is_asked_for(jointlab: Command, measured: int) -> None:
    answer = jointlab("history", ARTICLE, "I", "--configuration", "shear", "--amplitude", 0.01, "--frequency", 100)
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout.startswith("I in shear, 0.01 mm peak to peak, 100 Hz:")
    assert "A trend takes 3 runs at different times; there is 1 here." in answer.stdout


def test_a_point_that_was_not_measured_is_answered_with_those_that_were(jointlab: Command, measured: int) -> None:
    answer = jointlab("history", ARTICLE, "I", "--frequency", 21)
    assert answer.returncode == 3
    assert "angled, compression, shear, at 0.01, 0.1 mm p-p and 20.0, 100.0, 180.0 Hz" in answer.stderr


def test_a_specimen_without_points_says_what_to_do(jointlab: Command, measured: int) -> None:
    answer = jointlab("history", ARTICLE, "III")
    assert answer.returncode == 3
    assert "jointlab identify RUN" in answer.stderr


def test_runs_are_found_by_day(jointlab: Command, measured: int) -> None:
    assert jointlab("runs", "--since", "2099-01-01").stdout == "no run fits\n"
    assert jointlab("runs", "--until", "2001-01-01").stdout == "no run fits\n"
    assert "finished" in jointlab("runs", "--since", "2001-01-01", "--until", "2099-01-01").stdout
