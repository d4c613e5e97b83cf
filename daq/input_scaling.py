"""Range and scaling of inputs in V, V/V or C, from what NI-DAQmx says of them.

NI-DAQmx gives the scaling of counts "to volts". For a bridge it does not say whether these volts are divided by the
supply already. The ranges of a module are stated in V/V and in C, so the scaling is taken in the unit in which the full
scale of the converter fits the range.
"""

import nidaqmx
from nidaqmx.task.channels import AIChannel

from daq.channels import Channel
from daq.errors import ChannelError, DaqError

SCALE_WITHIN = 0.3
"""Largest relative difference of the converter's full scale from the end of the range, in the right unit. In the wrong
unit they differ by the supply of the bridge, a factor of 2.5 (V) or more."""


def range_of(task: nidaqmx.Task, channel: Channel, found: AIChannel) -> tuple[float, float]:
    """Ends of the range of the input of `channel`, `found` in `task`, in V, V/V or C, for a positive quantity.

    Raises ChannelError where the module has no range that holds what the channel asks for.
    """
    unit = channel.kind.input_unit
    if unit == "V":
        return _turned(channel, float(found.ai_rng_low), float(found.ai_rng_high))
    name = channel.physical.partition("/")[0]
    module = next(each for each in task.devices if each.name == name)
    ends = module.ai_bridge_rngs if unit == "V/V" else module.ai_charge_rngs
    asked = channel.sensitivity * max(abs(channel.minimum), abs(channel.maximum))
    pairs = [(float(low), float(high)) for low, high in zip(ends[::2], ends[1::2], strict=True)]
    holding = [pair for pair in pairs if min(-pair[0], pair[1]) >= asked * (1 - 1e-6)]
    if not holding:
        raise ChannelError(f"channel {channel.name!r} asks for {asked:g} {unit}; {name} has {pairs}: correct its range")
    return _turned(channel, *min(holding, key=lambda pair: pair[1]))


def scaling_of(channel: Channel, found: AIChannel, largest: float) -> tuple[float, ...]:
    """Polynomial from counts to V, V/V or C of `channel`, ascending, for a positive quantity.

    Args:
        channel: as the channel table has it.
        found: the same channel as the task has it.
        largest: upper end of its range, V, V/V or C.

    Raises:
        DaqError: the full scale fits the range neither as it is nor divided by the supply of the bridge.
    """
    unit = channel.kind.input_unit
    coefficients = tuple(channel.polarity * float(each) for each in found.ai_dev_scaling_coeff)
    if unit == "V":
        return coefficients
    end = abs(coefficients[1]) * 2.0 ** (float(found.ai_resolution) - 1)
    for divisor in (1.0, channel.bridge.excitation if channel.bridge else 1.0):
        if abs(end / divisor / largest - 1) <= SCALE_WITHIN:
            return tuple(each / divisor for each in coefficients)
    raise DaqError(
        f"channel {channel.name!r}: {channel.physical} ends at {end:g} by the scaling of its counts and at {largest:g} "
        f"{unit} by its range, so that the unit of its counts is not known; measure with a conditioner, as a voltage"
    )


def _turned(channel: Channel, low: float, high: float) -> tuple[float, float]:
    return (low, high) if channel.polarity > 0 else (-high, -low)
