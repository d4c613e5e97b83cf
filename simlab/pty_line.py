"""A serial line between two pseudo-terminals: what a client writes at one end, an instrument reads at the other."""

from __future__ import annotations

import asyncio
import os
import tty
from types import TracebackType


class PtyLine:
    """Two pseudo-terminals whose far ends an event loop connects, from entering the context to leaving it.

    Attributes:
        client: path that a client opens, such as /dev/pts/3.
        instrument: path that the simulated instrument opens.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop) -> None:
        self._loop = loop
        self._near, self._near_end = os.openpty()
        self._far, self._far_end = os.openpty()
        self.client = os.ttyname(self._near_end)
        self.instrument = os.ttyname(self._far_end)

    def __enter__(self) -> PtyLine:
        for descriptor in (self._near, self._near_end, self._far, self._far_end):
            tty.setraw(descriptor)
        for descriptor in (self._near, self._far):
            os.set_blocking(descriptor, False)
        self._loop.add_reader(self._near, self._pass, self._near, self._far)
        self._loop.add_reader(self._far, self._pass, self._far, self._near)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for descriptor in (self._near, self._far):
            self._loop.remove_reader(descriptor)
        # the near ends of both are kept open here too, so that a client may close and open again
        for descriptor in (self._near, self._near_end, self._far, self._far_end):
            os.close(descriptor)

    @staticmethod
    def _pass(source: int, sink: int) -> None:
        os.write(sink, os.read(source, 4096))
