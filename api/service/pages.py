"""Long lists come in pages; each says where the next one begins."""

from base64 import urlsafe_b64decode, urlsafe_b64encode
from binascii import Error as Base64Error
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Generic, TypeVar

from fastapi import Depends, Query
from pydantic import BaseModel, Field

from jointlab.documents.fields import LARGEST
from jointlab.errors import JointlabError

ItemT = TypeVar("ItemT")
_Limit = Annotated[int, Query(ge=1, le=1000, description="largest number of items")]
_Cursor = Annotated[str | None, Query(max_length=400, description="`next` of the page before; none for the first page")]


class Page(BaseModel, Generic[ItemT]):
    """A part of a list."""

    items: list[ItemT]
    next: str | None = Field(description="give it as `cursor` to get the next page; null on the last one")


@dataclass(frozen=True)
class PageRequest:
    """The page of a list that is asked for.

    Attributes:
        limit: largest number of items.
        cursor: says where the page begins; None for the first page.
    """

    limit: int
    cursor: str | None

    @property
    def rows(self) -> int:
        """The number of rows to read: one more than the page holds tells whether the list goes on."""
        return self.limit + 1

    @property
    def key(self) -> str | None:
        """The key behind which the page begins; None for the first page.

        Raises:
            JointlabError: the cursor is none.
        """
        if self.cursor is None:
            return None
        try:
            return urlsafe_b64decode(self.cursor + "=" * (-len(self.cursor) % 4)).decode()
        except (Base64Error, ValueError) as error:
            raise JointlabError(f"{self.cursor!r} is no cursor; give `next` of the page before") from error

    @property
    def number(self) -> int | None:
        """The number behind which the page begins; None for the first page.

        Raises:
            JointlabError: it is no cursor of a list that is in the order of numbers.
        """
        return self.number_up_to(LARGEST)

    def number_up_to(self, largest: int) -> int | None:
        """As `number`, where numbers go up to `largest`.

        Raises:
            JointlabError: as `number`.
        """
        key = self.key
        if key is None:
            return None
        if not (key.isascii() and key.isdecimal() and len(key) <= len(str(largest)) and int(key) <= largest):
            raise self.foreign_cursor()
        return int(key)

    def foreign_cursor(self) -> JointlabError:
        """The error that the cursor belongs to another list."""
        return JointlabError(f"{self.cursor!r} is no cursor of this list; give `next` of the page before")

    def of_rows(self, items: Sequence[ItemT], key: str = "id") -> Page[ItemT]:
        """A page of the items of `rows` rows; `key` names the field by which the list is in order."""
        shown = list(items[: self.limit])
        return Page(items=shown, next=_cursor(getattr(shown[-1], key)) if len(items) > self.limit else None)

    def of_whole(self, items: Sequence[ItemT]) -> Page[ItemT]:
        """A page of a list that was read as a whole; its cursor is the place in the list."""
        begin = self.number or 0
        end = begin + self.limit
        return Page(items=list(items[begin:end]), next=_cursor(end) if end < len(items) else None)


def _page_request(limit: _Limit = 100, cursor: _Cursor = None) -> PageRequest:
    return PageRequest(limit, cursor)


def _long_page_request(limit: _Limit = 1000, cursor: _Cursor = None) -> PageRequest:
    return PageRequest(limit, cursor)


Paging = Annotated[PageRequest, Depends(_page_request)]
LongPaging = Annotated[PageRequest, Depends(_long_page_request)]


def _cursor(key: int | str) -> str:
    return urlsafe_b64encode(str(key).encode()).decode().rstrip("=")
