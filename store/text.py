"""Halves of surrogate pairs in text: JSON and the arguments of a command may have them, and no database takes them."""

import json
import re
from collections.abc import Callable
from typing import Any

HALF = re.compile(r"[\ud800-\udfff]")
"""Half of a surrogate pair. It is no character, and has no form in UTF-8."""
REPLACEMENT = "\N{REPLACEMENT CHARACTER}"


def contains_half(document: Any) -> bool:
    """Whether a text in a document of JSON contains half of a surrogate pair."""
    return HALF.search(json.dumps(document, ensure_ascii=False)) is not None


def without_halves(value: Any) -> Any:
    """Text with U+FFFD in place of each half of a surrogate pair; any other value as it is."""
    return HALF.sub(REPLACEMENT, value) if isinstance(value, str) and HALF.search(value) else value


def changed(document: Any, change: Callable[[Any], Any]) -> Any:
    """A document of JSON with `change` applied to its keys, and to its values that are no list and no object."""
    if isinstance(document, dict):
        return {change(key): changed(value, change) for key, value in document.items()}
    if type(document) in (list, tuple):
        return [changed(value, change) for value in document]
    return change(document)
