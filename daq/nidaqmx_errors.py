"""Errors of nidaqmx and gRPC, translated into errors of acquisition with advice."""

from collections.abc import Iterator
from contextlib import contextmanager

import nidaqmx.errors
from nidaqmx.error_codes import DAQmxErrors

from daq.errors import ChannelError, DaqError, InstrumentAbsentError, OverrunError, TriggerTimeoutError

CHANNEL_ADVICE = "check the channel table against the instrument (device, channel, range, excitation)"

ADVICE: dict[int, tuple[type[DaqError], str]] = {
    DAQmxErrors.SAMPLES_NOT_YET_AVAILABLE: (TriggerTimeoutError, "nothing came in time; check the trigger, then arm"),
    DAQmxErrors.WAIT_UNTIL_DONE_DOES_NOT_INDICATE_DONE: (TriggerTimeoutError, "it did not finish in time; start again"),
    DAQmxErrors.SAMPLES_NO_LONGER_AVAILABLE: (OverrunError, "samples were lost; close other programs, repeat"),
    DAQmxErrors.ACQ_STOPPED_TO_PREVENT_INPUT_BUFFER_OVERWRITE: (OverrunError, "samples were lost; repeat"),
    DAQmxErrors.INPUT_FIFO_OVERFLOW: (OverrunError, "the instrument's own memory overflowed; lower the rate, repeat"),
    DAQmxErrors.DEV_CANNOT_BE_ACCESSED: (InstrumentAbsentError, "check power and cable, then reconnect"),
    DAQmxErrors.INVALID_DEVICE_ID: (ChannelError, CHANNEL_ADVICE),
    DAQmxErrors.PHYSICAL_CHAN_DOES_NOT_EXIST: (ChannelError, CHANNEL_ADVICE),
    DAQmxErrors.PHYS_CHAN_MEAS_TYPE: (ChannelError, CHANNEL_ADVICE),
    DAQmxErrors.CHAN_ALREADY_IN_TASK: (ChannelError, CHANNEL_ADVICE),
    DAQmxErrors.INVALID_ATTRIBUTE_VALUE: (ChannelError, "ask for a value that the instrument has; see above"),
    DAQmxErrors.PAL_RESOURCE_RESERVED: (DaqError, "another task or program holds the module; close it, or reset it"),
    DAQmxErrors.INVALID_TASK: (DaqError, "the server has forgotten the task, perhaps it was restarted; reconnect"),
}

# nidaqmx raises these for a reply that was damaged on the way: too many samples, an unknown code, invalid text
DAMAGED_REPLY = (AssertionError, ValueError, TypeError, UnboundLocalError)


@contextmanager
def translated(where: str) -> Iterator[None]:
    """Raise an error of nidaqmx inside the context as the `DaqError` that fits; its message begins with `where`."""
    try:
        yield
    except nidaqmx.errors.DaqError as error:
        kind, advice = ADVICE.get(error.error_code, (DaqError, "look the code up in NI-DAQmx, then try again"))
        text = " ".join(str(error).split())
        raise kind(f"{where}: {text} ({advice})", error.error_code) from error
    except nidaqmx.errors.RpcError as error:
        raise InstrumentAbsentError(
            f"{where}: the NI gRPC device server does not answer ({error}); check that it runs, then reconnect"
        ) from error
    except (nidaqmx.errors.DaqNotFoundError, nidaqmx.errors.DaqNotSupportedError) as error:
        raise InstrumentAbsentError(
            f"{where}: this computer has no NI-DAQmx driver; install it, or give the address of an NI gRPC device "
            "server (grpc://host:port)"
        ) from error
    except DAMAGED_REPLY as error:
        raise DaqError(f"{where}: the reply makes no sense ({error}); check the network to the instrument") from error
