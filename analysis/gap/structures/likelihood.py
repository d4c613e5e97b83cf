"""The most likely parameters of one model of any structure.

All unknowns are scores with a standard normal prior: shared parameters, those of the effects, and the local ones of
each part. Derivatives are central differences, as a simulator may be a black box.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.gap.evidence.fitted import Fitted
from analysis.gap.parameter import Parameter
from analysis.gap.structures.curve import Curve, parts_of
from analysis.gap.structures.effect import Acting, StructureEffect
from analysis.gap.structures.simulator import Simulator
from analysis.gap.structures.smooth_error import HALF_NORMAL, error_modes, inflated
from analysis.inverse.levenberg_marquardt import Linearised, Trial, minimise

STEP = 1e-4
"""Step of a score, for derivatives by central differences."""
FARTHEST = 30.0
"""Standard deviations from its prior that no parameter exceeds."""
ROUNDING = 1e-6
"""Largest imaginary part of the prediction of a real curve, over its largest value, that is taken for rounding."""
INFLATIONS = (0.5, 0.1, 0.03, 0.0)
"""Shares of the size of each value by which its deviation is inflated in successive fits, as sharp peaks have local
minima."""


@dataclass(frozen=True, eq=False)
class PartEquations:
    """The normal equations of one part.

    Attributes:
        unknowns: (m,) indices of the unknowns that the part depends on.
        normal: (m, m) J^t J.
        descent: (m,) J^t r.
        chi_square: r^t r.
    """

    unknowns: np.ndarray
    normal: Real
    descent: Real
    chi_square: float


@dataclass(frozen=True, eq=False)
class PartSlopes:
    """What one part leaves, and how it changes with its unknowns, over deviations alone, for each of its curves.

    Attributes:
        unknowns: (m,) indices of the unknowns that the part depends on.
        curves: of the part.
        left: (data,) of each curve.
        columns: (m, data) of each curve, of its prediction.
    """

    unknowns: np.ndarray
    curves: tuple[Curve, ...]
    left: tuple[Real, ...]
    columns: tuple[Real, ...]


@dataclass(frozen=True, eq=False)
class CurveLikelihood:
    """A sum of squares over unknown scores.

    Attributes:
        simulator: of the structure.
        effects: that act.
        curves: that are fitted.
        inflation: share of the size of each value that is added to its deviation.
        smooth_error: scale of the smooth relative errors of each curve; `smooth_error` has them.
    """

    simulator: Simulator
    effects: tuple[StructureEffect, ...]
    curves: tuple[Curve, ...]
    inflation: float = 0.0
    smooth_error: float = 0.0

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of the structure, then of each effect."""
        own = [parameter for effect in self.effects for parameter in effect.parameters]
        return (*self.simulator.parameters, *own)

    @cached_property
    def parts(self) -> tuple[str, ...]:
        """Names of the parts, in the order of their local unknowns."""
        return parts_of(self.curves)

    @property
    def unknowns(self) -> int:
        """Number of unknowns."""
        return len(self.parameters) + len(self.parts) * len(self.simulator.local)

    @cached_property
    def data(self) -> int:
        """Number of real values that count."""
        return sum(each.data for each in self.curves)

    @property
    def log_normalisation(self) -> float:
        """Of the smooth errors, and the prior of their scale: the same for all models of one scale."""
        if not self.smooth_error:
            return 0.0
        spread = sum(error_modes(each, self.inflation).log_determinant(self.smooth_error) for each in self.curves)
        return -(spread + (self.smooth_error / HALF_NORMAL) ** 2) / 2

    def places_of(self, part: str) -> list[int]:
        """Indices of the unknowns that one part depends on; without local ones where it was not fitted."""
        shared, each = len(self.parameters), len(self.simulator.local)
        own = [shared + self.parts.index(part) * each + n for n in range(each)] if part in self.parts else []
        return [*range(shared), *own]

    def predict(self, scores: Real, curve: Curve) -> Complex:
        """(n,) readings of one curve at `scores` (unknowns,).

        Raises:
            AnalysisError: the simulator gives none, not one number for each value, or complex ones for a real curve.
        """
        known = [float(scores[place]) for place in self.places_of(curve.part)]
        own, local = known[: len(self.parameters)], known[len(self.parameters) :]
        shared = self.simulator.parameters
        values = {each.name: each.value(score) for each, score in zip(shared, own, strict=False)}
        for number, each in enumerate(self.simulator.local):
            values[each.name] = each.value(local[number] if local else 0.0)
        acting, rest = [], iter(own[len(shared) :])
        for effect in self.effects:
            acting.append(Acting(effect, {each.name: each.value(next(rest)) for each in effect.parameters}))
        try:
            # a copy: a simulator may give the same array each time, with other values in it
            found = np.array(self.simulator.predict(values, acting, curve))
        except AnalysisError:
            raise
        except (Exception, SystemExit) as error:  # code of users may raise anything; only its candidate is lost
            raise AnalysisError(f"{self.who} fails for {curve.name}: {_said(error, curve)}") from error
        if found.shape != curve.values.shape:
            raise AnalysisError(f"{self.who} gives shape {found.shape} for {curve.name}, expected {curve.values.shape}")
        if not np.issubdtype(found.dtype, np.number):
            raise AnalysisError(f"{self.who} gives values of type {found.dtype} for {curve.name}, not numbers")
        if curve.is_complex:
            return found
        if np.max(np.abs(np.imag(found)), initial=0.0) > ROUNDING * np.max(np.abs(found), initial=0.0):
            raise AnalysisError(
                f"{self.who} gives complex values for {curve.name}, of which real ones were measured; measure real and "
                "imaginary part, or predict what was measured, such as an amplitude"
            )
        return np.real(found)

    @property
    def who(self) -> str:
        """Simulator and effects, for messages."""
        names = [each.id for each in self.effects]
        return f"simulator {self.simulator.name}" + (f" with effects {names}" if names else "")

    def left(self, scores: Real, curve: Curve) -> Real:
        """(data,) whitened residual: real and imaginary parts over deviation and smooth errors."""
        return self._whitened(self._measured(curve) - self._predicted(scores, curve), curve)

    def _whitened(self, values: Real, curve: Curve) -> Real:
        if not self.smooth_error:
            return values
        return error_modes(curve, self.inflation).whitened(values, self.smooth_error)

    def _predicted(self, scores: Real, curve: Curve) -> Real:
        return self._over_deviation(self.predict(scores, curve), curve)

    def _measured(self, curve: Curve) -> Real:
        return self._over_deviation(curve.values, curve)

    def _over_deviation(self, values: Complex | Real, curve: Curve) -> Real:
        """(data,) real and imaginary parts of values over deviation, of the values that count."""
        kept = curve.counted
        found = values[kept] / inflated(curve, self.inflation)[kept]
        return np.concatenate([found.real, found.imag]) if curve.is_complex else np.asarray(found)

    def at(self, values: Real) -> Trial:
        """Chi-square and the squared scores at `values` (unknowns,); infinite for an impossible structure."""
        nowhere = Trial(float("inf"), self._nowhere)
        if np.max(np.abs(values), initial=0.0) > FARTHEST or not self._possible(values):
            return nowhere
        try:
            with np.errstate(all="ignore"):
                left = [self.left(values, each) for each in self.curves]
                total = sum(float(each @ each) for each in left) + float(values @ values)
        except AnalysisError:
            return nowhere
        return Trial(total, lambda: self.linearised(values)) if np.isfinite(total) else nowhere

    def _nowhere(self) -> Linearised:
        raise AnalysisError(
            f"{self.who} is infinitely far from what was measured where the search starts; check the units of its "
            "values and of the conditions, and the deviations"
        )

    def _possible(self, values: Real) -> bool:
        pairs = zip(self.parameters, values.tolist(), strict=False)
        return all(parameter.value(score) >= parameter.least for parameter, score in pairs)

    def linearised(self, values: Real) -> Linearised:
        """The normal equations of all parts and of the prior."""
        return summed(self.blocks(values), values)

    def blocks(self, values: Real) -> tuple[PartEquations, ...]:
        """The normal equations of each part, linearised at `values` (unknowns,).

        Raises:
            AnalysisError: there is no finite prediction beside `values`.
        """
        return tuple(map(self.equations, self.slopes(values)))

    def equations(self, part: PartSlopes) -> PartEquations:
        """The normal equations of one part under the smooth errors of this likelihood."""
        left = np.concatenate([self._whitened(each, curve) for each, curve in zip(part.left, part.curves, strict=True)])
        own = [self._whitened(each, curve) for each, curve in zip(part.columns, part.curves, strict=True)]
        columns = np.concatenate(own, axis=1)
        return PartEquations(part.unknowns, columns @ columns.T, columns @ left, float(left @ left))

    def slopes(self, values: Real) -> tuple[PartSlopes, ...]:
        """What each part leaves at `values` (unknowns,), with its derivatives; smooth errors do not change these.

        Raises:
            AnalysisError: there is no finite prediction beside `values`.
        """
        found = []
        for part in self.parts:
            places, curves = self.places_of(part), tuple(each for each in self.curves if each.part == part)
            with np.errstate(all="ignore"):
                left = tuple(self._measured(each) - self._predicted(values, each) for each in curves)
                columns = tuple(np.array([self._slope(values, place, each) for place in places]) for each in curves)
            if not all(np.all(np.isfinite(each)) for each in (*left, *columns)):
                raise AnalysisError(f"{self.who} gives values that are not finite for part {part!r}")
            found.append(PartSlopes(np.array(places), curves, left, columns))
        return tuple(found)

    def _slope(self, values: Real, place: int, curve: Curve) -> Real:
        """(data,) derivative in one unknown; one-sided where a value on the other side is impossible."""
        ends, found = [], []
        for sign in (1.0, -1.0):
            there = values.copy()
            there[place] += sign * STEP
            if self._possible(there):
                ends.append(sign * STEP)
                found.append(self._predicted(there, curve))
        if len(ends) == 1:
            ends.append(0.0)
            found.append(self._predicted(values, curve))
        return np.asarray((found[0] - found[1]) / (ends[0] - ends[1]))


def summed(blocks: Sequence[PartEquations], values: Real) -> Linearised:
    """The normal equations of all parts and of the prior at `values` (unknowns,)."""
    normal, descent, cost = np.eye(values.size), -values.copy(), float(values @ values)
    for block in blocks:
        normal[np.ix_(block.unknowns, block.unknowns)] += block.normal
        descent[block.unknowns] += block.descent
        cost += block.chi_square
    return Linearised(cost, descent, normal)


def _said(error: BaseException, curve: Curve) -> str:
    """An error in code of users; a condition that it asks for and that was not measured is named."""
    known = ", ".join(sorted(curve.conditions)) or "none"
    missing = error.args[0] if isinstance(error, KeyError) and error.args else None
    if isinstance(missing, str) and missing not in curve.conditions:
        return f"it asks for {missing!r}, which is no parameter and no condition of this curve; conditions are {known}"
    return f"{type(error).__name__}: {error}"


class CurveFit(Fitted[CurveLikelihood]):
    """The most likely parameters of one model of any structure."""

    @cached_property
    def blocks(self) -> tuple[PartEquations, ...]:
        """The normal equations of each part."""
        return self.likelihood.blocks(self.scores)

    def local_of(self, part: str) -> Real:
        """Scores of the local unknowns of a part."""
        return self.scores[self.likelihood.places_of(part)[len(self.likelihood.parameters) :]]


def fit_curves(
    likelihood: CurveLikelihood,
    start: Real,
    inflations: Sequence[float] = INFLATIONS,
    tolerance: float = 0.1,
    most_steps: int = 30,
) -> CurveFit:
    """Find the most likely parameters.

    Args:
        likelihood: to maximise.
        start: (unknowns,) scores.
        inflations: of successive fits; the last should be zero.
        tolerance: gain in chi-square (over chi-square per datum) at which the last ends.
        most_steps: of each fit.

    Raises:
        AnalysisError: there is no prediction at the start.
    """
    scores, found = start, None
    for inflation in inflations:
        stage, last = replace(likelihood, inflation=inflation), inflation == inflations[-1]
        found = minimise(stage, scores, tolerance if last else 3.0, most_steps)
        scores = found.values
    assert found is not None, "one fit at least"
    return CurveFit(likelihood, scores, found.at, found.converged)
