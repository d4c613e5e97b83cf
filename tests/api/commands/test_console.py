"""What is printed moves no cursor, whatever a file, an instrument or another person has put into it."""

import pytest
from rich.console import Console

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


def test_an_error_about_a_file_sends_no_escape(jointlab: Command, sequence: Write) -> None:
    path = sequence(hammer={"points": [ESCAPE]})
    refused = jointlab("run", path)
    assert refused.returncode == 3
    assert "\x1b" not in refused.stderr
