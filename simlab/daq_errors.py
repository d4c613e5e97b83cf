"""Errors of the simulated acquisition: NI-DAQmx status codes with their meaning, and faults that tests set by name."""

import threading
from collections import Counter
from enum import IntEnum
from typing import Self


class Code(IntEnum):
    """Status codes by NI's names."""

    meaning: str

    def __new__(cls, number: int, meaning: str = "") -> Self:
        """A status code that says `meaning`, a sentence."""
        code = int.__new__(cls, number)
        code._value_ = number
        code.meaning = meaning
        return code

    SAMPLES_NO_LONGER_AVAILABLE = -200279, "Samples were overwritten before they were read."
    SAMPLES_NOT_YET_AVAILABLE = -200284, "The samples asked for were not acquired within the timeout."
    SAMPLES_WILL_NEVER_BE_AVAILABLE = -200278, "The task is finite and has given all its samples."
    WAIT_UNTIL_DONE_DOES_NOT_INDICATE_DONE = -200560, "The task did not finish within the timeout."
    INVALID_DEVICE_ID = -200220, "No device of that name."
    PHYSICAL_CHAN_DOES_NOT_EXIST = -200170, "The device has no such physical channel."
    PHYS_CHAN_MEAS_TYPE = -200431, "The physical channel cannot make that kind of measurement."
    CHAN_ALREADY_IN_TASK = -200489, "The channel is already in the task."
    MIN_NOT_LESS_THAN_MAX = -200082, "The minimum is not below the maximum."
    INVALID_ATTRIBUTE_VALUE = -200077, "The value is not one that the property can take."
    ATTR_NOT_SUPPORTED = -200197, "The property is not supported here."
    INVALID_TASK = -200088, "No such task."
    READ_BUFFER_TOO_SMALL = -200229, "The array is too small for the samples asked for."
    INVALID_ANALOG_TRIG_SRC = -200265, "The trigger source cannot be triggered on."
    CAN_NOT_PERFORM_OP_WHEN_NO_CHANS_IN_TASK = -200478, "The task has no channels."
    CAN_NOT_PERFORM_OP_WHILE_TASK_RUNNING = -200479, "That cannot be done while the task runs."
    DUPLICATE_TASK = -200089, "A task of that name exists."
    LINEAR_REQUIRES_UNIQUE_POINTS = -201334, "Two points of a line have the same value."
    TEDS_SENSOR_NOT_DETECTED = -200709, "No sensor with TEDS answers."
    TEDS_NOT_SUPPORTED = -200741, "The device reads no TEDS."
    LAB_VIEW_INVALID_TASK_OR_CHANS = -200428, "The task has no such channel."
    PAL_RESOURCE_RESERVED = -50103, "The module is reserved by another task."
    DEV_CANNOT_BE_ACCESSED = -201003, "The device is not there any more, or cannot be reached."


def meaning(code: int) -> str:
    """What status `code` says, in a sentence."""
    return Code(code).meaning if code in set(Code) else "NI-DAQmx error."


class StatusError(Exception):
    """A call ends with status `code`; `details` say where."""

    def __init__(self, code: int, details: str = "") -> None:
        self.code = int(code)
        super().__init__(" ".join(part for part in (meaning(code), details, f"Status code: {self.code}.") if part))


ON_A_CHANNEL = (
    "overload", "cable_open", "inverted", "weak", "hum", "noisy", "dead", "saturated", "offset", "exchanged",
)  # fmt: skip
ON_THE_CHASSIS = ("overrun", "device_gone")
OVERLOAD_GAIN = 1000.0


class DaqFaults:
    """The faults that are present now; safe to set from any thread while clients are served.

    - ``overload`` of a channel: its sensor gives a thousand times what it should.
    - ``cable_open`` of a channel: nothing is connected to it.
    - ``inverted``, ``weak``, ``dead`` of a channel: its sensor is turned round, gives a tenth, or nothing.
    - ``hum``, ``noisy`` of a channel: 50 Hz from the mains, or noise, far above the noise of a sensor.
    - ``saturated``, ``offset`` of a channel: its conditioner stands at the end of its range, or a tenth of it off zero.
    - ``exchanged`` of a channel: another sensor of the kind is connected, as its TEDS says.
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
        """Repair everything and forget scripted errors."""
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
