"""The paper's Tables 1 to 4 for any bench, as plain rows for a report."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import zip_longest

from analysis.frequency_response import Real
from analysis.inverse.joint_estimate import IdentifiedJoint
from analysis.structure.beam import RIGID_MODES, Beam, Mesh, Theory, assemble
from analysis.structure.forward import eigensolution
from analysis.structure.joints import Joint


@dataclass(frozen=True)
class FrequencyRow:
    """A row of Table 1 or 4: one natural frequency in Hz, None where there is none.

    Attributes:
        mode: number r as in the paper, the rigid modes being 1 to 3.
    """

    mode: int
    experiment: float | None
    timoshenko: float | None
    euler_bernoulli: float | None


@dataclass(frozen=True)
class TermRow:
    """A row of Table 2 or 3: one element of a joint matrix with its 95 % interval, all dimensionless.

    Attributes:
        joint: name.
        element: such as "k12" or "gamma12".
        value: nan where it means nothing.
        low, high: ends of the interval.
        observable: whether the modes alone determine the stiffness behind it.
    """

    joint: str
    element: str
    value: float
    low: float
    high: float
    observable: bool


def free_frequencies(
    beam: Beam, mesh: Mesh, experiment: Sequence[float] = (), modes: int = 3
) -> tuple[FrequencyRow, ...]:
    """Table 1: elastic modes of the free beam.

    Args:
        beam: geometry and material.
        mesh: of either theory.
        experiment: measured frequencies, Hz, from the first elastic mode on.
        modes: how many elastic modes.
    """
    elastic = slice(RIGID_MODES, RIGID_MODES + modes)
    theories = [assemble(beam, mesh, theory).frequency[elastic].tolist() for theory in Theory]
    return _rows(RIGID_MODES + 1, experiment, *theories)


def supported_frequencies(
    beam: Beam,
    mesh: Mesh,
    joints: Sequence[Joint],
    highest_frequency: float,
    experiment: Sequence[float] = (),
    damping_ratios: Sequence[float] = (),
) -> tuple[FrequencyRow, ...]:
    """Table 4: modes of the supported beam, both theories on the same joints.

    Args:
        beam: geometry and material.
        mesh: of either theory.
        joints: as identified.
        highest_frequency: of the theory's modes, Hz.
        experiment: measured frequencies, Hz, from the lowest.
        damping_ratios: of the free beam.

    Raises:
        AnalysisError: the modes cannot be computed.
    """
    theories = [
        eigensolution(assemble(beam, mesh, theory, damping_ratios), joints, highest_frequency).frequency.tolist()
        for theory in Theory
    ]
    return _rows(1, experiment, *theories)


def stiffness_terms(estimates: Iterable[IdentifiedJoint], unit: Real) -> tuple[TermRow, ...]:
    """Table 2: stiffness of every joint, nine elements each.

    Args:
        estimates: of the joints.
        unit: (3, 3) what terms are divided by, such as `Beam.stiffness_unit`.
    """
    return tuple(
        TermRow(
            joint=found.name,
            element=f"k{p + 1}{q + 1}",
            value=float(found.stiffness[p, q] / unit[p, q]),
            low=float(found.k_ci95[p, q, 0] / unit[p, q]),
            high=float(found.k_ci95[p, q, 1] / unit[p, q]),
            observable=bool(found.observable[p, q]),
        )
        for found in estimates
        for p in range(3)
        for q in range(3)
    )


def loss_factor_terms(estimates: Iterable[IdentifiedJoint]) -> tuple[TermRow, ...]:
    """Table 3: loss factors of every joint, nan where the stiffness cannot be told from zero.

    Args:
        estimates: of the joints.
    """
    return tuple(
        TermRow(
            joint=found.name,
            element=f"gamma{p + 1}{q + 1}",
            value=float(found.loss_factor[p, q]),
            low=float(found.loss_factor_ci95[p, q, 0]),
            high=float(found.loss_factor_ci95[p, q, 1]),
            observable=bool(found.observable[p, q]),
        )
        for found in estimates
        for p in range(3)
        for q in range(3)
    )


def _rows(
    first: int, experiment: Sequence[float], timoshenko: Sequence[float], euler_bernoulli: Sequence[float]
) -> tuple[FrequencyRow, ...]:
    return tuple(
        FrequencyRow(first + place, *frequencies)
        for place, frequencies in enumerate(zip_longest(experiment, timoshenko, euler_bernoulli))
    )
