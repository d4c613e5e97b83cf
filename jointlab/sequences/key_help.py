"""The keys of a sequence document in words, from its schema: what each means, and what may be written."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from rig.sequences.sequence import Sequence

Schema = Mapping[str, Any]
TYPES = {"number": "number", "integer": "whole number", "string": "text", "boolean": "true or false", "object": "keys"}
LIMITS = {"exclusiveMinimum": "more than", "minimum": "at least", "exclusiveMaximum": "less than", "maximum": "at most"}


class KeyHelp(NamedTuple):
    """One key, and what may be written for it."""

    key: str
    text: str


class KeyGroup(NamedTuple):
    """The keys of one part of the document; `about` says what the part is."""

    title: str
    about: str
    keys: tuple[KeyHelp, ...]


def key_help() -> tuple[KeyGroup, ...]:
    """All keys of a sequence, part by part, the document itself first."""
    schema = Sequence.model_json_schema()
    return tuple(_groups("the document", schema, schema["$defs"], set()))


def _groups(title: str, part: Schema, parts: Mapping[str, Schema], seen: set[str]) -> Iterator[KeyGroup]:
    """A part, and those that its keys have below them, each once."""
    properties: Mapping[str, Schema] = part["properties"]
    required = part.get("required", ())
    keys = tuple(KeyHelp(key, _text(each, parts, key in required)) for key, each in properties.items())
    yield KeyGroup(title, str(part.get("description", "")), keys)
    for key, each in properties.items():
        for name in _below(each):
            if name not in seen and "properties" in parts[name]:
                seen.add(name)
                step = parts[name]["properties"].get("step", {}).get("const")
                yield from _groups(f"step: {step}" if step else key, parts[name], parts, seen)


def _below(value: Schema) -> Iterator[str]:
    """Names of the parts that a value refers to."""
    if "$ref" in value:
        yield str(value["$ref"]).rsplit("/", 1)[-1]
    for each in (*value.get("anyOf", ()), *value.get("oneOf", ()), *([value["items"]] if "items" in value else ())):
        yield from _below(each)


def _text(value: Schema, parts: Mapping[str, Schema], required: bool) -> str:
    said = [_kind(value, parts)]
    if "description" in value:
        about = str(value["description"])
        said.append(about.removesuffix(", 1") if value.get("x-unit") == "1" else about)
    said = [each for each in said if each != "1"]  # the unit of a ratio says nothing
    if required and "const" not in value:
        said.append("has to be given")
    elif (default := value.get("default")) is not None:
        said.append(f"left out: {_plain(default)}")
    return "; ".join(said)


def _kind(value: Schema, parts: Mapping[str, Schema]) -> str:
    """The kind of a value, with its limits."""
    if "$ref" in value:
        named = parts[str(value["$ref"]).rsplit("/", 1)[-1]]
        return _kind(named, parts) if "enum" in named else "keys of its own"
    if "const" in value:
        return _plain(value["const"])
    if "enum" in value:
        return f"one of {', '.join(map(_plain, value['enum']))}"
    if "anyOf" in value:
        return " or ".join(_kind(each, parts) for each in value["anyOf"] if each.get("type") != "null")
    if "oneOf" in value:
        return "keys of its own"
    if value.get("type") == "array":
        return f"list of {_kind(value['items'], parts)}" if "items" in value else "list"
    limits = [f"{words} {_plain(value[limit])}" for limit, words in LIMITS.items() if limit in value]
    return ", ".join([TYPES[str(value["type"])], *limits])


def _plain(value: Any) -> str:
    """A value as it is written in YAML."""
    if isinstance(value, list):
        return f"[{', '.join(map(_plain, value))}]"
    if isinstance(value, dict):
        return f"{{{', '.join(f'{key}: {_plain(each)}' for key, each in value.items())}}}"
    return f"{value:g}" if isinstance(value, float) else str(value)
