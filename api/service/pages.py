"""Long lists come in pages; each says where the next one begins."""

from __future__ import annotations

from base64 import urlsafe_b64decode, urlsafe_b64encode
from binascii import Error as Base64Error
from collections.abc import Callable, Sequence
from typing import Annotated, Generic, TypeVar

from fastapi import Query
from pydantic import BaseModel, Field

from jointlab.errors import JointlabError

ItemT = TypeVar("ItemT")
LARGEST = 2**31 - 1

Limit = Annotated[int, Query(ge=1, le=1000, description="at most so many items")]
Cursor = Annotated[str | None, Query(max_length=400, description="`next` of the page before; none for the first page")]


class Page(BaseModel, Generic[ItemT]):
    """A part of a list."""

    items: list[ItemT]
    next: str | None = Field(description="give it as `cursor` to get the next page; null on the last one")


def to_cursor(key: int | str) -> str:
    """The cursor of a page that begins behind `key`."""
    return urlsafe_b64encode(str(key).encode()).decode().rstrip("=")


def from_cursor(cursor: str | None) -> str | None:
    """The key that a cursor stands for; None for the first page.

    Raises:
        JointlabError: it is no cursor.
    """
    if cursor is None:
        return None
    try:
        return urlsafe_b64decode(cursor + "=" * (-len(cursor) % 4)).decode()
    except (Base64Error, ValueError) as error:
        raise JointlabError(f"{cursor!r} is no cursor; give `next` of the page before") from error


def number_from(cursor: str | None) -> int | None:
    """The number that a cursor stands for; None for the first page.

    Raises:
        JointlabError: it is no cursor of a list that is in the order of numbers.
    """
    key = from_cursor(cursor)
    if key is None:
        return None
    if not (key.isascii() and key.isdecimal() and 0 <= int(key[:12]) <= LARGEST and len(key) <= 12):
        raise JointlabError(f"{cursor!r} is no cursor of this list; give `next` of the page before")
    return int(key)


def page_of(found: Sequence[ItemT], limit: int, key: Callable[[ItemT], int | str]) -> Page[ItemT]:
    """A page of `found`, which holds one item more than `limit` where the list goes on."""
    items = list(found[:limit])
    return Page(items=items, next=to_cursor(key(items[-1])) if len(found) > limit else None)


def page_of_whole(found: Sequence[ItemT], limit: int, cursor: str | None) -> Page[ItemT]:
    """A page of a list that is there as a whole; its cursor is the place in it."""
    begin = number_from(cursor) or 0
    end = begin + limit
    return Page(items=list(found[begin:end]), next=to_cursor(end) if end < len(found) else None)
