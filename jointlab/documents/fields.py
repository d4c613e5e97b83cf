"""Types of fields that several documents have."""

import json
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Discriminator, Field, Tag

from rig.sequences.sequence import Sequence, validated_sequence
from store.validation import TextLike

LARGEST = 2**31 - 1
"""The largest number of a row that a request may name."""
LARGEST_EXACT = 2**53 - 1
"""The largest number of a sine record, point, prompt, pause or STOP; JavaScript represents it exactly."""

Name = Annotated[
    str,
    TextLike(
        r"^[A-Za-z0-9][A-Za-z0-9._ -]{0,99}$",
        "write 1 to 100 letters, digits, spaces, dots, underscores and hyphens, and begin with a letter or a digit",
    ),
]
"""Name of a stored sequence."""
OneLine = Annotated[
    str,
    TextLike(
        r"^[^\s\x00-\x1f\x7f]([^\x00-\x1f\x7f]{0,498}[^\s\x00-\x1f\x7f])?$",
        "write 1 to 500 characters in one line, without spaces at its ends",
    ),
]
"""Text that a person writes, in one line."""
NumberOrNull = float | None
"""A number; null where it is not known."""


def _from_json(value: Any) -> Any:
    if not isinstance(value, dict):
        return value
    if "\\u0000" in json.dumps(value):
        raise ValueError("a sequence contains the character NUL, which not every database can store")
    return validated_sequence(value)


def _form_of(value: Any) -> str | None:
    return "name" if isinstance(value, str) else "document" if isinstance(value, dict | Sequence) else None


WholeSequence = Annotated[Sequence, BeforeValidator(_from_json)]
"""A sequence in the body of a request."""
AnySequence = Annotated[
    Annotated[Name, Tag("name")] | Annotated[WholeSequence, Tag("document")],
    Discriminator(
        _form_of,
        custom_error_type="neither_name_nor_document",
        custom_error_message="is neither the name of a sequence nor an object with named values",
    ),
]
"""A stored sequence by its name, or a whole one; what is wrong is said of the form that was given."""


class Request(BaseModel):
    """The body of a request. An unknown key is refused, and so is a number that is not finite."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)


class Why(Request):
    """Why something is done, for the audit log."""

    reason: OneLine = Field(description="why it is done")
