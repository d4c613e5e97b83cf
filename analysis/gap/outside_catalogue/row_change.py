"""Joints or readings that change from row to row or from set to set, as no effect of the catalogue does.

A joint creeps while the points are struck, a screw loosens, an amplifier drifts as it warms up.

They are rivals of the catalogue, as changes at one place of the beam are. An effect of amplitude has joints that differ
from row to row, too, but follows the blows, and the tester's displacement.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from analysis.dof import Dof
from analysis.frequency_response import Real
from analysis.gap.bench import BeamBench, Setting
from analysis.gap.effect import Effect, Given, Mechanism
from analysis.gap.measurement import Measurement
from analysis.gap.outside_catalogue.local_change import LOCAL_CHANGE
from analysis.gap.parameter import Parameter

OF_A_ROW, OF_A_SET = 0.1, 0.05
"""Standard deviations of the change of stiffness, relative."""
OF_A_READING = 0.03
"""Standard deviation of the change of a reading, relative: a gain is off by no more."""
OF_A_PHASE = 0.05
"""Standard deviation of the phase of a set's readings, rad."""


@dataclass(frozen=True)
class ShareOfEachPoint(Effect):
    """A quantity is larger or smaller by a share for each struck point, in every set or in one.

    Attributes:
        points: that were struck.
        sets: indices of those that are concerned.
    """

    id = LOCAL_CHANGE
    largest: ClassVar[float]
    """Standard deviation of a share."""
    points: tuple[Dof, ...] = ()
    sets: tuple[int, ...] = ()

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        """One variant for all sets, and one for each of several; no variant where a single point was struck."""
        count = len(measurement.sets)
        points = tuple(dict.fromkeys(dof for each in measurement.sets for dof in each.inputs))
        chosen = [tuple(range(count)), *([(number,) for number in range(count)] if count > 1 else [])]
        return tuple(cls(points, sets) for sets in chosen) if len(points) > 1 else ()

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(Parameter(f"at_{point}", "1", 0.0, self.largest) for point in self.points)

    def shares(self, given: Given, setting: Setting) -> Real:
        """(rows,) share by which each row is larger."""
        shares = np.array([given[f"at_{point}"] for point in setting.inputs])
        return np.asarray(shares * np.isin(setting.set_of_row, self.sets))


class ChangeByRow(ShareOfEachPoint):
    """All joints are stiffer or softer."""

    title = "joints that differ from row to row"
    mechanism = Mechanism.JOINT_STATE
    law = "joints that differ from row to row"
    by_row = True
    largest = OF_A_ROW

    def setups(self, given: Given, setups: Real, setting: Setting) -> Real:
        return np.asarray(setups * (1 + setting.by_state(self.shares(given, setting)))[:, None])


class ReadingByRow(ShareOfEachPoint):
    """The measuring chain reads more or less."""

    title = "readings that differ from row to row"
    mechanism = Mechanism.MEASURING_CHAIN
    law = "readings that differ from row to row"
    largest = OF_A_READING

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        return replace(bench, chain=bench.chain * (1 + self.shares(given, setting))[:, None])


@dataclass(frozen=True)
class ChangeBySet(Effect):
    """Each joint is stiffer or softer by its own share in each set after the first.

    Attributes:
        names: of the joints.
        sets: how many there are.
    """

    id = LOCAL_CHANGE
    title = "joints that differ from set to set"
    mechanism = Mechanism.JOINT_STATE
    law = "joints that differ from set to set"
    names: tuple[str, ...] = ()
    sets: int = 1

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        """One variant; none where there is only one set."""
        names = tuple(joint.name for joint in measurement.drawing.joints)
        return (cls(names, len(measurement.sets)),) if len(measurement.sets) > 1 else ()

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return tuple(
            Parameter(self._name(joint, number), "1", 0.0, OF_A_SET)
            for number in range(1, self.sets)
            for joint in self.names
        )

    @staticmethod
    def _name(joint: str, number: int) -> str:
        return f"{joint}_in_set_{number + 1}"

    def setups(self, given: Given, setups: Real, setting: Setting) -> Real:
        shares = np.array(
            [[given.get(self._name(joint, number), 0.0) for joint in self.names] for number in range(self.sets)]
        )
        return np.asarray(setups * (1 + setting.by_state(shares[setting.set_of_row])))


@dataclass(frozen=True)
class ReadingBySet(Effect):
    """The measuring chain of each set has a phase of its own, and each set after the first another gain, too.

    Attributes:
        sets: how many there are.
    """

    id = LOCAL_CHANGE
    title = "readings that differ from set to set"
    mechanism = Mechanism.MEASURING_CHAIN
    law = "readings that differ from set to set"
    sets: int = 1

    @classmethod
    def variants(cls, measurement: Measurement) -> tuple[Self, ...]:
        """One variant; none where no beam was struck."""
        return (cls(len(measurement.sets)),) if measurement.sets else ()

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        phases = [Parameter(f"phase_of_set_{number + 1}", "rad", 0.0, OF_A_PHASE) for number in range(self.sets)]
        gains = [Parameter(f"gain_of_set_{number + 1}", "1", 0.0, OF_A_READING) for number in range(1, self.sets)]
        return (*phases, *gains)

    def beam(self, given: Given, bench: BeamBench, setting: Setting) -> BeamBench:
        of_sets = [
            (1 + given.get(f"gain_of_set_{number + 1}", 0.0)) * np.exp(1j * given[f"phase_of_set_{number + 1}"])
            for number in range(self.sets)
        ]
        return replace(bench, chain=bench.chain * np.array(of_sets)[setting.set_of_row][:, None])


KINDS: Sequence[type[ShareOfEachPoint] | type[ChangeBySet] | type[ReadingBySet]] = (
    ChangeByRow,
    ReadingByRow,
    ChangeBySet,
    ReadingBySet,
)


def changes_of_rows(measurement: Measurement) -> tuple[Effect, ...]:
    """Every kind; none where no beam was struck."""
    return tuple(each for kind in KINDS for each in kind.variants(measurement))
