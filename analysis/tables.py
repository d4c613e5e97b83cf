"""The paper's Tables 2 to 4 for any bench, as plain rows for a report. Table 1: `suspended.characterisation`."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import zip_longest

from analysis.frequency_response import Real
from analysis.inverse.joint_estimate import IdentifiedJoint
from analysis.structure.beam import Beam, Mesh, Theory, assemble
from analysis.structure.forward import eigensolution
from analysis.structure.joints import Joint


@dataclass(frozen=True)
class FrequencyRow:
    """A row of Table 4: one natural frequency by both theories, Hz; None where a theory has no such mode."""

    timoshenko: float | None
    euler_bernoulli: float | None


@dataclass(frozen=True)
class TermRow:
    """A row of Table 2 or 3: one element of a joint matrix with its 95 % interval, all dimensionless.

    Attributes:
        joint: name.
        element: such as "k12" or "gamma12".
        value: nan where it has no meaning.
        low, high: ends of the interval.
        observable: whether the data determine the stiffness behind it, and its own interval is not wider than its
            value.
    """

    joint: str
    element: str
    value: float
    low: float
    high: float
    observable: bool


def supported_frequencies(
    beam: Beam, mesh: Mesh, joints: Sequence[Joint], highest_frequency: float
) -> tuple[FrequencyRow, ...]:
    """Table 4: modes of the undamped beam on its joints up to `highest_frequency`, Hz, from the lowest.

    Raises:
        AnalysisError: the modes cannot be computed.
    """
    theories = [
        eigensolution(assemble(beam, mesh, theory), joints, highest_frequency).frequency.tolist() for theory in Theory
    ]
    return tuple(FrequencyRow(*frequencies) for frequencies in zip_longest(*theories))


def stiffness_terms(estimates: Iterable[IdentifiedJoint], unit: Real) -> tuple[TermRow, ...]:
    """Table 2: nine stiffnesses of every joint, divided by `unit` (3, 3) such as `Beam.stiffness_unit`."""
    return tuple(
        row for found in estimates for row in _terms(found, "k", found.stiffness / unit, found.k_ci95 / unit[..., None])
    )


def loss_factor_terms(estimates: Iterable[IdentifiedJoint]) -> tuple[TermRow, ...]:
    """Table 3: nine loss factors of every joint, nan where the stiffness cannot be distinguished from zero."""
    return tuple(
        row for found in estimates for row in _terms(found, "gamma", found.loss_factor, found.loss_factor_ci95)
    )


def _terms(joint: IdentifiedJoint, symbol: str, values: Real, intervals: Real) -> list[TermRow]:
    """Rows of one joint, from (3, 3) values and (3, 3, 2) intervals."""
    return [
        TermRow(joint.name, f"{symbol}{p + 1}{q + 1}", value, low, high, is_known)
        for p in range(3)
        for q in range(3)
        for value, (low, high) in [(float(values[p, q]), intervals[p, q].tolist())]
        for is_known in [bool(joint.observable[p, q]) and not high - low > abs(value)]
    ]
