"""Ctrl-C while a run is on: it stops with the actuator at rest, and pressing it again changes nothing."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from queue import SimpleQueue
from types import FrameType

from rich.console import Console

from rig.control import RunControl
from rig.errors import RigError

INTERRUPTED = 130
"""Exit code of a command that Ctrl-C ended."""


@contextmanager
def stopping_on_interrupt(control: RunControl, console: Console) -> Iterator[None]:
    """Let Ctrl-C stop the run that `control` controls, instead of raising KeyboardInterrupt wherever the program is.

    An exception could come while the actuator is being brought to rest; a stop cannot do harm however often it is
    asked for. It is asked for in a thread of its own, because the handler runs in the middle of whatever the main
    thread does, locks held.
    """
    requests = SimpleQueue[bool]()  # whose put may interrupt itself

    def stop() -> None:
        while requests.get():
            console.print("stopping: bringing the actuator to rest")
            try:
                control.stop()
            except RigError as error:
                console.print(str(error), style="red")

    def interrupted(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - a handler is given both
        requests.put(True)

    stopper = threading.Thread(target=stop, name="stop on Ctrl-C", daemon=True)
    stopper.start()
    before = signal.signal(signal.SIGINT, interrupted)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        requests.put(False)
        stopper.join()


@contextmanager
def raising_on_interrupt() -> Iterator[None]:
    """Let Ctrl-C raise KeyboardInterrupt while the context lasts, to leave a wait for a key; for the main thread."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
