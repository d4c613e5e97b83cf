"""Types of fields that several documents have."""

import json
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints

from rig.sequences.sequence import Sequence

LARGEST = 2**31 - 1
"""The largest number of a row that a request may name."""
LARGEST_POINT = 2**53 - 1
"""The largest number of a sine record or point, which may exceed 4 bytes; JavaScript represents it exactly."""

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9][A-Za-z0-9._ -]{0,99}$")]
"""Name of a stored sequence."""
OneLine = Annotated[str, StringConstraints(pattern=r"^[^\s\x00-\x1f\x7f]([^\x00-\x1f\x7f]{0,498}[^\s\x00-\x1f\x7f])?$")]
"""Text that a person writes, in one line."""
NumberOrNull = float | None
"""A number; null where it is not known."""


def _from_json(value: Any) -> Any:
    # by way of JSON text, where an array is a tuple: the article of a sequence accepts no list
    if not isinstance(value, dict):
        return value
    text = json.dumps(value)
    if "\\u0000" in text:
        raise ValueError("a sequence contains the character NUL, which not every database can store")
    return Sequence.model_validate_json(text)


WholeSequence = Annotated[Sequence, BeforeValidator(_from_json)]
"""A sequence in the body of a request."""


class Request(BaseModel):
    """The body of a request. An unknown key is refused, and so is a number that is not finite."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class Why(Request):
    """Why something is done, for the audit log."""

    reason: OneLine = Field(description="why it is done")
