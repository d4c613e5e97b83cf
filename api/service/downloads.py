"""Files of any size: sent piece by piece while other requests are answered, few at a time, and few to one caller."""

import threading
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fastapi.responses import FileResponse
from starlette.types import Receive, Scope, Send

from api.service.problems import problem

DOWNLOADS = 12
"""Files that are sent at a time."""
DOWNLOADS_OF_A_CALLER = 3
"""Files that are sent to one caller at a time, so that a slow one leaves places to others."""


class TooManyDownloadsError(Exception):
    """There is no place for another download; the message says whose are full."""


class DownloadPlaces:
    """The number of files that are being sent to each caller. Any thread may call it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._sent = Counter[str]()

    @contextmanager
    def place(self, who: str) -> Iterator[None]:
        """A place for a download to `who`. Raises TooManyDownloadsError where there is none."""
        with self._lock:
            if self._sent[who] >= DOWNLOADS_OF_A_CALLER:
                raise TooManyDownloadsError(f"{who} is being sent {self._sent[who]} files; wait for one of them")
            if self._sent.total() >= DOWNLOADS:
                raise TooManyDownloadsError(f"{DOWNLOADS} files are being sent to others; try again later")
            self._sent[who] += 1
        try:
            yield
        finally:
            with self._lock:
                self._sent[who] -= 1
                self._sent += Counter()  # forgets who has none


class Download(FileResponse):
    """A file for `who`, or 429 where there is no place."""

    def __init__(self, path: Path, places: DownloadPlaces, who: str, *, media_type: str, inline: bool = False) -> None:
        shown = "inline" if inline else "attachment"
        super().__init__(path, media_type=media_type, filename=path.name, content_disposition_type=shown)
        self._places = places
        self._who = who

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send it."""
        try:
            with self._places.place(self._who):
                await super().__call__(scope, receive, send)
        except TooManyDownloadsError as error:
            await problem(429, str(error), {"Retry-After": "10"})(scope, receive, send)
