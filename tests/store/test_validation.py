"""Errors of pydantic in plain words."""

from datetime import date
from typing import Annotated, Literal

import pytest
from pydantic import AwareDatetime, BaseModel, ConfigDict, Field, ValidationError

from store.quantity import quantity
from store.validation import TextLike, faults_text


class _Document(BaseModel):
    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    number: Annotated[float, Field(gt=0, le=10)] = 1
    count: int = 1
    kind: Literal["a", "b"] = "a"
    names: Annotated[tuple[str, ...], Field(min_length=1, max_length=2)] = ("x",)
    stress: Annotated[float | None, quantity("Pa", "of contact", ge=1e6, lt=1e9)] = None
    day: date = date(2026, 3, 31)
    at: AwareDatetime | None = None
    word: Annotated[str, TextLike("^[a-z]{1,3}$", "write 1 to 3 small letters")] = "x"
    code: Annotated[str, Field(pattern="^[0-9]+$")] = "1"
    inner: "_Document | None" = None


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"number": 0}, "number: is 0; it has to be more than 0"),
        ({"number": 11}, "number: is 11; it has to be 10 or less"),
        ({"number": "x"}, "number: is 'x', which is no number"),
        ({"number": float("nan")}, "number: is nan, which is no finite number"),
        ({"count": 1.5}, "count: is 1.5, which is no whole number"),
        ({"kind": "c"}, "kind: is 'c'; it has to be 'a' or 'b'"),
        ({"names": []}, "names: has 0 values; it needs 1 or more"),
        ({"names": ["x"] * 3}, "names: has 3 values; it may have 2"),
        ({"names": ["x", 3]}, "names.1: is 3, which is no text"),
        ({"names": [3]}, "names.0: is 3, which is no text"),
        ({"inner": {"size": 1}}, "inner.size: there is no such key"),
        ({"inner": 5}, "inner: is 5, which is no object with named values"),
        ({"stress": 5}, "stress: is 5; it has to be 1e+06 Pa or more"),
        ({"stress": 1e9}, "stress: is 1000000000.0; it has to be less than 1e+09 Pa"),
        ({"stress": "x"}, "stress: is 'x', which is no number"),
        ({"day": "tomorrow"}, "day: is 'tomorrow', which is no day such as 2026-03-31"),
        ({"day": "2026-13-01"}, "day: is '2026-13-01', which is no day such as 2026-03-31"),
        ({"at": "noon"}, "at: is 'noon', which is no time such as 2026-03-31T12:00:00Z"),
        ({"at": "2026-03-31T12:00:00"}, "at: is '2026-03-31T12:00:00'; say its time zone, as in 2026-03-31T12:00:00Z"),
        ({"word": "ab\n"}, "word: is 'ab\\n'; write 1 to 3 small letters"),
        ({"code": "x"}, "code: is 'x', which has a character or a form that is not allowed here"),
        (7, "document: is 7, which is no object with named values"),
        ({"count": "y" * 1000}, f"count: is '{'y' * 59}..., which is no whole number"),
    ],
)
def test_a_fault_is_told_in_words_that_need_no_pydantic(given: object, words: str) -> None:
    with pytest.raises(ValidationError) as refused:
        _Document.model_validate(given)
    assert faults_text(refused.value.errors()) == words


def test_the_schema_of_a_text_has_its_pattern() -> None:
    assert _Document.model_json_schema()["$defs"]["_Document"]["properties"]["word"]["pattern"] == "^[a-z]{1,3}$"
