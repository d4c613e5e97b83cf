"""Values from a network connection: settings are read back, and values are read until two readings agree.

An NI gRPC device server sends no checksum of its own, so a bit that changes on the way would be taken for a value.
"""

from collections.abc import Callable, Sequence
from typing import TypeVar

import nidaqmx
import numpy as np
from nidaqmx.constants import BridgeConfiguration

from daq.channels import Bridge, Channel
from daq.errors import DaqError

READINGS = 4  # at most

_Value = TypeVar("_Value")


def agreed(what: str, read: Callable[[], _Value]) -> _Value:
    """The value that `read` gives twice in succession; DaqError, which names `what`, if no two readings agree."""
    last = read()
    for _ in range(READINGS - 1):
        before, last = last, read()
        if bool(np.all(before == last)):  # numbers, tuples and arrays alike
            return last
    raise DaqError(f"{what}: {READINGS} readings, and no two in succession agree; check the network to the instrument")


def bridge_configuration(bridge: Bridge) -> BridgeConfiguration:
    """The configuration of a bridge as NI-DAQmx names it."""
    return BridgeConfiguration[f"{bridge.configuration}_bridge".upper()]


def check_channels(task: nidaqmx.Task, channels: Sequence[Channel]) -> None:
    """Read back inputs, excitation and bridges of the channels of `task`; DaqError if they differ."""
    for channel in channels:
        found = task.ai_channels[channel.name]
        _compare(f"input of channel {channel.name!r}", found.physical_channel.name, channel.physical)
        if channel.excitation_current:
            _compare(f"excitation current of {channel.name!r}", found.ai_excit_val, channel.excitation_current)
        if channel.bridge is not None:
            _compare(f"excitation of the bridge of {channel.name!r}", found.ai_excit_val, channel.bridge.excitation)
            _compare(f"bridge of {channel.name!r}", found.ai_bridge_cfg, bridge_configuration(channel.bridge))


def check_trigger(task: nidaqmx.Task, source: str, level: float, pre_trigger: int) -> None:
    """Read back the analog edge trigger of `task`; DaqError if it differs."""
    trigger = task.triggers.reference_trigger
    _compare("source of the trigger", trigger.anlg_edge_src, source)
    _compare("level of the trigger", trigger.anlg_edge_lvl, level)
    _compare("samples before the trigger", trigger.pretrig_samples, pre_trigger)


def check_samples(task: nidaqmx.Task, samples: int) -> None:
    """Read back the length of the record of `task`; DaqError if it is not `samples`."""
    _compare("samples of a record", task.timing.samp_quant_samp_per_chan, samples)


def _compare(what: str, found: object, asked: object) -> None:
    same = np.isclose(found, asked) if isinstance(found, float) and isinstance(asked, float) else found == asked
    if not same:
        raise DaqError(f"{what}: {asked} was asked for, the instrument has {found}; check the network to it, try again")
