"""Terms of a cylinder and of a joint from the tester's three configurations, Eqs. (8) and (13)-(15): points and laws.

A cylinder has the shear stiffness a and the compressive stiffness b. The tester measures b in compression (one
cylinder), 2a in shear and a + b angled (a pair each, at 45 degrees and its `PairLean`), all complex: three equations
for two unknowns, solved by least squares. Where they disagree by more than their errors, for example for specimens of
different hardness, the errors are widened by the misfit (the ratio of R. T. Birge, Physical Review 40, 1932, 207-227).
A law gives the terms at any amplitude and frequency.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.direct.discrepancy import interleaved
from analysis.direct.dynamic_stiffness import DynamicStiffness
from analysis.direct.elastomer_law import ElastomerLaw
from analysis.direct.law_fit import fit_elastomer_law
from analysis.direct.pair_lean import UPRIGHT, PairLean, Triple
from analysis.direct.point_covariance import joint_covariance, with_shared_error
from analysis.errors import AnalysisError
from analysis.frequency_response import Real

FREQUENCY_TOLERANCE = 0.01  # relative difference within which points have the same frequency
AMPLITUDE_TOLERANCE = 0.2  # the same of amplitude: machines reach it to 5 %, commanded ones differ by a factor of two


@dataclass(frozen=True)
class CylinderTerms:
    """Shear stiffness a and compressive stiffness b of one cylinder at one frequency and amplitude, Eq. (8).

    Attributes:
        shear: a.
        compression: b.
        covariance: (4, 4) of [Re a, Im a, Re b, Im b], in (N/m)^2, already widened by `misfit`.
        misfit: chi-square of the three measurements over its two degrees of freedom; near 1 where they agree.
    """

    shear: DynamicStiffness
    compression: DynamicStiffness
    covariance: Real
    misfit: float


@dataclass(frozen=True)
class JointTerms:
    """Translational terms of a joint's dynamic stiffness matrix at one frequency and amplitude."""

    k11: DynamicStiffness
    k22: DynamicStiffness
    k12: DynamicStiffness

    @property
    def frequency(self) -> float:
        """Frequency of the measurement, Hz."""
        return self.k11.frequency

    @property
    def amplitude_pp(self) -> float:
        """Reached peak-to-peak displacement, m."""
        return self.k11.amplitude_pp


def match_configurations(
    compression: Sequence[DynamicStiffness], shear: Sequence[DynamicStiffness], angled: Sequence[DynamicStiffness]
) -> tuple[Triple, ...]:
    """Match points to triples of the same frequency and amplitude, in the order of the angled ones.

    An angled point without a partner in compression or in shear is in none.

    Raises:
        AnalysisError: there is no triple.
    """
    triples = list[Triple]()
    for point in angled:
        one, pair = nearest_point(point, compression), nearest_point(point, shear)
        if one is not None and pair is not None:
            triples.append(Triple(one, pair, point))
    if not triples:
        raise AnalysisError(
            "no frequency and amplitude was measured in compression, shear and angled alike; "
            f"there are {len(compression)}, {len(shear)} and {len(angled)} points"
        )
    return tuple(triples)


def cylinder_terms(
    compression: Sequence[DynamicStiffness],
    shear: Sequence[DynamicStiffness],
    angled: Sequence[DynamicStiffness],
    *,
    lean: PairLean = UPRIGHT,
) -> tuple[CylinderTerms, ...]:
    """Terms a and b of a cylinder, by weighted least squares at each frequency and amplitude.

    Args:
        compression: points of one cylinder, b.
        shear: points of a pair, 2a.
        angled: points of a pair at 45 degrees, a + b where it does not lean.
        lean: of that pair.

    Raises:
        AnalysisError: no point was measured in all three configurations.
    """
    triples = match_configurations(compression, shear, angled)
    return tuple(_solve(lean.shared_by(triple), lean.excess) for triple in triples)


def joint_terms(
    cylinder: CylinderTerms, inclination: float, lean: PairLean = UPRIGHT, upper: float | None = None
) -> JointTerms:
    """Terms of a joint of two cylinders of this kind, Eq. (11); of opposed ones, Eqs. (13)-(15).

    Args:
        cylinder: its a and b.
        inclination: theta of Eq. (10) of the lower cylinder as drawn, rad. At -45 degrees, as at joint I,
            k11 = k22 = a + b and k12 = b - a > 0; at +45 degrees, as at joint II, k12 = a - b < 0.
        lean: of the joint's frame, towards y.
        upper: theta of the upper cylinder as drawn, rad; None where it is the lower one's turned by pi.
    """
    drawn = np.array([inclination, inclination if upper is None else upper])
    towards_y = -np.copysign(1.0, np.sin(2 * drawn))
    turned = drawn + towards_y * lean.angle
    cos, sin = np.cos(turned), np.sin(turned)
    along, across, mixed = float(cos @ cos), float(sin @ sin), float(sin @ cos)
    turning = float(towards_y @ (2 * sin * cos))
    shear, compression = cylinder.shear, cylinder.compression

    def term(of_shear: float, of_compression: float, by_angle: float) -> DynamicStiffness:
        project = np.kron([of_shear, of_compression], np.eye(2))
        without_lean = DynamicStiffness(
            frequency=shear.frequency,
            amplitude_pp=shear.amplitude_pp,
            complex_stiffness=of_shear * shear.complex_stiffness + of_compression * compression.complex_stiffness,
            covariance=project @ cylinder.covariance @ project.T,
            degrees_of_freedom=shear.degrees_of_freedom,
            corrections=shear.corrections,
            shared_errors={
                source: of_shear * shear.shared_errors.get(source, 0j)
                + of_compression * compression.shared_errors.get(source, 0j)
                for source in {*shear.shared_errors, *compression.shared_errors}
            },
        )
        if lean.standard_error == 0:
            return without_lean
        moved = by_angle * lean.standard_error
        by_lean = compression.complex_stiffness - shear.complex_stiffness
        return with_shared_error(without_lean, lean.source, moved * by_lean)

    return JointTerms(
        k11=term(along, across, turning),
        k22=term(across, along, -turning),
        k12=term(mixed, -mixed, -float(towards_y @ (cos**2 - sin**2))),
    )


def _solve(triple: Triple, excess: float) -> CylinderTerms:
    measured = (triple.compression, triple.shear, triple.angled)
    rows = np.kron([[0, 1], [2, 0], [1 - excess, 1 + excess]], np.eye(2))
    values = interleaved(np.array([point.complex_stiffness for point in measured]))
    weight = np.zeros((6, 6))
    for index, point in enumerate(measured):
        rounding = (1e-9 * point.magnitude) ** 2  # an exact point would weigh infinitely
        part = slice(2 * index, 2 * index + 2)
        weight[part, part] = np.linalg.inv(point.covariance + rounding * np.eye(2))
    solution = np.linalg.inv(rows.T @ weight @ rows) @ rows.T @ weight
    terms = solution @ values
    left = values - rows @ terms
    misfit = float(left @ weight @ left) / 2
    # an error that the three share, such as that of a correction, neither averages out nor adds to the misfit
    covariance = solution @ joint_covariance(measured) @ solution.T * max(1.0, misfit)
    shared = {
        source: solution
        @ interleaved(np.array([point.shared_errors.get(source, 0j) for point in measured]))
        * math.sqrt(max(1.0, misfit))
        for source in {name for point in measured for name in point.shared_errors}
    }

    def term(first: int) -> DynamicStiffness:
        return DynamicStiffness(
            frequency=triple.angled.frequency,
            amplitude_pp=triple.angled.amplitude_pp,
            complex_stiffness=complex(terms[first], terms[first + 1]),
            covariance=covariance[first : first + 2, first : first + 2],
            degrees_of_freedom=min(point.degrees_of_freedom for point in measured),
            corrections=triple.angled.corrections,
            shared_errors={source: complex(*error[first : first + 2]) for source, error in shared.items()},
        )

    return CylinderTerms(shear=term(0), compression=term(2), covariance=covariance, misfit=misfit)


def nearest_point(point: DynamicStiffness, series: Iterable[DynamicStiffness]) -> DynamicStiffness | None:
    """The point of `series` at the same frequency and amplitude, None where there is none."""
    near = [
        other
        for other in series
        if abs(other.frequency / point.frequency - 1) < FREQUENCY_TOLERANCE
        and abs(other.amplitude_pp / point.amplitude_pp - 1) < AMPLITUDE_TOLERANCE
    ]
    return min(near, key=lambda other: abs(math.log(other.amplitude_pp / point.amplitude_pp)), default=None)


@dataclass(frozen=True)
class CylinderLaw:
    """Laws of the shear stiffness a and the compressive stiffness b of one cylinder."""

    shear: ElastomerLaw
    compression: ElastomerLaw

    def at(self, amplitude_pp: float, frequency: float) -> CylinderTerms:
        """Terms a and b at `amplitude_pp` m and `frequency` Hz; their own errors are independent.

        Raises:
            AnalysisError: amplitude or frequency is not positive.
        """
        shear, compression = (law.at(amplitude_pp, frequency) for law in (self.shear, self.compression))
        return CylinderTerms(shear, compression, joint_covariance((shear, compression)), misfit=1.0)


@dataclass(frozen=True)
class JointLaw:
    """The law of a joint of two cylinders of one kind.

    Attributes:
        cylinder: laws of its a and b.
        inclination: theta of Eq. (10) of the lower cylinder as drawn, rad; signs as in `joint_terms`.
        lean: of its frame.
        upper: theta of the upper cylinder as drawn, rad; None where it is the lower one's turned by pi.
    """

    cylinder: CylinderLaw
    inclination: float
    lean: PairLean = UPRIGHT
    upper: float | None = None

    def at(self, amplitude_pp: float, frequency: float) -> JointTerms:
        """Terms k11, k22, k12 at `amplitude_pp` m and `frequency` Hz.

        Raises:
            AnalysisError: amplitude or frequency is not positive.
        """
        return joint_terms(self.cylinder.at(amplitude_pp, frequency), self.inclination, self.lean, self.upper)

    def beyond(self, amplitude_pp: float, frequency: float) -> tuple[str, ...]:
        """How amplitude and frequency lie outside the measured range, one phrase each; empty inside."""
        return self.cylinder.compression.beyond(amplitude_pp, frequency)

    @property
    def frequencies(self) -> tuple[float, float]:
        """Lowest and highest measured one, Hz."""
        return self.cylinder.compression.frequencies


def fit_cylinder_law(terms: Sequence[CylinderTerms]) -> CylinderLaw:
    """Laws of a and b of a cylinder from its terms at all frequencies and amplitudes.

    Raises:
        AnalysisError: see `fit_elastomer_law`.
    """
    return CylinderLaw(
        shear=fit_elastomer_law([each.shear for each in terms]),
        compression=fit_elastomer_law([each.compression for each in terms]),
    )
