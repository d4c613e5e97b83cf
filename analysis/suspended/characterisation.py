"""The test of the suspended beam, Section 7: Table 1 with intervals, damping, material and dimensions of the beam.

The identification of joints uses the beam's `damping_ratios`, which make the proportional C, and its `material`.
`free_beam` is the updated beam itself.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls
from scipy.special import chdtrc

from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.interval import Estimate
from analysis.modes import Modes
from analysis.structure.beam import Beam, FreeBeam, Mesh, Theory, assemble
from analysis.structure.setup import RIGID_MODES
from analysis.suspended.beam_identifiability import statements
from analysis.suspended.beam_update import BeamTolerances, BeamUpdate, Material, material_of, update_beam
from analysis.suspended.free_modes import SOFT, BeamSuspension, ElasticModes, elastic_modes

REJECTED = 0.01  # p-value of chi-square below which Rayleigh damping is rejected
FEWEST_ROWS = 3  # of Table 1


@dataclass(frozen=True, eq=False)
class RayleighDamping:
    """C = alpha M + beta K fitted to measured damping ratios: zeta_r = alpha / (2 w_r) + beta w_r / 2.

    Attributes:
        mass_factor: alpha, 1/s, not negative.
        stiffness_factor: beta, s, not negative; both standard errors ignore this bound.
        damping_ratio: (modes,) as fitted.
        worst_share: largest difference from a measured damping ratio, relative to the ratio or, if larger, its error.
        chi_square: weighted sum of squares left.
        degrees_of_freedom: of chi-square; zero for two modes, which alpha and beta always fit.
    """

    mass_factor: Estimate
    stiffness_factor: Estimate
    damping_ratio: Real
    worst_share: float
    chi_square: float
    degrees_of_freedom: int

    @property
    def describes(self) -> bool | None:
        """Whether the residual is within the errors (chi-square with a p-value of 0.01 or more); None if untested."""
        if self.degrees_of_freedom == 0:
            return None
        return bool(chdtrc(self.degrees_of_freedom, self.chi_square) >= REJECTED)

    @property
    def text(self) -> str:
        """The assessment in one sentence."""
        law = f"C = alpha M + beta K with alpha = {self.mass_factor.value:.3g} 1/s, beta = "
        law += f"{self.stiffness_factor.value:.3g} s"
        if self.describes is None:
            return f"{law} fits any two modes; a third mode would test whether damping is of that kind"
        left = f"chi-square {self.chi_square:.3g} on {self.degrees_of_freedom}"
        if self.describes:
            return f"{law} describes the damping of the free beam: {left}"
        return (
            f"{law} does not describe the damping of the free beam: {left}, up to {self.worst_share:.0%} off; "
            "use the damping ratios mode by mode"
        )


def rayleigh_damping(angular_frequency: Real, damping_ratio: Real, covariance: Real) -> RayleighDamping:
    """Fit alpha and beta to damping ratios by weighted least squares.

    Args:
        angular_frequency: (modes,) w_r, rad/s.
        damping_ratio: (modes,) zeta_r.
        covariance: (modes, modes) of the damping ratios.

    Raises:
        AnalysisError: fewer than two modes.
    """
    if damping_ratio.size < 2:
        raise AnalysisError("one mode does not tell damping by mass from damping by stiffness; measure two or more")
    root = np.linalg.cholesky(covariance)
    law = np.stack([1 / (2 * angular_frequency), angular_frequency / 2], axis=1)
    columns, measured = np.linalg.solve(root, law), np.linalg.solve(root, damping_ratio)
    size = np.linalg.norm(columns, axis=0)
    factors, left = nnls(columns / size, measured)
    factors = factors / size
    errors = np.sqrt(np.diag(np.linalg.inv((columns / size).T @ (columns / size)))) / size
    fitted = law @ factors
    scale = np.maximum(np.abs(damping_ratio), np.sqrt(np.diag(covariance)))
    return RayleighDamping(
        mass_factor=Estimate(float(factors[0]), float(errors[0])),
        stiffness_factor=Estimate(float(factors[1]), float(errors[1])),
        damping_ratio=fitted,
        worst_share=float(np.max(np.abs(fitted - damping_ratio) / scale)),
        chi_square=float(left**2),
        degrees_of_freedom=damping_ratio.size - 2,
    )


@dataclass(frozen=True)
class FreeModeRow:
    """A row of Table 1: measured frequency and damping beside both theories, in Hz.

    Attributes:
        mode: number r as in the paper, the rigid modes being 1 to 3.
        experiment: frequency of the free beam, Hz, or None where the mode was not measured.
        damping_ratio: of the free beam, or None.
        timoshenko, euler_bernoulli: of the beam as drawn, Hz.
        updated: of the beam after the update, Timoshenko, Hz.
    """

    mode: int
    experiment: Estimate | None
    damping_ratio: Estimate | None
    timoshenko: float
    euler_bernoulli: float
    updated: float


@dataclass(frozen=True, eq=False)
class FreeBeamResult:
    """Result of a test of the suspended beam.

    Attributes:
        elastic: the elastic modes that were found.
        table: Table 1.
        damping_ratios: of the elastic modes from the lowest up, for `assemble`; zero where not measured.
        update: the updated beam.
        material: Young's modulus and density for the drawn dimensions; None where frequencies and tolerances disagree,
            so that the update is not reliable.
        free_beam: the updated beam with its damping and the masses mounted on it.
        statements: what is not determined or doubtful, one sentence each.
    """

    elastic: ElasticModes
    table: tuple[FreeModeRow, ...]
    damping_ratios: tuple[float, ...]
    update: BeamUpdate
    material: Material | None
    free_beam: FreeBeam
    statements: tuple[str, ...]


def characterise_free_beam(
    modes: Modes,
    beam: Beam,
    mesh: Mesh,
    tolerances: BeamTolerances | None = None,
    *,
    suspension: BeamSuspension | None = None,
    point_masses: Mapping[int, float] | None = None,
    weighed: Estimate | None = None,
) -> FreeBeamResult:
    """Compare the measured modes of a suspended beam with theory, and update the beam.

    Args:
        modes: measured, with the covariance of their poles.
        beam: as drawn.
        mesh: with the measured nodes.
        tolerances: of the drawing; those of `BeamTolerances` by default.
        suspension: its effect is subtracted from frequencies and damping; None where unknown.
        point_masses: masses mounted on the beam, such as the accelerometer, kg by node.
        weighed: mass of the bare beam, kg, where it was weighed.

    Raises:
        AnalysisError: no elastic mode is found, the modes have no covariance, or the beam cannot be updated.
    """
    drawn = {theory: assemble(beam, mesh, theory, point_masses=point_masses) for theory in Theory}
    elastic = elastic_modes(modes, drawn[Theory.TIMOSHENKO], suspension=suspension)
    update = update_beam(
        elastic, beam, mesh, tolerances or BeamTolerances(), point_masses=point_masses, weighed=weighed
    )
    measured = [elastic.damping_estimate(RIGID_MODES + 1 + place) for place in range(elastic.numbers[-1] - RIGID_MODES)]
    ratios = tuple(max(0.0, found.value) if found is not None else 0.0 for found in measured)
    updated = assemble(update.beam, update.mesh, damping_ratios=ratios, point_masses=point_masses)
    rayleigh = None
    if len(elastic.numbers) > 1:
        rayleigh = rayleigh_damping(elastic.angular_frequency, elastic.damping_ratio, elastic.damping_covariance)
    last = max(RIGID_MODES + FEWEST_ROWS, elastic.numbers[-1])
    return FreeBeamResult(
        elastic=elastic,
        table=tuple(
            FreeModeRow(
                mode=number,
                experiment=elastic.frequency_estimate(number),
                damping_ratio=elastic.damping_estimate(number),
                timoshenko=float(drawn[Theory.TIMOSHENKO].frequency[number - 1]),
                euler_bernoulli=float(drawn[Theory.EULER_BERNOULLI].frequency[number - 1]),
                updated=float(updated.frequency[number - 1]),
            )
            for number in range(RIGID_MODES + 1, last + 1)
        ),
        damping_ratios=ratios,
        update=update,
        material=material_of(update) if update.consistent else None,
        free_beam=updated,
        statements=(
            *_suspension_statements(elastic, suspension, float(drawn[Theory.TIMOSHENKO].frequency[RIGID_MODES])),
            *_mode_statements(elastic),
            *([rayleigh.text] if rayleigh is not None else []),
            *statements(update),
        ),
    )


def _suspension_statements(elastic: ElasticModes, suspension: BeamSuspension | None, first_elastic: float) -> list[str]:
    first = float(elastic.frequency[0])
    if suspension is None:
        if not elastic.suspension_modes:
            return ["the suspension is not known: what it adds to frequencies and damping was not taken out"]
        highest = max(elastic.suspension_modes)
        return [
            f"a rigid mode at {highest:.3g} Hz was measured: a suspension of that frequency raises mode "
            f"{elastic.numbers[0]} by up to {2 * (highest / first) ** 2:.2g} (relative), which was not taken out; "
            "state the frequency of its bounce and where it holds the beam"
        ]
    share = suspension.frequency / first_elastic  # of the drawing: the lowest mode that was found may be another one
    found = [
        f"the suspension at {suspension.frequency:g} Hz raised mode {elastic.numbers[0]} by "
        f"{elastic.suspension_shift[0]:.2g} Hz, which was taken out"
    ]
    if share > SOFT:
        found.append(
            f"the suspension bounces at {share:.0%} of the first elastic mode; use springs that bounce below {SOFT:.0%}"
        )
    return found


def _mode_statements(elastic: ElasticModes) -> list[str]:
    found = []
    if elastic.others:
        listed = ", ".join(f"{frequency:.1f}" for frequency in elastic.others)
        found.append(f"{listed} Hz: no elastic mode of this beam in its plane of bending; not used")
    missing = sorted(set(range(RIGID_MODES + 1, elastic.numbers[-1])) - set(elastic.numbers))
    if missing:
        found.append(f"mode {', '.join(map(str, missing))} was not measured; its damping is taken to be zero")
    errors = np.sqrt(np.diag(elastic.damping_covariance))
    for number, ratio, error in zip(elastic.numbers, elastic.damping_ratio, errors, strict=True):
        if ratio < 2 * error:
            found.append(f"the damping ratio of mode {number}, {ratio:.2g} +- {error:.1g}, may be zero")
    return found
