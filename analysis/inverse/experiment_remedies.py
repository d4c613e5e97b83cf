"""Remedies for the weakest direction of an experiment: priors, accelerometers, a wider band."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.dof import Direction, Dof
from analysis.frequency_response import Real
from analysis.inverse.cylinder_parameters import CylinderPair, CylinderParameters
from analysis.inverse.experiment_information import (
    ExpectedAccuracy,
    LinearPrior,
    PlannedExperiment,
    PlannedSet,
    expected,
)
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.joint_parameters import HALF
from analysis.inverse.observability import term_units
from analysis.inverse.tolerances import Tolerances
from analysis.inverse.undetermined_terms import LEADING, term_names, units_of
from analysis.structure.joints import Joint

MOST_LINES = 300
"""Lines kept of a measured experiment: with the noise in proportion, fewer lines hold the same information."""
EQUALITY = 0.03
"""Relative standard deviation of the prior k11 = k22. Half a degree on a 45-degree joint whose cylinders are seven
times stiffer along than across makes 1.3 %. A joint drawn further off than that has no such prior."""
WIDER = 3.0
"""Factor of the wider band."""


@dataclass(frozen=True)
class EqualTerms:
    """The prior k11 = k22 within `EQUALITY`, in joints whose cylinders are drawn so; `joints` is empty for all."""

    joints: tuple[str, ...] = ()


@dataclass(frozen=True)
class CylindersAsParameters:
    """The cylinders as parameters, in place of all terms of the joints."""


@dataclass(frozen=True)
class SecondAccelerometer:
    """A second accelerometer at a point."""

    at: Dof


@dataclass(frozen=True)
class WiderBand:
    """Lines up to `highest`, Hz, at the same noise."""

    highest: float


RemedyChange = EqualTerms | CylindersAsParameters | SecondAccelerometer | WiderBand
"""What a remedy changes in an experiment."""


@dataclass(frozen=True)
class Remedy:
    """A change of an experiment that may improve its weakest direction.

    Attributes:
        change: of the experiment.
        before, after: standard deviation of the weakest direction of the experiment as it is, in the `stiffness_unit`
            of its terms.
        units: names of that unit, one for each kind of term in the direction.
    """

    change: RemedyChange
    before: float
    after: float
    units: tuple[str, ...]


def remedies(experiment: PlannedExperiment, pairs: Sequence[CylinderPair] = ()) -> tuple[Remedy, ...]:
    """Priors, accelerometers and a wider band that improve the weakest direction, the best first.

    Args:
        experiment: with all terms as parameters.
        pairs: construction of the joints; without them the cylinders are not tried, and k11 = k22 is for every joint.
    """
    before = expected(experiment)
    unit = term_units(experiment.free_beam, len(experiment.joints))
    direction = _weakest(before, unit)
    first = experiment.sets[0]
    ends = [Dof(node, Direction.X) for node in (1, len(experiment.free_beam.mesh.named))]
    step = float(first.frequency[1] - first.frequency[0])
    trials = list[tuple[RemedyChange, PlannedExperiment]]()
    drawn = _drawn_equal(pairs) if pairs else {joint.name for joint in experiment.joints}
    if equal := [joint for joint in experiment.joints if joint.name in drawn]:
        some = tuple(joint.name for joint in equal) if len(equal) < len(experiment.joints) else ()
        trials.append((EqualTerms(some), _with_equality(experiment, equal)))
    if pairs:
        cylinders = CylinderParameters(tuple(pairs), experiment.tolerances.inclination)
        trials.append((CylindersAsParameters(), replace(experiment, parameters=cylinders)))
    for end in ends:
        another = replace(first, response=end)
        trials.append((SecondAccelerometer(end), replace(experiment, sets=(*experiment.sets, another))))
    if np.ndim(first.noise) == 0:
        lines = np.arange(first.frequency[0], WIDER * first.frequency[-1], step)
        sets = tuple(replace(each, frequency=lines) for each in experiment.sets)
        trials.append((WiderBand(float(lines[-1])), replace(experiment, sets=sets)))

    start = _along(before, direction, unit)
    names = np.array(term_names([joint.name for joint in experiment.joints]))
    leading = names[np.abs(direction) > LEADING].tolist()
    units = tuple(units_of(leading))
    found = [Remedy(change, start, _along(expected(trial), direction, unit), units) for change, trial in trials]
    return tuple(sorted(found, key=lambda remedy: remedy.after))


def experiment_of_fit(fit: JointFit, tolerances: Tolerances) -> PlannedExperiment:
    """The experiment behind a fit, with its noise and these `tolerances`, at the identified joints."""
    model = fit.likelihood.model
    every = -(-model.frequency.size // MOST_LINES)
    noise = np.sqrt(fit.noise_scale / every) * fit.likelihood.deviation[:, ::every]
    made = PlannedSet(model.response, model.inputs, model.frequency[::every], noise, model.decay)
    return PlannedExperiment(model.free_beam, tuple(found.joint for found in fit.joints.values()), (made,), tolerances)


def _drawn_equal(pairs: Sequence[CylinderPair]) -> set[str]:
    """Names of joints whose k11 and k22 are equal by the drawing, such as those of cylinders at 45 degrees.

    By Eq. (11) the two differ by (a - b) times the sum of cos 2 theta over the cylinders.
    """
    return {pair.name for pair in pairs if abs(np.sum(np.cos(2 * np.array(pair.inclinations)))) <= EQUALITY}


def _with_equality(experiment: PlannedExperiment, joints: Sequence[Joint]) -> PlannedExperiment:
    priors = []
    for joint in joints:
        z = joint.dynamic_stiffness[1, 1]
        for letter, size in (("k", abs(z.real)), ("h", abs(z.imag))):
            weights = {f"{letter}11({joint.name})": 1.0, f"{letter}22({joint.name})": -1.0}
            priors.append(LinearPrior(weights, EQUALITY * max(size, 1e-3 * abs(z))))
    return replace(experiment, priors=(*experiment.priors, *priors))


def _weakest(expectation: ExpectedAccuracy, unit: Real) -> Real:
    """(12 joints,) least known combination of stiffnesses, its largest weight 1, in units of `stiffness_unit`."""
    stiffness = (np.arange(unit.size) // HALF) % 2 == 0
    scaled = expectation.terms_covariance / np.outer(unit, unit) * np.outer(stiffness, stiffness)
    _, vectors = np.linalg.eigh(scaled)
    weakest = vectors[:, -1]
    return np.asarray(weakest / weakest[np.argmax(np.abs(weakest))])


def _along(expectation: ExpectedAccuracy, direction: Real, unit: Real) -> float:
    weights = direction / unit
    return float(np.sqrt(weights @ expectation.terms_covariance @ weights))
