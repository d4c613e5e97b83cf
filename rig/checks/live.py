"""Live values of a channel and the others of its module, while nothing is measured.

Each block is a task of its own: nothing runs on after the last one, and the instrument is free between two blocks.
"""

from dataclasses import dataclass

import numpy as np

from daq.block import Block
from daq.channels import Channel
from daq.instrument import OnDemand
from rig.checks.examination import RATE
from rig.instruments import Instruments

DURATION = 0.1  # s of one block
PATIENCE = 1.0  # s beyond that until a block is given up


@dataclass(frozen=True)
class LiveLevel:
    """Level of one channel during a block.

    Attributes:
        mean, lowest, highest: in the channel's unit.
        rms: of what varies about the mean, in that unit.
        volts: mean at the input, V; V/V of a bridge, C of a charge.
        dc_coupled: whether the input lets a mean voltage pass; None where the instrument does not say.
        input_low, input_high: ends of the input's range, in the channel's unit.
        overloaded: whether the input was at an end of its range.
    """

    name: str
    mean: float
    rms: float
    lowest: float
    highest: float
    volts: float
    dc_coupled: bool | None
    input_low: float
    input_high: float
    overloaded: bool


@dataclass(frozen=True)
class LiveBlock:
    """Signals of the channels of one module over `DURATION` s.

    Attributes:
        channel: that was looked at.
        sample_rate: Hz.
        samples: of that channel, in its unit.
        levels: of every channel of its module.
    """

    channel: str
    sample_rate: float
    samples: tuple[float, ...]
    levels: tuple[LiveLevel, ...]


def live_block(instruments: Instruments, name: str) -> LiveBlock:
    """Look at channel `name` now.

    Raises:
        ChannelError: the channel table or the instrument lacks it.
        DaqError: the instrument does not answer, or not in time.
    """
    (channel,) = instruments.channels_named(name)
    with instruments.daq() as chassis:
        module = chassis.device_of(channel).name
        neighbours = [each for each in instruments.channels if each.physical.partition("/")[0] == module]
        with chassis.record(neighbours, RATE, DURATION) as recorder:
            block = recorder.record(timeout=PATIENCE)
            levels = tuple(_level(block, recorder, each.name) for each in neighbours)
    return LiveBlock(name, block.sample_rate, tuple(block.value(name).tolist()), levels)


def input_range(instruments: Instruments, channel: Channel) -> tuple[float, float]:
    """Ends of the range of the input of `channel`, in its unit; it need not be in the channel table.

    Raises:
        ChannelError: the instrument lacks the input, or the input does not take what the channel asks for.
        DaqError: the instrument does not answer.
    """
    with instruments.daq() as chassis, chassis.record([channel], RATE, DURATION) as recorder:
        low, high = recorder.input_range(channel.name)
    return low / channel.sensitivity, high / channel.sensitivity


def _level(block: Block, recorder: OnDemand, name: str) -> LiveLevel:
    values, sensitivity = block.value(name), block.channels[block.row(name)].sensitivity
    low, high = recorder.input_range(name)
    return LiveLevel(
        name=name,
        mean=float(np.mean(values)),
        rms=float(np.std(values)),
        lowest=float(np.min(values)),
        highest=float(np.max(values)),
        volts=float(np.mean(block.at_input(name))),
        dc_coupled=recorder.is_dc_coupled(name),
        input_low=low / sensitivity,
        input_high=high / sensitivity,
        overloaded=name in block.overloaded,
    )
