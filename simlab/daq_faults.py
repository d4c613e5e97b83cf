"""What can be made to go wrong with the simulated acquisition, by name."""

from __future__ import annotations

import threading
from collections import Counter

from simlab.daq_codes import Code, StatusError

ON_A_CHANNEL = ("overload", "cable_open")
ON_THE_CHASSIS = ("overrun", "device_gone")
OVERLOAD_GAIN = 1000.0


class DaqFaults:
    """The faults that are present now; safe to set from any thread while clients are served.

    - ``overload`` of a channel: its sensor gives a thousand times what it should.
    - ``cable_open`` of a channel: nothing is connected to it.
    - ``overrun``: the next read finds its samples overwritten.
    - ``device_gone``: every call that needs the chassis fails, reads that wait included.

    Attributes:
        calls: how often each gRPC method was called, for tests that count.
    """

    def __init__(self) -> None:
        self.calls: Counter[str] = Counter()
        self._lock = threading.Lock()
        self._present: set[tuple[str, str]] = set()
        self._scripted: list[tuple[str, int, int]] = []

    def set(self, name: str, channel: str = "") -> None:
        """Let fault `name` happen, on physical `channel` where it is one of a channel.

        Raises:
            ValueError: no such fault, or a channel missing or too much.
        """
        known = ON_A_CHANNEL if channel else ON_THE_CHASSIS
        if name not in known:
            raise ValueError(f"fault {name!r} with channel {channel!r}: choose one of {', '.join(known)}")
        with self._lock:
            self._present.add((name, channel))

    def clear(self) -> None:
        """Mend everything and forget scripted errors."""
        with self._lock:
            self._present.clear()
            self._scripted.clear()

    def script(self, method: str, code: int, after: int = 0) -> None:
        """Let a call of gRPC `method` ("StartTask") fail with status `code`, once `after` of them have passed.

        Several scripts for one method follow one another.
        """
        with self._lock:
            self._scripted.append((method, code, after))

    def present(self, name: str, channel: str = "") -> bool:
        """Whether fault `name` is there."""
        return (name, channel) in self._present

    def check_call(self, method: str) -> None:
        """Take part in a call of `method`.

        Raises:
            StatusError: with the status that was scripted for it.
        """
        with self._lock:
            self.calls[method] += 1
            for i, (scripted, code, after) in enumerate(self._scripted):
                if scripted == method:
                    del self._scripted[i]
                    if after == 0:
                        raise StatusError(code, "Scripted.")
                    self._scripted.insert(i, (scripted, code, after - 1))
                    return

    def check_device(self) -> None:
        """Touch the chassis.

        Raises:
            StatusError: -201003, it is gone.
        """
        if self.present("device_gone"):
            raise StatusError(Code.DEV_CANNOT_BE_ACCESSED)

    def check_overrun(self) -> None:
        """Read from the buffer; an overrun that was set happens once.

        Raises:
            StatusError: -200279, samples were lost.
        """
        if self.present("overrun"):
            with self._lock:
                self._present.discard(("overrun", ""))
            raise StatusError(Code.SAMPLES_NO_LONGER_AVAILABLE)
