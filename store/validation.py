"""Errors that pydantic finds in a document, in words for people who do not know pydantic."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from pydantic_core import PydanticCustomError

FieldPath = tuple[int | str, ...]
"""Keys and indices from the document down to a value."""
LONGEST_INPUT = 60  # characters of a wrong value that are shown

_WORDS: Mapping[str, str] = {
    "missing": "is missing",
    "extra_forbidden": "there is no such key",
    "greater_than": "is {input}; it has to be more than {gt}",
    "greater_than_equal": "is {input}; it has to be {ge} or more",
    "less_than": "is {input}; it has to be less than {lt}",
    "less_than_equal": "is {input}; it has to be {le} or less",
    "finite_number": "is {input}, which is no finite number",
    "literal_error": "is {input}; it has to be {expected}",
    "enum": "is {input}; it has to be {expected}",
    "union_tag_invalid": "{discriminator} is {tag!r}; it has to be {expected_tags}",
    "union_tag_not_found": "{discriminator} is missing",
    "string_too_short": "is {input}; it needs {min_length} or more characters",
    "string_too_long": "has more than {max_length} characters",
    "too_short": "has {actual_length} values; it needs {min_length} or more",
    "too_long": "has {actual_length} values; it may have {max_length}",
    "value_error": "{error}",
    "contradiction": "{error}",
} | {
    kind: f"is {{input}}, which is no {what}"
    for what, kinds in {
        "number": ("float_type", "float_parsing"),
        "whole number": ("int_type", "int_parsing", "int_from_float", "int_parsing_size"),
        "text": ("string_type",),
        "list": ("list_type", "tuple_type"),
        "true or false": ("bool_type", "bool_parsing"),
        "object with named values": ("model_type", "dict_type", "model_attributes_type"),
    }.items()
    for kind in kinds
}  # fmt: skip


def contradiction(error: str, *place: int | str) -> PydanticCustomError:
    """An error for the validator of a whole document to raise, whose cause is at one place in it."""
    return PydanticCustomError("contradiction", "{error}", {"error": error, "place": place})


def place_of(item: Mapping[str, Any]) -> FieldPath:
    """The place of one of pydantic's errors."""
    return (*item["loc"], *item.get("ctx", {}).get("place", ()))


def fault_of(item: Mapping[str, Any]) -> str:
    """One of pydantic's errors as the end of a sentence that begins with the place; its own words where it is rare."""
    context = {name: f"{value:g}" if isinstance(value, float) else value for name, value in item.get("ctx", {}).items()}
    shown = repr(item.get("input"))
    shown = shown if len(shown) <= LONGEST_INPUT else f"{shown[:LONGEST_INPUT]}..."
    try:
        return _WORDS[item["type"]].format(**{"input": shown, **context})
    except KeyError:
        return str(item["msg"])


def place_text(place: FieldPath, whole: str) -> str:
    """A place as text in one line, such as ``steps.0.blows``; `whole` for the document itself."""
    names = map(str, place)
    return ".".join(name if name.isprintable() else repr(name) for name in names) or whole


def faults_text(
    items: Iterable[Mapping[str, Any]], whole: str = "document", where: Callable[[FieldPath], str] = lambda _: ""
) -> str:
    """All of pydantic's errors in one line.

    Args:
        items: of `ValidationError.errors`.
        whole: name of the document itself.
        where: more about a place, such as its line; it comes before the place.
    """
    placed = ((place_of(item), fault_of(item)) for item in items)
    return "; ".join(f"{where(place)}{place_text(place, whole)}: {fault}" for place, fault in placed)
