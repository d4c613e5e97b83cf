"""Measured curves, with the conditions under which each value was taken."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real

Conditions = Mapping[str, Real]
"""Conditions by name, (n,) each, SI units: `frequency` Hz, `amplitude` m, `force` N, `time` s, `temperature` degC, or
any other that an effect asks for."""
LEAST_VALUES = 2
"""Least number of real values from which a measurement tells anything about a cause."""


@dataclass(frozen=True, eq=False)
class Curve:
    """One measured curve, or a list of values such as natural frequencies.

    Its arrays are read-only copies: a simulator or an effect that writes in place fails, and measured data stay as they
    were.

    Attributes:
        observable: what the simulator predicts, such as "displacement" or "stiffness".
        part: level, temperature, station or realisation that it belongs to. A part is left out as a whole.
        values: (n,) real or complex.
        deviation: (n,) standard deviation per real and imaginary part; infinite for a value that does not count.
        conditions: (n,) each.
    """

    observable: str
    part: str
    values: Complex | Real
    deviation: Real
    conditions: Conditions

    def __post_init__(self) -> None:
        shapes = {name: np.shape(each) for name, each in self.conditions.items()} | {
            "deviation": np.shape(self.deviation)
        }
        for name, shape in shapes.items():
            if shape != np.shape(self.values):
                raise AnalysisError(f"{self.name}: {name} has shape {shape}, the values have {np.shape(self.values)}")
        for name, each in {"the values": self.values, **self.conditions}.items():
            if not np.all(np.isfinite(each)):
                raise AnalysisError(f"{self.name}: {name} are not all finite numbers; leave out what was not measured")
        if not np.all(np.asarray(self.deviation) > 0):
            raise AnalysisError(
                f"{self.name}: a deviation is not above zero; give the standard deviation of each value"
            )
        conditions = MappingProxyType({name: _read_only(each) for name, each in self.conditions.items()})
        own = {"values": _read_only(self.values), "deviation": _read_only(self.deviation), "conditions": conditions}
        for name, each in own.items():
            object.__setattr__(self, name, each)

    def __reduce__(self) -> tuple[Any, ...]:
        """For other processes; a read-only view of a dict cannot be pickled."""
        return Curve, (self.observable, self.part, self.values, self.deviation, dict(self.conditions))

    @property
    def name(self) -> str:
        """Name of the curve, for messages."""
        return f"{self.observable} of part {self.part!r}"

    @property
    def is_complex(self) -> bool:
        """Whether its values have an imaginary part."""
        return bool(np.iscomplexobj(self.values))

    @property
    def counted(self) -> NDArray[np.bool_]:
        """(n,) whether a value counts."""
        return np.asarray(np.isfinite(self.deviation))

    @property
    def data(self) -> int:
        """Number of real values that count."""
        return int(np.count_nonzero(self.counted)) * (2 if self.is_complex else 1)


def _read_only(values: Complex | Real) -> Any:
    found = np.array(values)
    found.setflags(write=False)
    return found


def parts_of(curves: Sequence[Curve]) -> tuple[str, ...]:
    """Names of the parts, in their order."""
    return tuple(dict.fromkeys(each.part for each in curves))


def checked(curves: Sequence[Curve]) -> tuple[Curve, ...]:
    """Curves that a diagnosis can begin with.

    Raises:
        AnalysisError: fewer than `LEAST_VALUES` real values count, or none as all deviations are infinite.
    """
    count = sum(each.data for each in curves)
    if curves and not count:
        raise AnalysisError("no value counts: all deviations are infinite; give the standard deviation of each value")
    if count < LEAST_VALUES:
        raise AnalysisError(f"{count} values were measured; a diagnosis needs {LEAST_VALUES} at least")
    return tuple(curves)
