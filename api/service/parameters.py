"""What routes have in common: parameters of requests, links in the schema, and documents of stored rows."""

import re
from datetime import date
from typing import Annotated, Any, TypeVar

from fastapi import Header, Path, Query
from pydantic import BaseModel, BeforeValidator

from jointlab.documents.fields import LARGEST, OneLine
from rig.errors import RequestError
from store.validation import TextLike

Links = dict[int | str, dict[str, Any]]
DocumentT = TypeVar("DocumentT", bound=BaseModel)
LimitT = TypeVar("LimitT", date, float)
RunNumber = Annotated[int, Path(ge=1, le=LARGEST, description="number of the run", examples=[1])]
ArticleName = Annotated[OneLine, Query(description="the test article")]
OptionalArticle = Annotated[OneLine | None, Query(description="the test article")]
ChosenAnalysis = Annotated[
    int | None, Query(ge=1, le=LARGEST, description="number of the analysis; the newest where none is given")
]
"""The analysis whose results are read."""


def _written_as_day(given: object) -> object:
    # pydantic also takes seconds since 1970 for a day, which the schema does not offer
    if isinstance(given, str) and not re.fullmatch("[0-9]{4}-[0-9]{2}-[0-9]{2}", given):
        raise ValueError("write a day such as 2026-03-31")
    return given


Day = Annotated[date, BeforeValidator(_written_as_day)]
"""A day, as the schema has it."""
IdempotencyKey = Annotated[
    str,
    TextLike(r"^[\x21-\x7e]{1,128}$", "write 1 to 128 characters of ASCII that are no spaces"),
    Header(
        alias="Idempotency-Key",
        description="chosen by the sender, new for every request; a repeat gets the first answer",
    ),
]


def check_rising(first: str, low: LimitT | None, last: str, high: LimitT | None) -> None:
    """Check that parameter `first` is not beyond `last`; None is no limit. Raises RequestError where it is."""
    if low is not None and high is not None and low > high:
        raise RequestError(f"{first} {low} is beyond {last} {high}, so that nothing can fit; exchange them")


def number_of(kind: str, largest: int = LARGEST) -> Any:
    """A path parameter: the number of a row of this kind."""
    return Path(ge=1, le=largest, description=f"number of the {kind}", examples=[1])


def document(model: type[DocumentT], row: object, **others: Any) -> DocumentT:
    """A document with `others`, and for every other field the attribute of `row` with the same name."""
    same = {name: getattr(row, name) for name in model.model_fields if name not in others}
    return model.model_validate(same | others)


def links(status: int, parameter: str, *operations: str, field: str = "id") -> Links:
    """For the `responses` of a route: `operations` take `field` of its answer, with `status`, as their `parameter`."""
    found = {
        name.replace("-", "_"): {"operationId": name, "parameters": {parameter: f"$response.body#/{field}"}}
        for name in operations
    }
    return {status: {"description": "Successful Response", "links": found}}


def first_of(parameter: str, *operations: str) -> Links:
    """For the `responses` of a list: `operations` take the number of its first item as their `parameter`."""
    return links(200, parameter, *operations, field="items/0/id")
