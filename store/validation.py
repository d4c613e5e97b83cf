"""Errors that pydantic finds in a document, in words for people who do not know pydantic."""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from store.text import HALF

FieldPath = tuple[int | str, ...]
"""Keys and indices from the document down to a value."""
LONGEST_INPUT = 60  # characters of a wrong value that are shown

_WORDS: Mapping[str, str] = {
    "missing": "is missing",
    "extra_forbidden": "there is no such key",
    "greater_than": "is {input}; it has to be more than {gt}{unit}",
    "greater_than_equal": "is {input}; it has to be {ge}{unit} or more",
    "less_than": "is {input}; it has to be less than {lt}{unit}",
    "less_than_equal": "is {input}; it has to be {le}{unit} or less",
    "finite_number": "is {input}, which is no finite number",
    "literal_error": "is {input}; it has to be {expected}",
    "enum": "is {input}; it has to be {expected}",
    "union_tag_invalid": "{discriminator} is {tag!r}; it has to be {expected_tags}",
    "union_tag_not_found": "{discriminator} is missing",
    "string_too_short": "is {input}; it needs {min_length} or more characters",
    "string_too_long": "has more than {max_length} characters",
    "too_short": "has {actual_length} values; it needs {min_length} or more",
    "too_long": "has {actual_length} values; it may have {max_length}",
    "string_pattern_mismatch": "is {input}, which has a character or a form that is not allowed here",
    "json_invalid": "is no JSON: {error}",
    "timezone_aware": "is {input}; say its time zone, as in 2026-03-31T12:00:00Z",
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
        "day such as 2026-03-31": (
            "date_type", "date_parsing", "date_from_datetime_parsing", "date_from_datetime_inexact",
        ),
        "time such as 2026-03-31T12:00:00Z": ("datetime_type", "datetime_parsing", "datetime_from_date_parsing"),
        "object with named values": ("model_type", "dict_type", "model_attributes_type"),
    }.items()
    for kind in kinds
}  # fmt: skip


def contradiction(error: str, *place: int | str) -> PydanticCustomError:
    """An error for the validator of a whole document to raise, whose cause is at one place in it."""
    return PydanticCustomError("contradiction", "{error}", {"error": error, "place": place})


@dataclass(frozen=True)
class TextLike:
    """Metadata of a text that matches a pattern: the schema has the pattern, and a person is told the words.

    A text with half of a surrogate pair is refused, too; patterns of JavaScript take whole characters for such halves.

    Attributes:
        pattern: regular expression of the whole text.
        words: what to write, as a command.
    """

    pattern: str
    words: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_after_validator_function(self._checked, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return handler(schema) | {"pattern": self.pattern}

    def _checked(self, text: str) -> str:
        if HALF.search(text):
            raise contradiction(f"is {_shown(text)}, which contains half of a surrogate pair")
        if re.fullmatch(self.pattern, text) is None:
            raise contradiction(f"is {_shown(text)}; {self.words}")
        return text


def place_of(item: Mapping[str, Any]) -> FieldPath:
    """The place of one of pydantic's errors."""
    return (*item["loc"], *item.get("ctx", {}).get("place", ()))


def fault_of(item: Mapping[str, Any]) -> str:
    """One of pydantic's errors as the end of a sentence that begins with the place; its own words where it is rare."""
    context = {name: f"{value:g}" if isinstance(value, float) else value for name, value in item.get("ctx", {}).items()}
    unit = f" {context['unit']}" if "unit" in context else ""
    try:
        return _WORDS[item["type"]].format(**{"input": _shown(item.get("input")), **context, "unit": unit})
    except KeyError:
        return str(item["msg"])


def _shown(value: Any) -> str:
    shown = repr(value)
    return shown if len(shown) <= LONGEST_INPUT else f"{shown[:LONGEST_INPUT]}..."


def place_text(place: FieldPath, whole: str) -> str:
    """A place as text in one line, such as ``steps.0.blows``; `whole` for the document itself."""
    names = map(str, place)
    return ".".join(name if name.isprintable() else repr(name) for name in names) or whole


def own_faults(items: Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Pydantic's errors without those that follow from others: to it a list has only its right items."""
    every = list(items)
    places = [place_of(item) for item in every]

    def follows(item: Mapping[str, Any], at: FieldPath) -> bool:
        return item["type"] == "too_short" and any(len(each) > len(at) and each[: len(at)] == at for each in places)

    return [item for item, at in zip(every, places, strict=True) if not follows(item, at)]


def faults_text(
    items: Iterable[Mapping[str, Any]], whole: str = "document", where: Callable[[FieldPath], str] = lambda _: ""
) -> str:
    """All of pydantic's errors in one line, without those that follow from others.

    Args:
        items: of `ValidationError.errors`.
        whole: name of the document itself.
        where: more about a place, such as its line; it comes before the place.
    """
    placed = ((place_of(item), fault_of(item)) for item in own_faults(items))
    return "; ".join(f"{where(place)}{place_text(place, whole)}: {fault}" for place, fault in placed)
