"""The base of all documents from outside, which checks them: sequences, maps of testers, corrected simulations."""

from pydantic import BaseModel, ConfigDict


class Document(BaseModel):
    """A part of a file: an unknown key is refused, values cannot be changed, numbers are finite."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
