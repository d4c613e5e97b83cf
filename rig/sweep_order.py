"""In which order a sweep measures: mountings as blocks, in each of them series of one amplitude, in each series sines.

A sequential order confounds conditioning (Mullins effect, warming, drift) with what amplitude and configuration do; a
random one turns it into scatter. Mounting a specimen costs a person's time, so every mounting is made once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import count, product
from random import Random
from typing import TypeVar

_Value = TypeVar("_Value")


class Order(StrEnum):
    """What of a sweep is shuffled; each includes those before it."""

    SEQUENTIAL = "sequential"
    AMPLITUDES = "amplitudes"
    MOUNTINGS = "mountings"
    ALL = "all"


@dataclass(frozen=True)
class Sine:
    """One point to measure: its number in the run from 1, amplitude in m peak to peak, frequency in Hz."""

    order_number: int
    amplitude_pp: float
    frequency: float


@dataclass(frozen=True)
class Mounting:
    """A specimen in a configuration, and what is measured before hands go in again."""

    specimen: str
    configuration: str
    sines: tuple[Sine, ...]


def in_order(
    specimens: Sequence[str],
    configurations: Sequence[str],
    amplitudes_pp: Sequence[float],
    frequencies: Sequence[float],
    order: Order = Order.SEQUENTIAL,
    seed: int = 0,
    first_number: int = 1,
) -> tuple[Mounting, ...]:
    """Every specimen in every configuration at every amplitude (m peak to peak) and frequency (Hz), each once.

    Points are numbered from `first_number`. `seed` draws what `order` shuffles: the mountings, the amplitudes of each
    mounting, the frequencies of each series.
    """
    draws, numbers = Random(seed), count(first_number)
    levels = list(Order)
    shuffled = levels[: levels.index(order) + 1]

    def ordered(values: Sequence[_Value], kind: Order) -> Sequence[_Value]:
        # by `random()` alone, whose numbers Python promises to keep: a run may be resumed by another version
        return sorted(values, key=lambda _: draws.random()) if kind in shuffled else values

    return tuple(
        Mounting(
            specimen,
            configuration,
            tuple(
                Sine(next(numbers), amplitude_pp, frequency)
                for amplitude_pp in ordered(amplitudes_pp, Order.AMPLITUDES)
                for frequency in ordered(frequencies, Order.ALL)
            ),
        )
        for specimen, configuration in ordered(tuple(product(specimens, configurations)), Order.MOUNTINGS)
    )
