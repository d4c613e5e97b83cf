"""The law of the joints as it was found: stiffness and loss factor over what they depend on, where data cover it.

A law is asked as the simulation asks it (`Effect.cylinders`), so a named law, one that deviates from it and a smooth
function in place of one are all drawn alike. Its band is that of the fit, by linearisation.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.frequency_response import Real
from analysis.gap.bench import TYPICAL_MOTION, Cylinders, Loading
from analysis.gap.effect import Effect, Given, LawOver
from analysis.gap.effects.joint_amplitude import deformation
from analysis.gap.effects.joint_state import PreloadStiffening
from analysis.gap.evidence.calibration import Calibration
from analysis.gap.evidence.model_evidence import overdispersed
from analysis.gap.findings.intervals import Band, form_share, linearised, own_overdispersion
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.model import Model
from analysis.gap.simulation.tester_rig import tester_loading
from analysis.interval import Z90

DRAWN = 31
"""Number of values of amplitude, frequency, order, preload or temperature at which a law is given."""
HELD_FREQUENCY = 60.0
"""Frequency, Hz, at which a law over another quantity is given. Only softening by temperature depends on frequency; its
parameter `softening` holds at this one."""
LOGARITHMIC = frozenset({LawOver.AMPLITUDE, LawOver.FREQUENCY})
UNITS = {LawOver.AMPLITUDE: "m", LawOver.FREQUENCY: "Hz", LawOver.PRELOAD: "m", LawOver.TEMPERATURE: "K"}


@dataclass(frozen=True, eq=False)
class LawOfAxis:
    """The law along one axis of the cylinders, of all joints together.

    Attributes:
        stiffness: over that at the first place.
        loss_factor: k'' over k'.
        loss_ratio: the loss factor over that at the first place.
    """

    stiffness: Band
    loss_factor: Band
    loss_ratio: Band


@dataclass(frozen=True, eq=False)
class LawFound:
    """The law of the joints as it was found.

    Attributes:
        over: what it depends on.
        unit: of that.
        at: (n,) places from the least to the largest that the data cover.
        shear, compression: the law along both axes.
        closest: the closest law that is known, where none is as found; else empty.
    """

    over: LawOver
    unit: str
    at: Real
    shear: LawOfAxis
    compression: LawOfAxis
    closest: str = ""


def law_found(model: Model, place: int, calibration: Calibration, closest: str = "") -> LawFound | None:
    """The law of one effect of a fitted model; None for one that is no law of the joints, or was seen at one place.

    Args:
        model: fitted.
        place: of the effect in it.
        calibration: how inexact laws are.
        closest: the closest law that is known, where none is as found.
    """
    effect = model.effects[place]
    over = effect.law_over
    at = None if over is None else _places(model, place, over)
    if over is None or at is None:
        return None
    simulation = model.fit.likelihood.simulation

    def cylinders(scores: Real) -> tuple[Cylinders, Cylinders]:
        values = simulation.values(scores.tolist())
        before = simulation.baseline.cylinders(values.baseline)
        for earlier, own in values.acting[:place]:
            before = earlier.cylinders(own, before, _loading(over, at))
        return before, _after(effect, values.acting[place][1], before, over, at)

    scores = model.fit.scores[: len(simulation.shared)]
    covariance = overdispersed(model.fit, own_overdispersion(model, calibration)).covariance
    covariance = covariance[: scores.size, : scores.size]
    found = linearised(lambda moved: _curves(*cylinders(moved)).ravel(), scores, covariance)
    value, deviation = (each.reshape(2, 3, -1) for each in found)
    form = form_share(effect, calibration) * np.abs(value - _without(cylinders(scores)[0]))
    half = Z90 * np.hypot(deviation, form)
    bands = [[Band(*each) for each in axis] for axis in np.stack([value, value - half, value + half], axis=2)]
    shear, compression = (LawOfAxis(*each) for each in bands)
    return LawFound(over, UNITS.get(over, "1"), at, shear, compression, closest)


def _places(model: Model, place: int, over: LawOver) -> Real | None:
    """(n,) places that the data cover; None where these are not two different ones."""
    ends = _covered(model, place, over)
    if ends is None or not ends[0] < ends[1]:
        return None
    return np.geomspace(*ends, DRAWN) if over in LOGARITHMIC else np.linspace(*ends, DRAWN)


def _loading(over: LawOver, at: Real) -> Loading:
    """The state of motion at places (n,), as in the tester; a single one where places do not differ in it."""
    held = {LawOver.FREQUENCY: HELD_FREQUENCY, LawOver.AMPLITUDE: TYPICAL_MOTION, LawOver.ORDER: 0.0}
    count = at.size if over in held else 1
    frequency, amplitude, fraction = (at if each is over else np.full(count, value) for each, value in held.items())
    return Loading(True, frequency, amplitude, None, fraction, np.zeros(count, dtype=bool))


def _covered(model: Model, place: int, over: LawOver) -> tuple[float, float] | None:
    """The least and the largest place that the data cover; None where they do not cover any."""
    simulation, measurement = model.fit.likelihood.simulation, model.fit.likelihood.measurement
    points, shared = measurement.points, len(simulation.shared)
    effect, given = simulation.values(model.fit.scores[:shared].tolist()).acting[place]
    match over:
        case LawOver.FREQUENCY:
            lines = [each.frequency for each in measurement.sets]
            return _ends(lines if points is None else [*lines, points.frequency])
        case LawOver.AMPLITUDE:
            return _ends(_amplitudes(model, effect, given))
        case _ if points is None:
            return None
        case LawOver.ORDER:
            return _ends([points.fraction])
        case LawOver.PRELOAD:
            assert isinstance(effect, PreloadStiffening), "the only effect of a preload"
            return 0.0, 1e-3 * effect.preset_mm
        case LawOver.TEMPERATURE:
            return min(0.0, given["delta_t"]), max(0.0, given["delta_t"])


def _amplitudes(model: Model, effect: Effect, given: Given) -> list[Real]:
    """Amplitudes that joints had in the tester and under the blows of each row."""
    likelihood, component = model.fit.likelihood, getattr(effect, "component", True)
    measurement, found = likelihood.measurement, list[Real]()
    if measurement.points is not None:
        found.append(deformation(tester_loading(measurement.points), given, component))
    if measurement.sets:
        # the motion of a whole blow counts, which is that at the lowest line: above, the part of each mode is less
        lowest = Likelihood(likelihood.simulation.of(measurement.thinned(1)))
        groups = lowest.state(model.fit.scores).groups
        found += [deformation(each.setting.loading, given, component) for each in groups]
    return found


def _ends(values: Sequence[Real]) -> tuple[float, float]:
    return min(float(np.min(each)) for each in values), max(float(np.max(each)) for each in values)


def _after(effect: Effect, given: Given, before: Cylinders, over: LawOver, at: Real) -> Cylinders:
    """The cylinders under the effect at each place."""
    found = [effect.cylinders(each, before, _loading(over, at)) for each in _states(given, over, at)]
    storage, loss = (np.concatenate([getattr(each, part) for each in found], axis=3) for part in ("storage", "loss"))
    return Cylinders(storage, loss)


def _states(given: Given, over: LawOver, at: Real) -> list[Given]:
    """Parameters at each place, for laws that know joints in the two rigs alone; else those of all places."""
    match over:
        case LawOver.TEMPERATURE:  # the beam is less warm than a state that is warmer than the tester
            return [{**given, "delta_t": given["delta_t"] - float(each)} for each in at]
        case LawOver.PRELOAD:
            return [{**given, "s": given["s"] * float(each / at[-1])} for each in at]
        case _:
            return [given]


def _curves(before: Cylinders, after: Cylinders) -> Real:
    """(2, 3, n): in shear and in compression, the quantities of `LawOfAxis`.

    Stiffness is that which the effect makes of the one before it, which other effects may have changed, too.
    """
    storage, old = (np.sum(each.storage[:, :2, 0], axis=0) for each in (after, before))
    ratio, loss = storage / old, np.sum(after.loss[:, :2, 0], axis=0) / storage
    return np.stack(np.broadcast_arrays(ratio / ratio[:, :1], loss, loss / loss[:, :1]), axis=1)


def _without(before: Cylinders) -> Real:
    """(2, 3, n) what `_curves` gives where the effect does nothing."""
    storage, loss = (np.sum(each[:, :2, 0], axis=0) for each in (before.storage, before.loss))
    return np.stack(np.broadcast_arrays(1.0, loss / storage, 1.0), axis=1)
