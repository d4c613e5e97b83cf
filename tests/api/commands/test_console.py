"""What is printed moves no cursor, whatever a file, an instrument or another person has put into it."""

import pytest
from rich.console import Console

from api.commands import terminal
from api.commands.console import PlainConsole, visible
from api.commands.terminal import show_table
from jointlab.report.section import Table
from tests.api.conftest import Command, Write

ESCAPE = "\x1b[2J\x1b]0;title\x07"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("k = 1.2 MN/m\n\tγ = 0,1 [red]", "k = 1.2 MN/m\n\tγ = 0,1 [red]"),
        (ESCAPE, "\\x1b[2J\\x1b]0;title\\x07"),
        ("\x9b2J\r\x00\x7f", "\\x9b2J\\x0d\\x00\\x7f"),
        ("abc\u202ecba\u200b", "abc\\u202ecba\\u200b"),
    ],
)
def test_control_characters_are_shown_as_numbers(text: str, shown: str) -> None:
    assert visible(text) == shown


def test_no_printing_sends_an_escape(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    console = PlainConsole()
    console.print(ESCAPE, style="bold")
    monkeypatch.setattr("builtins.input", lambda: "")
    console.input(ESCAPE)
    show_table(Table(ESCAPE, ("a", "b"), ((ESCAPE, ESCAPE),)))
    show_table(Table(ESCAPE, ("a",), ((ESCAPE,),)))
    said = capsys.readouterr().out
    assert "\x1b" not in said
    assert said.count("\\x1b[2J") == 7
    assert isinstance(console, Console)


JOINTS = Table(
    "Joints",
    ("joint", "element", "k (MN/m)", "95 %", "h (MN/m)", "95 %", "k by the paper's method, 95 %"),
    (
        ("I", "11 (not observable)", "1.786", "1.006 … 2.567", "1.19", "-0.542 … 2.92", "2.312 … 3.285"),
        ("II", "12", "-2.220", "-2.233 … -2.207", "-0.194", "-0.201 … -0.187", "-2.375 … -2.051"),
    ),
)


@pytest.mark.parametrize(("width", "interval"), [(140, "-2.233 … -2.207"), (80, "-2.233…-2.207")])
def test_no_number_and_no_interval_of_a_table_is_broken_at_80_columns(
    width: int, interval: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(terminal.out, "width", width)
    show_table(JOINTS)
    said = capsys.readouterr().out
    lines = said.splitlines()
    assert max(map(len, lines)) <= width
    assert interval in said
    for row in JOINTS.rows:
        told = next(line for line in lines if line.split()[:1] == [row[0]])
        assert [cell for cell in row[2:] if str(cell).replace(" ", "") not in told.replace(" ", "")] == []


def test_a_terminal_that_is_too_narrow_for_a_table_loses_nothing(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(terminal.out, "width", 40)
    show_table(Table("wide", ("a", "b"), (("1" * 30, "2" * 30),)))
    said = capsys.readouterr().out
    assert (said.count("1"), said.count("2")) == (30, 30)


def test_an_error_about_a_file_sends_no_escape(jointlab: Command, sequence: Write) -> None:
    path = sequence(hammer={"points": [ESCAPE]})
    refused = jointlab("run", path)
    assert refused.returncode == 3
    assert "\x1b" not in refused.stderr
