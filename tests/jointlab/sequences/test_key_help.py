"""Help for the keys of a sequence: every key of the schema is there, in words that hold."""

import re

from jointlab.sequences.key_help import KeyGroup, key_help
from rig.sequences.sequence import Sequence


def group(title: str) -> KeyGroup:
    (found,) = [each for each in key_help() if each.title == title]
    return found


def test_every_key_of_the_schema_has_help() -> None:
    keys = {key.key for each in key_help() for key in each.keys}
    schema = Sequence.model_json_schema()
    for part in (schema, *schema["$defs"].values()):
        assert set(part.get("properties", ())) <= keys


def test_a_key_says_its_kind_its_limits_its_unit_and_what_it_is_if_left_out() -> None:
    words = {key.key: key.text for key in group("step: hammer").keys}
    assert words["blows"] == "whole number, at least 2, at most 1000; accepted blows at each point; left out: 10"
    assert words["block_seconds"] == "number, more than 0, at most 120; s; left out: 2"
    assert words["beam"].startswith("one of supported, suspended; ")
    assert {key.key: key.text for key in group("the document").keys}["title"] == "text; has to be given"


def test_a_ratio_has_no_unit() -> None:
    texts = [key.text for each in key_help() for key in each.keys]
    assert not [text for text in texts if text.endswith((", 1", "; 1")) or "; 1;" in text]


def test_texts_are_plain_and_none_is_empty() -> None:
    texts = [key.text for each in key_help() for key in each.keys]
    assert all(text.strip() == text != "" for text in texts)
    assert not [text for text in texts if re.search(r"[\n`<>]|None|PydanticUndefined", text)]
