"""The gap between a model and data that its fit did not use.

One row of each hammer set at a time is left out of the fit, at another point in every set, and predicted as if its
blows had fallen where those of the other sets fell; each eighth of the tester's points likewise. Where the model
holds, leaving out is a step of the linearised fit: the normal equations of the row are subtracted. Where it does not
hold, that step would be far wrong, and the remaining rows are fitted again.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.fitting.fit import Fit, fit
from analysis.gap.fitting.likelihood import BLOW_AT_POINT, BLOW_OF_ROW, Likelihood
from analysis.gap.fitting.normal_equations import as_parts
from analysis.gap.fitting.stages import FINAL
from analysis.gap.measurement import HammerSet
from analysis.gap.simulation.blow_motion import POINT_SCATTER, ROW_SCATTER
from analysis.inverse.levenberg_marquardt import inverse

APART = 3
"""Rows by which the row that is left out differs from one set to the next."""
FOLDS = 8
"""Parts into which the tester's points are divided."""
RESAMPLED = 400
"""Draws with replacement for the interval of a gap."""
LEVEL = 90.0
"""Per cent of the draws that the interval contains."""
BY_CHANCE = 2.0
"""Standard errors up to which a sum over held-out parts is chance."""
LARGEST_OFFSET = 2.0
"""Standard deviations up to which a residual counts as an offset or a lean of the blows; more is the model's error."""
NO_BLOW: Complex = np.zeros((2, 1), dtype=complex)
"""Derivatives in offset and lean of what no blow made."""
MODEL_HOLDS_BELOW = 1.5
"""Chi-square per datum up to which a row is left out by a step of the linearised fit."""
REFIT_GAIN, REFIT_STEPS = 3.0, 4


@dataclass(frozen=True)
class Gap:
    """The gap between simulation and measurement on data that the fit did not use.

    Attributes:
        percent: 100 sqrt(sum |y - f|^2 / sum |y|^2).
        sigma: rms of the residual over noise, per real and imaginary part.
        model_percent: the part of `percent` that is due to the model, not to noise or offsets of blows.
        remaining_percent: the part of that which a better model could explain: smooth errors of accelerances, as the
            scales of the fit have them, are taken off, too.
        parts: (parts, 2) of each part that was held out, the squares of `percent` and of `remaining_percent`.
    """

    percent: float
    sigma: float
    model_percent: float
    remaining_percent: float
    parts: Real = field(default_factory=lambda: np.zeros((0, 2)), compare=False, repr=False)

    @property
    def stands_out(self) -> bool:
        """Whether the part of it that a better model could explain is more than chance."""
        return self.remaining_percent > 0.0 and _beyond_chance(self.parts[:, 1])

    def is_above(self, other: "Gap") -> bool:
        """Whether it is larger than that of another model on the same parts by more than chance."""
        return self.percent > other.percent and _beyond_chance(self.parts[:, 0] - other.parts[:, 0])


def _beyond_chance(parts: Real) -> bool:
    """Whether a sum differs from zero by more than its parts scatter; true for a single part."""
    if len(parts) < 2:
        return True
    return abs(float(np.sum(parts))) > BY_CHANCE * float(np.sqrt(len(parts)) * np.std(parts, ddof=1))


@dataclass(frozen=True)
class HeldOut:
    """Gaps of one model on held-out data; None for a rig that was not used.

    Attributes:
        inverse, direct: of each rig.
        ci90_percent: interval of `overall`'s percentage, by resampling what was held out.
    """

    inverse: Gap | None
    direct: Gap | None
    ci90_percent: tuple[float, float]

    @property
    def overall(self) -> Gap:
        """The gap of the beam rig, or of the tester where the beam was not struck."""
        found = self.inverse or self.direct
        assert found is not None
        return found


def held_out(found: Fit) -> HeldOut:
    """Gaps of a fitted model on rows and points that are left out in turn."""
    rows, points = _rows(found), _points(found)
    inverse_gap = _gap(rows) if rows else None
    direct_gap = _gap(points) if points else None
    return HeldOut(inverse_gap, direct_gap, _interval(rows or points))


Fold = dict[int, int]
"""The row of each hammer set that is left out."""
LeftOut = dict[int, tuple[Complex, Complex]]
"""By set: (lines,) predicted accelerance of the row that is left out, and (2, lines) its derivatives in offset and lean
of the blows."""


def _rows(found: Fit) -> list[Real]:
    """Every row of every set, left out once."""
    sets = found.likelihood.measurement.sets
    only = sum(len(each.inputs) for each in sets) == 1  # no row would remain for another fit
    predicted_without = _by_a_step(found) if only or found.per_datum < MODEL_HOLDS_BELOW else _refitted_without
    error, sums = found.likelihood.scales.model_error, list[Real]()
    for fold in _folds(sets):
        for number, (accelerance, by_blow) in predicted_without(found, fold).items():
            each, row = sets[number], fold[number]
            smooth = 2 * (error * np.abs(each.from_neighbours[row])) ** 2  # of real and imaginary part
            sums.append(_sums(each.accelerance[row], accelerance, each.deviation[row], smooth, by_blow))
    return sums


def _folds(sets: Sequence[HammerSet]) -> list[Fold]:
    """Each fold leaves another point out of every set, so that other sets keep it; of one point, it leaves a set."""
    most = max((len(each.inputs) for each in sets), default=0)
    if most == 1:
        return [{number: 0} for number in range(len(sets))]
    folds = [
        {
            number: (turn + APART * number) % most
            for number, each in enumerate(sets)
            if (turn + APART * number) % most < len(each.inputs)
        }
        for turn in range(most)
    ]
    return [fold for fold in folds if fold]


def _by_a_step(found: Fit) -> Callable[[Fit, Fold], LeftOut]:
    """A function of the fit and a fold that predicts each set's row without it, by a linear step."""
    likelihood = found.likelihood
    tolerances = likelihood.measurement.tolerances
    predicted, shared = likelihood.predict(found.scores), len(likelihood.simulation.shared)

    def without(found: Fit, fold: Fold) -> LeftOut:
        left_out = [each for each in found.blocks if each.row >= 0 and fold.get(each.set_number) == each.row]
        normal, descent = found.at.normal.copy(), found.at.descent.copy()
        for block in found.left_out(list(fold.items())):
            normal[np.ix_(block.unknowns, block.unknowns)] -= block.normal
            descent[block.unknowns] -= block.descent
        step = inverse(normal) @ descent
        result: LeftOut = {}
        for block in left_out:
            accelerance = predicted.accelerances[block.set_number][block.row]
            by_blow = predicted.by_blow[block.set_number][:, block.row]
            by_shared = predicted.by_shared[block.set_number][:, block.row]
            gain, *joints = likelihood.setups[block.set_number]
            change = np.tensordot(step[:shared], by_shared, axes=1) + step[gain] * tolerances.sensor_gain * accelerance
            change = change + np.tensordot(step[joints], predicted.by_setup[block.set_number][:, block.row], axes=1)
            own = block.unknowns[len(likelihood.simulation.under_beam) + 1 + len(joints) :]
            by_amplitude = predicted.by_amplitude[block.set_number][:, block.row]
            of_row = [*(BLOW_AT_POINT * by_blow), *(BLOW_OF_ROW * by_blow)]
            of_row += [*(POINT_SCATTER * by_amplitude), *(ROW_SCATTER * by_amplitude)]
            change = change + sum(step[place] * slope for place, slope in zip(own, of_row, strict=True))
            result[block.set_number] = accelerance + change, by_blow
        return result

    return without


def _refitted_without(found: Fit, fold: Fold) -> LeftOut:
    """Each set's row, predicted by a fit to all the others."""
    likelihood = found.likelihood
    simulation, measurement = likelihood.simulation, likelihood.measurement
    keep = [np.arange(len(each.inputs)) != fold.get(number, -1) for number, each in enumerate(measurement.sets)]
    left = [number for number, rows in enumerate(keep) if np.any(rows)]
    rest = replace(measurement, sets=tuple(measurement.sets[number].rows(keep[number]) for number in left))
    known = [*range(len(simulation.shared)), *(place for number in left for place in likelihood.setups[number])]
    first, end, other = likelihood.first_blow[1], likelihood.first_blow[-1], Likelihood(simulation.of(rest))
    points = np.transpose([likelihood.blow_at_point(point) for point in other.struck]).ravel()  # offsets and leans
    errors = [place for point in other.points for place in likelihood.amplitudes_of_point(point)]
    of_rows = [likelihood.amplitudes_of_row(n, row) for n in left for row in np.flatnonzero(keep[n]).tolist()]
    start_of_errors = found.scores[[*errors, *(place for each in of_rows for place in each)]]
    both = np.concatenate([np.tile(rows, 2) for rows in keep])  # offsets and leans
    start = np.concatenate([found.scores[[*known, *points]], found.scores[first:end][both], start_of_errors])
    again = fit(simulation.of(rest), start, (FINAL,), REFIT_GAIN, REFIT_STEPS)
    scores = np.zeros(likelihood.unknowns)
    scores[[*known, *points]] = again.scores[: len(known) + points.size]
    scores[errors] = again.scores[other.first_blow[-1] :][: len(errors)]
    predicted = likelihood.predict(scores, (0,))
    return {
        number: (predicted.accelerances[number][row], predicted.by_blow[number][:, row]) for number, row in fold.items()
    }


def _points(found: Fit) -> list[Real]:
    """Sums over each eighth of the tester's points: every eighth point in the order of measuring."""
    likelihood = found.likelihood
    points = likelihood.measurement.points
    if points is None:
        return []
    predicted, shared = likelihood.predict(found.scores), len(likelihood.simulation.shared)
    columns = predicted.stiffness_by_shared / points.deviation
    left = (points.stiffness - predicted.stiffness) / points.deviation
    sums, rank = [], np.argsort(np.argsort(points.order))
    for fold in range(FOLDS):
        out = rank % FOLDS == fold
        if not np.any(out):
            continue
        normal, descent = found.at.normal.copy(), found.at.descent.copy()
        normal[:shared, :shared] -= np.real(columns[:, out].conj() @ columns[:, out].T)
        descent[:shared] -= np.real(columns[:, out].conj() @ left[out])
        step = (inverse(normal) @ descent)[:shared]
        stiffness = predicted.stiffness[out] + step @ predicted.stiffness_by_shared[:, out]
        sums.append(_sums(points.stiffness[out], stiffness, points.deviation[out], np.zeros(1)))
    return sums


def _sums(measured: Complex, predicted: Complex, deviation: Real, smooth: Real, by_blow: Complex = NO_BLOW) -> Real:
    """(6,) over one held-out part: squares of residual, its part due to the model, the same without smooth errors (of
    mean square `smooth`), measured and whitened; and data."""
    left = measured - predicted
    slopes = as_parts(np.broadcast_to(by_blow, (2, left.size)) / deviation)
    precision = slopes @ slopes.T + np.eye(len(slopes))  # of the row, and of the tolerances
    blow = np.linalg.solve(precision, slopes @ as_parts(left / deviation))
    blow = np.clip(blow, -LARGEST_OFFSET, LARGEST_OFFSET)
    residual, model = np.abs(left) ** 2, np.abs(left - blow @ by_blow) ** 2
    whitened, own = residual / deviation**2, model - 2 * deviation**2
    sums = [np.sum(each) for each in (residual, own, own - smooth, np.abs(measured) ** 2, whitened)]
    return np.array([*sums, 2.0 * measured.size])


def _gap(sums: Sequence[Real]) -> Gap:
    residual, model, remaining, measured, whitened, data = np.sum(sums, axis=0).tolist()
    return Gap(
        percent=100 * float(np.sqrt(residual / measured)),
        sigma=float(np.sqrt(whitened / data)),
        model_percent=100 * float(np.sqrt(max(0.0, model) / measured)),
        remaining_percent=100 * float(np.sqrt(max(0.0, remaining) / measured)),
        parts=1e4 / measured * np.array(sums)[:, [0, 2]],
    )


def _interval(sums: Sequence[Real]) -> tuple[float, float]:
    """Interval of the percentage, by drawing parts with replacement."""
    random = np.random.default_rng(0)
    chosen = random.integers(len(sums), size=(RESAMPLED, len(sums)))
    residual, _, _, measured, *_ = np.transpose(sums)
    drawn = 100 * np.sqrt(np.sum(residual[chosen], axis=1) / np.sum(measured[chosen], axis=1))
    low, high = np.percentile(drawn, [50 - LEVEL / 2, 50 + LEVEL / 2])
    return float(low), float(high)
