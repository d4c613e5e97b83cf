"""Measured values in another unit, sign or time convention than the simulator's, of which no effect is the cause."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from analysis.errors import AnalysisError
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.likelihood import INFLATIONS, CurveFit, CurveLikelihood, fit_curves
from analysis.gap.structures.search import CLOSE

POOR = 10.0
"""Chi-square per datum of the simulation, from which other readings of the values are tried."""
BETTER = 10.0
"""Factor by which another reading has to lower the sum of squares to be reported."""
AS_WELL = 1.2
"""Factor up to which sums of squares are alike: of two readings that fit alike, the one without effects is reported."""
ANOTHER_UNIT = 4.0
"""Least factor between two units; a smaller one may be an effect."""


@dataclass(frozen=True)
class Reading:
    """How measured values are to be read.

    Attributes:
        conjugated: whether complex values are to be conjugated.
        factors: by observable, by which values are to be divided.
    """

    conjugated: bool
    factors: dict[str, float]

    def of(self, curve: Curve) -> Curve:
        """A curve, read in this way."""
        factor = self.factors[curve.observable]
        values = np.conj(curve.values) if self.conjugated and curve.is_complex else curve.values
        return replace(curve, values=values / factor, deviation=curve.deviation / abs(factor))

    def sentences(self) -> Iterator[str]:
        """What to check."""
        if self.conjugated:
            yield (
                "The measured values fit far better when they are conjugated: they and the simulator have different "
                "time dependence, e^(+i w t) and e^(-i w t); conjugate the values, so no cause can be named"
            )
        for observable, factor in self.factors.items():
            if abs(factor) != 1:
                yield (
                    f"The values of {observable} fit far better when they are divided by about {abs(factor):.2g}, so "
                    "no cause can be named: check their unit, and those of the conditions and the parameters"
                )
        opposite = [observable for observable, factor in self.factors.items() if factor < 0]
        if opposite:
            yield (
                f"The values of {', '.join(opposite)} fit far better with the opposite sign, so no cause can be named: "
                "check the directions of sensor and force"
            )


def misread(none: CurveFit, others: Sequence[CurveFit]) -> tuple[str, ...]:
    """Sentences where another reading fits far better without effects, and as well as any model fits with them."""
    if none.per_datum < POOR:
        return ()
    best, cost = None, min(none.at.cost / BETTER, *(AS_WELL * each.at.cost for each in others), np.inf)
    for reading in _readings(none):
        try:
            found = _fitted(none.likelihood, reading)
        except AnalysisError:  # there is no prediction beside the start
            continue
        if found[0].at.cost < cost:
            best, cost = found[1], found[0].at.cost
    return () if best is None else tuple(best.sentences())


def _readings(none: CurveFit) -> Iterator[Reading]:
    """Readings other than that of the data; factors are first guessed by size, at the centres of the parameters."""
    likelihood = none.likelihood
    sizes = dict[str, list[float]]()
    for curve in likelihood.curves:
        kept = curve.counted
        predicted = likelihood.predict(np.zeros_like(none.scores), curve)[kept]
        own = sizes.setdefault(curve.observable, [0.0, 0.0])
        own[0] += float(np.sum(np.abs(curve.values[kept]) ** 2))
        own[1] += float(np.sum(np.abs(predicted) ** 2))
    factors = {name: _factor(np.sqrt(seen / given)) for name, (seen, given) in sizes.items() if seen > 0 and given > 0}
    whole = {name: factors.get(name, 1.0) for name in sizes}
    turns = (False, True) if any(each.is_complex for each in likelihood.curves) else (False,)
    for conjugated, sign in product(turns, (1.0, -1.0)):
        reading = Reading(conjugated, {name: sign * each for name, each in whole.items()})
        if conjugated or set(reading.factors.values()) != {1.0}:
            yield reading


def _factor(ratio: float) -> float:
    return float(ratio) if max(ratio, 1 / ratio) >= ANOTHER_UNIT else 1.0


def _fitted(likelihood: CurveLikelihood, reading: Reading) -> tuple[CurveFit, Reading]:
    """A simulation fitted to values read in a way, with factors from that fit."""
    found, inflations = fit_curves(_under(likelihood, reading), np.zeros(likelihood.unknowns), INFLATIONS), CLOSE[-1:]
    if all(abs(each) == 1 for each in reading.factors.values()):
        return found, reading
    closer = replace(reading, factors={name: _closer(found, reading, name) for name in reading.factors})
    again = fit_curves(_under(likelihood, closer), found.scores, inflations)
    return (again, closer) if again.at.cost < found.at.cost else (found, reading)


def _under(likelihood: CurveLikelihood, reading: Reading) -> CurveLikelihood:
    return replace(likelihood, curves=tuple(map(reading.of, likelihood.curves)))


def _closer(found: CurveFit, reading: Reading, observable: str) -> float:
    """The factor of one observable by which its values fit the prediction best."""
    before = reading.factors[observable]
    if abs(before) == 1:
        return before
    along = across = 0.0
    for curve in found.likelihood.curves:
        if curve.observable == observable:
            kept = curve.counted
            predicted = found.likelihood.predict(found.scores, curve)[kept]
            along += float(np.vdot(predicted, curve.values[kept]).real)
            across += float(np.vdot(predicted, predicted).real)
    return before * along / across if along > 0 else before
