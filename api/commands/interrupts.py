"""Keys while a run is on: Ctrl-C stops it, Ctrl-Z (Ctrl-Break on Windows) pauses it, the actuator at rest with both."""

import logging
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from queue import SimpleQueue
from types import FrameType
from typing import Protocol

from rich.console import Console

from jointlab.errors import EXPECTED

log = logging.getLogger(__name__)
INTERRUPTED = 130
"""Exit code of a command that Ctrl-C ended."""
if sys.platform == "win32":
    PAUSE, PAUSE_KEY = signal.SIGBREAK, "Ctrl-Break"
else:
    PAUSE, PAUSE_KEY = signal.SIGTSTP, "Ctrl-Z"


class Control(Protocol):
    """Requests to a run; a pause and a stop return with the actuator at rest."""

    def pause(self) -> object:
        """Pause it."""

    def resume(self) -> None:
        """Let it go on."""

    def stop(self) -> None:
        """End it."""

    def is_paused(self) -> bool:
        """Whether it is paused."""

    def is_interrupted(self) -> bool:
        """Whether it is paused, is being ended or has ended."""


@contextmanager
def steering_by_keys(control: Control, console: Console) -> Iterator[None]:
    """Let Ctrl-C stop the run that `control` controls, and Ctrl-Z pause and continue it.

    Ctrl-C would raise KeyboardInterrupt wherever the program is, maybe while the actuator is being brought to rest; a
    stop does no harm however often it is requested. Ctrl-Z would suspend the program and its heartbeat with it, so
    that the tester's watchdog trips. A thread of its own carries out the requests, because the handler interrupts the
    main thread at any place, even where that holds locks.
    """
    requests = SimpleQueue[Callable[[], None] | None]()  # whose put may interrupt itself

    def do() -> None:
        while (request := requests.get()) is not None:
            try:
                request()
            except Exception as error:  # whatever it is: the next key has to work, above all Ctrl-C
                console.print(str(error) or type(error).__name__, style="red")
                if not isinstance(error, EXPECTED):
                    log.exception("what a key asked for ended with an unexpected error")

    def stop() -> None:
        console.print("stopping: bringing an actuator that the run drives to rest")
        control.stop()

    def pause_or_go_on() -> None:
        if control.is_paused():
            console.print("going on")
            control.resume()
        elif not control.is_interrupted():
            console.print("pausing: bringing an actuator that the run drives to rest")
            control.pause()
            console.print(f"paused; {PAUSE_KEY} goes on, Ctrl-C stops")

    requests_of = {signal.SIGINT: stop, PAUSE: pause_or_go_on}

    def pressed(number: int, frame: FrameType | None) -> None:  # noqa: ARG001 - a handler is given both
        requests.put(requests_of[signal.Signals(number)])

    worker = threading.Thread(target=do, name="keys", daemon=True)
    worker.start()
    try:
        with ExitStack() as handled:
            for number in requests_of:
                handled.enter_context(_handled_by(pressed, number))
            yield
    finally:
        requests.put(None)
        worker.join()


@contextmanager
def _handled_by(handler: Callable[[int, FrameType | None], object], number: signal.Signals) -> Iterator[None]:
    before = signal.signal(number, handler)
    try:
        yield
    finally:
        signal.signal(number, before)
