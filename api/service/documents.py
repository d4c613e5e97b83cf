"""What documents of several resources have in common: names, numbers and quantities with their units."""

from __future__ import annotations

import json
from typing import Annotated, Any

from fastapi import Header, Path, Query
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints

from api.service.pages import LARGEST
from rig.sequence import Sequence

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9._ -]{0,99}$")]
Words = Annotated[str, StringConstraints(pattern=r"^[^\s\x00-\x1f\x7f]([^\x00-\x1f\x7f]{0,498}[^\s\x00-\x1f\x7f])?$")]
"""Text that a person writes, in one line."""


def _by_way_of_json(value: Any) -> Any:
    # where an array is a tuple; a sequence's article is strict about that
    if not isinstance(value, dict):
        return value
    text = json.dumps(value)
    if "\\u0000" in text:
        raise ValueError("a sequence holds the character NUL, which not every database keeps")
    return Sequence.model_validate_json(text)


WholeSequence = Annotated[Sequence, BeforeValidator(_by_way_of_json)]
"""A sequence in the body of a request."""

RunNumber = Annotated[int, Path(ge=1, le=LARGEST, description="number of the run", examples=[1])]

OfAnalysis = Annotated[
    int | None, Query(ge=1, le=LARGEST, description="number of the analysis; the newest where none is given")
]
"""Whose results are read."""

IdempotencyKey = Annotated[
    str,
    Header(
        alias="Idempotency-Key",
        pattern=r"^[\x21-\x7e]{1,128}$",
        description="chosen by the sender, new for every request; a repeat gets the first answer",
    ),
]


class Why(BaseModel):
    """Why something is done, for the audit log."""

    model_config = ConfigDict(extra="forbid")

    reason: Words = Field(description="what was seen, or seen to")


def number_of(what: str) -> Any:
    """A path parameter: the number of a row."""
    return Path(ge=1, le=LARGEST, description=f"number of the {what}", examples=[1])
