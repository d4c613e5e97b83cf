"""The plan of a sweep: its points in the order of measuring, grouped by mounting and then by amplitude.

A sequential order confounds conditioning (Mullins effect, warming, drift) with what amplitude and configuration do; a
random one turns it into scatter. Mounting a specimen costs a person's time, so every mounting is made once.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import count, product
from random import Random
from typing import TypeVar

from rig.errors import RequestError
from rig.registers import Interlock
from rig.tester.detectors import TighterDetector
from rig.tester.limits import TesterLimits

_Value = TypeVar("_Value")


class Order(StrEnum):
    """The parts of a sweep that are shuffled; each includes those before it."""

    SEQUENTIAL = "sequential"
    AMPLITUDES = "amplitudes"
    MOUNTINGS = "mountings"
    ALL = "all"


@dataclass(frozen=True)
class Sine:
    """One point to measure: its number in the run from 1, its amplitude in m peak to peak, and in Hz the planned
    frequency and the one at which the actuator moves."""

    order_number: int
    amplitude_pp: float
    frequency: float
    driven_frequency: float


@dataclass(frozen=True)
class MountedSines:
    """A specimen in a configuration, and the points that are measured with it."""

    specimen: str
    configuration: str
    sines: tuple[Sine, ...]


class PlanError(RequestError):
    """The plan of a sweep asks for something impossible."""


@dataclass(frozen=True)
class SweepPlan:
    """The points of a sweep and their accuracy; the defaults are the paper's direct test, 720 points. SI units.

    Attributes:
        frequencies: Hz.
        amplitudes_pp: peak-to-peak displacements, m.
        preset: mean displacement, m.
        configurations: compression, shear, angled.
        specimens: joints whose cylinders are measured.
        tolerance: relative, of the amplitude reached.
        fine_amplitude_pp: amplitudes up to this are near the limit of the machine, m.
        fine_tolerance: relative, for those.
        fewest_cycles: in a record; with ten, 98 % of stiffnesses lay within three standard errors from their scatter.
        most_cycles: in a record, however noisy, unless `shortest_record` asks for more.
        shortest_record: s.
        mains_frequency: Hz; points at its multiples are measured beside them. None: at them, as planned.
        order: the parts that are shuffled; the others are measured in the order given above.
        seed: of the shuffling.
        first_number: order number of the first point, where a run has measured others before.
        detectors: of the tester; tighter while the sweep lasts.

    Raises:
        PlanError: there is nothing to measure, or a figure makes no sense.
    """

    frequencies: tuple[float, ...] = tuple(float(frequency) for frequency in range(5, 201, 5))
    amplitudes_pp: tuple[float, ...] = (1e-4, 5e-5, 1e-5)
    preset: float = 5e-4
    configurations: tuple[str, ...] = ("compression", "shear", "angled")
    specimens: tuple[str, ...] = ("I", "II")
    tolerance: float = 0.02
    fine_amplitude_pp: float = 1.5e-5
    fine_tolerance: float = 0.05
    fewest_cycles: int = 24
    most_cycles: int = 60
    shortest_record: float = 0.5
    mains_frequency: float | None = None
    order: Order = Order.SEQUENTIAL
    seed: int = 0
    first_number: int = 1
    detectors: Mapping[Interlock, TighterDetector] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("frequencies", "amplitudes_pp", "configurations", "specimens"):
            values = getattr(self, name)
            if not values or len(set(values)) < len(values):
                raise PlanError(f"{name} of the sweep are {values}; give at least one, and none twice")
        for name in ("tolerance", "fine_tolerance"):
            if not 0 < getattr(self, name) < 1:
                raise PlanError(f"{name} of the sweep is {getattr(self, name)}; it is relative, between 0 and 1")
        if not 2 <= self.fewest_cycles <= self.most_cycles:
            raise PlanError(f"a record of {self.fewest_cycles} to {self.most_cycles} cycles cannot be; use 2 or more")
        if not 0 <= self.shortest_record < math.inf:
            raise PlanError(f"the shortest record of the sweep is {self.shortest_record} s")

    @property
    def points(self) -> int:
        """Number of sine points."""
        return math.prod(map(len, (self.specimens, self.configurations, self.amplitudes_pp, self.frequencies)))

    def check(self, limits: TesterLimits) -> None:
        """Check that every point and detector is within `limits`, before anything moves.

        Raises LimitExceededError where one is not.
        """
        limits.check_preset(self.preset)
        for interlock, detector in self.detectors.items():
            limits.check_detector(interlock, detector.limit)
        for amplitude_pp, frequency in self.sines():
            limits.check_cycle(amplitude_pp, self.driven_frequency(frequency))

    def driven_frequency(self, frequency: float) -> float:
        """Frequency in Hz at which a point that is planned at `frequency` is measured.

        Hum cannot be told from a sine of its own frequency. A cycle apart in the shortest record they are orthogonal.
        """
        if self.mains_frequency is None:
            return frequency
        hum = self.mains_frequency * max(1, round(frequency / self.mains_frequency))
        apart = 1 / self.record_duration(hum, 0.0, self.tolerance)
        if abs(frequency - hum) > (1 - 1e-9) * apart:
            return frequency
        return hum + apart if frequency > hum else hum - apart

    def sines(self) -> Iterator[tuple[float, float]]:
        """Amplitude (m peak to peak) and frequency (Hz) of each point of a mounting, in the order given."""
        return product(self.amplitudes_pp, self.frequencies)

    def mountings(self) -> tuple[MountedSines, ...]:
        """Every specimen in every configuration, once, in the order of measuring; always the same ones.

        The seed shuffles the mountings, the amplitudes of each mounting, and the frequencies of each series.
        """
        draws, numbers = Random(self.seed), count(self.first_number)
        levels = list(Order)
        shuffled = levels[: levels.index(self.order) + 1]

        def ordered(values: Sequence[_Value], kind: Order) -> Sequence[_Value]:
            # by `random()` alone, whose numbers are the same in all versions of Python: another one may resume a run
            return sorted(values, key=lambda _: draws.random()) if kind in shuffled else values

        return tuple(
            MountedSines(
                specimen,
                configuration,
                tuple(
                    Sine(next(numbers), amplitude_pp, frequency, self.driven_frequency(frequency))
                    for amplitude_pp in ordered(self.amplitudes_pp, Order.AMPLITUDES)
                    for frequency in ordered(self.frequencies, Order.ALL)
                ),
            )
            for specimen, configuration in ordered(tuple(product(self.specimens, self.configurations)), Order.MOUNTINGS)
        )

    def tolerance_at(self, amplitude_pp: float) -> float:
        """Relative tolerance of the amplitude reached when `amplitude_pp` m is asked for."""
        return self.fine_tolerance if amplitude_pp <= self.fine_amplitude_pp else self.tolerance

    def record_duration(self, frequency: float, scatter: float, tolerance: float) -> float:
        """Length of a record in s: enough cycles of relative `scatter` to know their mean to a tenth of `tolerance`."""
        wanted = math.ceil((10 * scatter / tolerance) ** 2)
        cycles = min(max(wanted, self.fewest_cycles), self.most_cycles)
        # whole cycles, so that the mean of the record is that of its cycles
        return max(cycles, math.ceil(self.shortest_record * frequency)) / frequency
