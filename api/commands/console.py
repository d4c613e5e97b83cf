"""Consoles of the commands. They print no control characters, as text may come from files or instruments."""

from __future__ import annotations

import unicodedata
from typing import Any

from rich.console import Console


def visible(text: str) -> str:
    """The text with every control character written as its number, such as \\x1b; ends of lines and tabs stay.

    Characters that cannot be seen or turn the direction of writing are control characters, too.
    """
    return "".join(_escaped(each) if unicodedata.category(each) in ("Cc", "Cf", "Cs") else each for each in text)


class PlainConsole(Console):
    """Prints text as it is: brackets are no markup, and control characters are shown, not sent to the terminal.

    Attributes:
        texts: how many it has printed.
    """

    def __init__(self, *, stderr: bool = False, soft_wrap: bool = False) -> None:
        super().__init__(stderr=stderr, soft_wrap=soft_wrap, highlight=False, markup=False)
        self.texts = 0

    def print(self, *objects: Any, **options: Any) -> None:
        """Print objects; control characters in texts are shown."""
        self.texts += any(isinstance(each, str) for each in objects)
        super().print(*(visible(each) if isinstance(each, str) else each for each in objects), **options)


def _escaped(character: str) -> str:
    if character in "\n\t":
        return character
    number = ord(character)
    return f"\\x{number:02x}" if number < 0x100 else f"\\u{number:04x}"
