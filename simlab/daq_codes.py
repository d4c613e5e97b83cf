"""NI-DAQmx status codes that the simulated server gives, with their meaning."""

from __future__ import annotations

from enum import IntEnum


class Code(IntEnum):
    """Status codes by NI's names."""

    SAMPLES_NO_LONGER_AVAILABLE = -200279
    SAMPLES_NOT_YET_AVAILABLE = -200284
    SAMPLES_WILL_NEVER_BE_AVAILABLE = -200278
    WAIT_UNTIL_DONE_DOES_NOT_INDICATE_DONE = -200560
    INVALID_DEVICE_ID = -200220
    PHYSICAL_CHAN_DOES_NOT_EXIST = -200170
    PHYS_CHAN_MEAS_TYPE = -200431
    CHAN_ALREADY_IN_TASK = -200489
    MIN_NOT_LESS_THAN_MAX = -200082
    INVALID_ATTRIBUTE_VALUE = -200077
    ATTR_NOT_SUPPORTED = -200197
    INVALID_TASK = -200088
    READ_BUFFER_TOO_SMALL = -200229
    INVALID_ANALOG_TRIG_SRC = -200265
    CAN_NOT_PERFORM_OP_WHEN_NO_CHANS_IN_TASK = -200478
    CAN_NOT_PERFORM_OP_WHILE_TASK_RUNNING = -200479
    DUPLICATE_TASK = -200089
    LAB_VIEW_INVALID_TASK_OR_CHANS = -200428
    PAL_RESOURCE_RESERVED = -50103
    DEV_CANNOT_BE_ACCESSED = -201003


MEANING: dict[int, str] = {
    Code.SAMPLES_NO_LONGER_AVAILABLE: "Samples were overwritten before they were read.",
    Code.SAMPLES_NOT_YET_AVAILABLE: "The samples asked for were not acquired within the timeout.",
    Code.SAMPLES_WILL_NEVER_BE_AVAILABLE: "The task is finite and has given all its samples.",
    Code.WAIT_UNTIL_DONE_DOES_NOT_INDICATE_DONE: "The task did not finish within the timeout.",
    Code.INVALID_DEVICE_ID: "No device of that name.",
    Code.PHYSICAL_CHAN_DOES_NOT_EXIST: "The device has no such physical channel.",
    Code.PHYS_CHAN_MEAS_TYPE: "The physical channel cannot make that kind of measurement.",
    Code.CHAN_ALREADY_IN_TASK: "The channel is already in the task.",
    Code.MIN_NOT_LESS_THAN_MAX: "The minimum is not below the maximum.",
    Code.INVALID_ATTRIBUTE_VALUE: "The value is not one that the property can take.",
    Code.ATTR_NOT_SUPPORTED: "The property is not supported here.",
    Code.INVALID_TASK: "No such task.",
    Code.READ_BUFFER_TOO_SMALL: "The array is too small for the samples asked for.",
    Code.INVALID_ANALOG_TRIG_SRC: "The trigger source cannot be triggered on.",
    Code.CAN_NOT_PERFORM_OP_WHEN_NO_CHANS_IN_TASK: "The task has no channels.",
    Code.CAN_NOT_PERFORM_OP_WHILE_TASK_RUNNING: "That cannot be done while the task runs.",
    Code.DUPLICATE_TASK: "A task of that name exists.",
    Code.LAB_VIEW_INVALID_TASK_OR_CHANS: "The task has no such channel.",
    Code.PAL_RESOURCE_RESERVED: "The module is reserved by another task.",
    Code.DEV_CANNOT_BE_ACCESSED: "The device is not there any more, or cannot be reached.",
}


def meaning(code: int) -> str:
    """What status `code` says, in a sentence."""
    return MEANING.get(code, "NI-DAQmx error.")


class StatusError(Exception):
    """A call ends with status `code`; `details` say where."""

    def __init__(self, code: int, details: str = "") -> None:
        self.code = int(code)
        super().__init__(" ".join(part for part in (meaning(code), details, f"Status code: {self.code}.") if part))
