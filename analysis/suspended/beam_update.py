"""Material and dimensions of a beam from its free frequencies, within the tolerances stated for them.

The most probable parameters (maximum a posteriori) minimise

    chi^2 = (ln f - ln f(p))^t S^-1 (ln f - ln f(p)) + sum (ln p / p_0)^2 / tolerance^2,

S being the covariance of the measured ln f and of the model's own error. Priors are Gaussian in the logarithm, which
keeps parameters positive and equals a Gaussian in p for tolerances of a few per cent. With correct p_0 and S, the least
chi^2 is distributed as chi-square with one degree of freedom for each datum.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.linalg import block_diag
from scipy.special import chdtrc

from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.interval import Estimate
from analysis.structure import element
from analysis.structure.beam import DIRECTIONS, Beam, Mesh, Theory, assemble
from analysis.suspended.free_modes import ElasticModes

PARAMETERS = ("youngs_modulus", "density", "length", "height", "width")
"""Fields of `Beam`, in the order of all arrays over parameters."""
STIFFNESS_POWERS = {"youngs_modulus": 1.0, "height": 3.0, "width": 1.0, "length": -3.0}
"""Exponents of the parameters in the bending stiffness E h^3 w / L^3."""
MASS_POWERS = {"density": 1.0, "height": 1.0, "width": 1.0, "length": 1.0}
"""Exponents of the parameters in the mass rho L h w."""
ITERATIONS = 30
CONVERGED = 1e-6  # gain in chi-square: every parameter is within a thousandth of its standard deviation
DISAGREE = 0.01  # p-value of chi-square


def free_frequencies(
    beam: Beam,
    mesh: Mesh,
    places: Sequence[int],
    theory: Theory = Theory.TIMOSHENKO,
    point_masses: Mapping[int, float] | None = None,
) -> tuple[Real, Real]:
    """Frequencies of some free modes and d ln f / d ln p by every parameter p; nodes move with the length.

    d w^2 = psi^T (dK - w^2 dM) psi for a mass-normalised shape. K is proportional to E, M without the point masses to
    the density, both to the width. The slope by the height comes from the element matrices. The slope by the length
    follows from dimensions: w^2 rho L^2 / E depends on h / L, w / L and m / (rho L^3) only.

    Args:
        beam: material and dimensions.
        mesh: nodes, from 0 to the length.
        places: (modes,) indices of the modes among those of the free beam, the rigid ones being 0 to 2.
        theory: of the beam.
        point_masses: masses in kg by node; they do not change with the parameters.

    Returns:
        (modes,) frequencies in Hz and (modes, 5) slopes in the order of `PARAMETERS`.

    Raises:
        AnalysisError: the mesh does not span the beam, or a mass is impossible.
    """
    free_beam = assemble(beam, mesh, theory, point_masses=point_masses)
    squared, shapes = free_beam.squared_frequency[list(places)], free_beam.shapes[:, list(places)]
    lumped = np.zeros(squared.size)  # share of the kinetic energy that is in the point masses
    for node, kilograms in (point_masses or {}).items():
        lumped += kilograms * np.sum(shapes[mesh.node_degrees(node)[:2]] ** 2, axis=0)
    by_height = _by_height(beam, mesh, theory, squared, shapes)
    half = np.full(squared.size, 0.5)
    slopes = np.stack([half, -(1 - lumped) / 2, -1 - by_height + lumped, by_height, lumped / 2], axis=1)
    return np.sqrt(squared) / (2 * np.pi), slopes


def _by_height(beam: Beam, mesh: Mesh, theory: Theory, squared: Real, shapes: Real) -> Real:
    """(modes,) d ln f / d ln h for the height in the plane of bending; A ~ h, I ~ h^3 and phi ~ h^2."""
    rigidity, mass_per_length = beam.flexural_rigidity, beam.density * beam.area
    energy = np.zeros(squared.size)
    for number, (start, end) in enumerate(pairwise(mesh.positions)):
        length, first = float(end - start), len(DIRECTIONS) * number
        along = shapes[[first + place for place in element.ROD]]
        energy += _doubled(element.rod_stiffness(beam.youngs_modulus * beam.area, length), along)
        energy -= squared * _doubled(element.rod_mass(mass_per_length, length), along)

        across = shapes[[first + place for place in element.BENDING]]
        phi = beam.shear_flexibility(length) if theory is Theory.TIMOSHENKO else 0.0
        stiffness, stiffness_slope = _in_phi(element.bending_stiffness, rigidity, length, phi)
        mass, mass_slope = _in_phi(element.translational_mass, mass_per_length, length, phi)
        energy += _doubled(3 * stiffness + 2 * phi * stiffness_slope, across)
        energy -= squared * _doubled(mass + 2 * phi * mass_slope, across)
        if theory is Theory.TIMOSHENKO:
            rotary, rotary_slope = _in_phi(element.rotary_mass, beam.density * beam.second_moment, length, phi)
            energy -= squared * _doubled(3 * rotary + 2 * phi * rotary_slope, across)
    return np.asarray(energy / (2 * squared))


def _doubled(matrix: Real, shapes: Real) -> Real:
    """(modes,) twice the energy of (n, n) `matrix` in each of (n, modes) shapes."""
    return np.asarray(np.einsum("im,ij,jm->m", shapes, matrix, shapes))


def _in_phi(
    matrix: Callable[[float, float, float], Real], factor: float, length: float, phi: float
) -> tuple[Real, Real]:
    """An element matrix and its derivative by phi.

    (1 + phi)^2 times the matrix is a quadratic in phi, for which this difference formula is exact at any step.
    """
    here, once, twice = ((1 + p) ** 2 * matrix(factor, length, p) for p in (phi, phi + 1, phi + 2))
    slope = (4 * once - 3 * here - twice) / 2
    whole = here / (1 + phi) ** 2
    return whole, np.asarray(slope / (1 + phi) ** 2 - 2 * whole / (1 + phi))


@dataclass(frozen=True)
class BeamTolerances:
    """Standard deviations of the stated material and dimensions; zero means that the statement is exact.

    Attributes:
        youngs_modulus: relative.
        density: relative.
        length: m; of a steel tape.
        height: in the plane of bending, m; of callipers.
        width: m; of callipers.
        frequency: error of the model, relative, independent for each mode; with four elements between eleven nodes
            the third elastic mode is 0.8e-4 too high, with eight 0.2e-4.

    Raises:
        AnalysisError: one is negative or not finite.
    """

    youngs_modulus: float = 0.005
    density: float = 0.003
    length: float = 5e-4
    height: float = 5e-5
    width: float = 5e-5
    frequency: float = 1e-4

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not (np.isfinite(value) and value >= 0):
                raise AnalysisError(f"the beam's tolerance {name} is {value}; it must be zero or a positive number")

    def relative(self, beam: Beam) -> Real:
        """(5,) as a share of each parameter, in the order of `PARAMETERS`."""
        sizes = np.array([beam.length, beam.height, beam.width])
        lengths = np.array([self.length, self.height, self.width])
        return np.concatenate([[self.youngs_modulus, self.density], lengths / sizes])


@dataclass(frozen=True, eq=False)
class BeamUpdate:
    """The most probable beam.

    Attributes:
        drawn, beam: the beam before and after the update.
        mesh: of the beam after the update; its nodes move with the length.
        tolerances: of the statement.
        covariance: (5, 5) of ln p after the update, in the order of `PARAMETERS`.
        slopes: (modes, 5) d ln f / d ln p.
        numbers: (modes,) r of the modes, as in the paper.
        frequency: (modes,) of the beam after the update, Hz.
        misfit: (modes,) ln of measured over updated frequency.
        deviation: (modes,) standard deviation expected of `misfit`: measurement and model.
        chi_square: at the optimum.
        degrees_of_freedom: of chi-square.
        weighed: whether the data include the mass of the beam.
    """

    drawn: Beam
    beam: Beam
    mesh: Mesh
    tolerances: BeamTolerances
    covariance: Real
    slopes: Real
    numbers: tuple[int, ...]
    frequency: Real
    misfit: Real
    deviation: Real
    chi_square: float
    degrees_of_freedom: int
    weighed: bool

    @property
    def p_value(self) -> float:
        """Probability of so large a chi-square if tolerances and errors are correct."""
        return float(chdtrc(self.degrees_of_freedom, self.chi_square))

    @property
    def consistent(self) -> bool:
        """Whether data and tolerances agree; if not, no interval of this update is reliable."""
        return self.p_value >= DISAGREE

    @property
    def prior_deviation(self) -> Real:
        """(5,) standard deviation of ln p before the update."""
        return self.tolerances.relative(self.drawn)

    @property
    def deviations_used(self) -> Real:
        """(5,) change of each parameter, in tolerances; zero where the tolerance is zero."""
        prior = self.prior_deviation
        moved = np.array([np.log(getattr(self.beam, name) / getattr(self.drawn, name)) for name in PARAMETERS])
        return np.asarray(moved / np.where(prior > 0, prior, np.inf))

    def parameter(self, name: str) -> Estimate:
        """A parameter of the beam after the update, in the unit of `Beam`."""
        return self.combination({name: 1.0})

    def combination(self, exponents: Mapping[str, float]) -> Estimate:
        """A product of powers of the parameters, such as {"youngs_modulus": 1, "density": -1} for E / rho."""
        powers = _powers(exponents)
        value = float(
            np.prod(
                [getattr(self.beam, name) ** power for name, power in zip(PARAMETERS, powers.tolist(), strict=True)]
            )
        )
        return Estimate(value, value * float(np.sqrt(powers @ self.covariance @ powers)))

    def correlation(self, first: str, second: str) -> float:
        """Between two parameters after the update; zero where one of the tolerances is zero."""
        places = [PARAMETERS.index(first), PARAMETERS.index(second)]
        block = self.covariance[np.ix_(places, places)]
        size = float(np.sqrt(block[0, 0] * block[1, 1]))
        return float(block[0, 1]) / size if size > 0 else 0.0


def update_beam(
    measured: ElasticModes,
    drawn: Beam,
    mesh: Mesh,
    tolerances: BeamTolerances,
    *,
    point_masses: Mapping[int, float] | None = None,
    weighed: Estimate | None = None,
) -> BeamUpdate:
    """The most probable beam for measured free frequencies, by Gauss-Newton steps with exact derivatives.

    Args:
        measured: elastic modes of the free beam.
        drawn: the beam as stated.
        tolerances: of the statement.
        point_masses: masses mounted on the beam, kg by node.
        weighed: mass of the bare beam in kg, from a balance; only it separates the density from Young's modulus.

    Raises:
        AnalysisError: all tolerances are zero, the model and the data are both exact, or the search does not settle.
    """
    prior = tolerances.relative(drawn)
    free = np.flatnonzero(prior)
    if free.size == 0:
        raise AnalysisError("every tolerance of the beam is zero, so there is nothing to update")
    data, covariance = _data(measured, tolerances.frequency, weighed)
    try:
        root = np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError as error:
        raise AnalysisError("these frequencies have no valid covariance; state a tolerance of frequency") from error

    places = [number - 1 for number in measured.numbers]
    steps = np.zeros(free.size)  # in tolerances
    for _ in range(ITERATIONS):
        change = np.zeros(prior.size)
        change[free] = prior[free] * steps
        scale = zip(PARAMETERS, np.exp(change).tolist(), strict=True)
        beam = replace(drawn, **{name: getattr(drawn, name) * factor for name, factor in scale})
        moved = replace(mesh, positions=mesh.positions * (beam.length / mesh.positions[-1]))
        frequency, slopes = free_frequencies(beam, moved, places, point_masses=point_masses)
        expected = np.log(frequency)
        if weighed is not None:
            expected = np.append(expected, np.log(beam.density * beam.area * beam.length))
            slopes = np.vstack([slopes, _powers(MASS_POWERS)])
        columns = np.vstack([np.linalg.solve(root, slopes[:, free] * prior[free]), np.eye(free.size)])
        left = np.concatenate([np.linalg.solve(root, data - expected), -steps])
        step = np.linalg.lstsq(columns, left, rcond=None)[0]
        gain = float(np.sum((columns @ step) ** 2))
        if gain < CONVERGED:
            break
        steps = steps + step
    else:
        raise AnalysisError(
            f"the search for the beam would still gain {gain:.1g} in chi-square after {ITERATIONS} steps; "
            "state narrower tolerances, or an error of the frequencies"
        )
    after = np.zeros((prior.size, prior.size))
    inverse = np.linalg.pinv(columns) * prior[free, None]
    after[np.ix_(free, free)] = inverse @ inverse.T
    modes = slice(len(measured.numbers))
    return BeamUpdate(
        drawn=drawn,
        beam=beam,
        mesh=moved,
        tolerances=tolerances,
        covariance=after,
        slopes=slopes[modes],
        numbers=measured.numbers,
        frequency=np.exp(expected[modes]),
        misfit=(data - expected)[modes],
        deviation=np.sqrt(np.diag(covariance))[modes],
        chi_square=float(left @ left),
        degrees_of_freedom=data.size,
        weighed=weighed is not None,
    )


def _data(measured: ElasticModes, model_error: float, weighed: Estimate | None) -> tuple[Real, Real]:
    """(data,) ln f of every mode and, if weighed, ln m of the beam; their covariance with the model's error."""
    data = np.log(measured.frequency)
    covariance = measured.frequency_covariance / np.outer(measured.frequency, measured.frequency)
    covariance = covariance + model_error**2 * np.eye(data.size)
    if weighed is None:
        return data, covariance
    return np.append(data, np.log(weighed.value)), block_diag(covariance, (weighed.standard_error / weighed.value) ** 2)


@dataclass(frozen=True)
class Material:
    """Young's modulus and density that give a beam of the drawn dimensions the updated one's bending and weight.

    A beam bends by E h^3 w / L^3 and weighs rho L h w. Its free frequencies determine the ratio of the two, and a
    balance the second, far better than E, rho and the dimensions are known one by one. So the errors of the dimensions
    go into E and rho, which are then correlated.

    Attributes:
        youngs_modulus: Pa.
        density: kg/m^3.
        correlation: between the two.
    """

    youngs_modulus: Estimate
    density: Estimate
    correlation: float

    def of(self, drawn: Beam) -> Beam:
        """The drawn beam of this material."""
        return replace(drawn, youngs_modulus=self.youngs_modulus.value, density=self.density.value)


def material_of(update: BeamUpdate) -> Material:
    """The material of an updated beam for the dimensions of the drawing."""
    powers = np.array([_powers(STIFFNESS_POWERS), _powers(MASS_POWERS)])
    covariance = powers @ update.covariance @ powers.T
    deviation = np.sqrt(np.diag(covariance))
    modulus = update.drawn.youngs_modulus * _growth(update, STIFFNESS_POWERS)
    density = update.drawn.density * _growth(update, MASS_POWERS)
    size = float(np.prod(deviation))
    return Material(
        Estimate(modulus, modulus * float(deviation[0])),
        Estimate(density, density * float(deviation[1])),
        float(covariance[0, 1]) / size if size > 0 else 0.0,
    )


def _growth(update: BeamUpdate, powers: Mapping[str, float]) -> float:
    """A product of powers of the beam's parameters after the update, over the same product before."""
    return float(
        np.prod([(getattr(update.beam, name) / getattr(update.drawn, name)) ** power for name, power in powers.items()])
    )


def _powers(exponents: Mapping[str, float]) -> Real:
    """(5,) exponents in the order of `PARAMETERS`."""
    return np.array([exponents.get(name, 0.0) for name in PARAMETERS])
