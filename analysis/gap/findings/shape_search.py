"""The smooth function that takes up most of what a model leaves: where, how it looks, and what it resembles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations, product

import numpy as np

from analysis.dof import Direction
from analysis.frequency_response import Complex, Real
from analysis.gap.evidence.calibration import UNCALIBRATED, Calibration
from analysis.gap.evidence.model_evidence import overdispersed
from analysis.gap.findings.intervals import linearised, own_overdispersion
from analysis.gap.fitting.fit import fit
from analysis.gap.fitting.held_out import HeldOut, held_out
from analysis.gap.fitting.model import ENOUGH, Model, evaluate_on
from analysis.gap.fitting.stages import FINAL
from analysis.gap.measurement import Measurement, Rig
from analysis.gap.outside_catalogue.local_change import KINDS, Absorber, BendingPiece, LocalChange
from analysis.gap.outside_catalogue.shape import (
    KNOTS,
    LOW,
    BeamShape,
    ChainOverRows,
    ChainShape,
    FoundShape,
    JointOverSets,
    Shape,
    TesterOverAmplitude,
    TesterOverOrder,
    TesterShape,
    shape_at,
    shapes_of_readings,
)
from analysis.gap.search.screening import inserted
from analysis.gap.search.single_effects import MOST_STEPS, Search
from analysis.interval import Z90

LENGTHS, SIZES = (0.15, 0.3, 0.6, 1.5), (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
"""Lengths and sizes of `Smooth` that are tried; the highest marginal likelihood decides."""
LAWS_FITTED = 3
"""Kinds of places that are fitted: those that promise most by a linear step."""
RIVALS_FITTED = 2
"""Changes at one place of the beam, the best, that a function is put on top of."""
DRAWN = 60
"""Places at which a function is given."""
LIKENESS = 0.9
"""Share of the square of a function, weighted by its band, from which it resembles something simple."""
AT_A_JOINT = 0.03
"""Largest distance from the node of a joint, m, at which a place counts as this joint: the length of a joint."""


def found_shape(
    search: Search,
    on: Model,
    visited: Sequence[Model],
    measurement: Measurement,
    before: HeldOut,
    calibration: Calibration = UNCALIBRATED,
) -> FoundShape | None:
    """The function that helps most on top of a model; None where none promises anything.

    Args:
        search: that fitted the model.
        on: the model.
        visited: others that were fitted; changes at one place of the beam among them show where to begin.
        measurement: with the lines on which gaps are measured.
        before: the gap of the model.
        calibration: how inexact laws are.
    """
    models = [*_of_readings(search, on), *_on_rivals(search, on, visited)]
    if not models:
        return None
    best = _most_likely(search, max(models, key=lambda each: each.log_evidence))
    shape = best.effects[-1]
    assert isinstance(shape, Shape)
    rig = Rig.TESTER if isinstance(shape, TesterShape) else Rig.BEAM
    old, new = getattr(before, rig), getattr(held_out(evaluate_on(best, measurement).fit), rig)
    return replace(_described(best, shape, calibration), before=old.percent, after=new.percent)


def _of_readings(search: Search, on: Model) -> list[Model]:
    known = list(shapes_of_readings(search.measurement, by_set=not on.fit.likelihood.simulation.follows_motion))
    return search.fitted(on, search.screened(on, known, always=1), 1, laws=LAWS_FITTED)


def _on_rivals(search: Search, on: Model, visited: Sequence[Model]) -> list[Model]:
    """A function on top of the best changes at one place; of all kinds from all places where none was fitted."""
    if not search.measurement.sets:
        return []
    known = [each for each in visited if each.effects[:-1] == on.effects and isinstance(each.effects[-1], LocalChange)]
    if not known:
        every = [change for kind in KINDS for change in kind.variants(search.measurement)]
        known = search.fitted_everywhere(on, every, [on])
    found = []
    for each in sorted(known, key=lambda model: -model.log_evidence)[:RIVALS_FITTED]:
        change = each.effects[-1]
        assert isinstance(change, LocalChange)
        found.append(_fitted(search, on, shape_at(change, search.measurement), each.fit.scores))
    return found


def _fitted(search: Search, on: Model, shape: Shape, start: Real) -> Model:
    """A shape fitted on top of a model, from the scores of all but its last parameters."""
    simulation = search.simulation((*on.effects, shape))
    missing = len(simulation.shared) - (len(on.fit.likelihood.simulation.shared) + len(shape.parameters) - 2 * KNOTS)
    begun = inserted(start, len(simulation.shared) - missing, np.zeros(missing))
    return Model((*on.effects, shape), fit(simulation, begun, (FINAL,), ENOUGH, MOST_STEPS))


def _most_likely(search: Search, model: Model) -> Model:
    """The shape with the size and length of the highest marginal likelihood, by the linearised fit."""
    shape, places = model.effects[-1], model.places(len(model.effects) - 1)
    assert isinstance(shape, Shape)
    own, overdispersion = np.array(places[-2 * KNOTS :]), max(1.0, model.fit.per_datum)
    data = (model.fit.at.normal - np.eye(len(model.fit.scores))) / overdispersion
    pull = (model.fit.at.descent + model.fit.scores) / overdispersion + data @ model.fit.scores
    knots, best = np.linspace(shape.smooth.first, shape.smooth.last, KNOTS), (-np.inf, shape.smooth, model.fit.scores)
    before = shape.smooth.basis(knots)
    for length, size in product(LENGTHS, SIZES):
        smooth = replace(shape.smooth, length=length, size=size)
        change, turn = np.linalg.solve(before, smooth.basis(knots)), np.eye(len(pull))
        turn[np.ix_(own[:KNOTS], own[:KNOTS])] = turn[np.ix_(own[KNOTS:], own[KNOTS:])] = change
        normal = np.eye(len(pull)) + turn.T @ data @ turn
        scores = np.asarray(np.linalg.solve(normal, turn.T @ pull), dtype=np.float64)
        evidence = float(pull @ turn @ scores - np.linalg.slogdet(normal)[1]) / 2
        best = max(best, (evidence, smooth, scores), key=lambda each: each[0])
    _, smooth, scores = best
    other = replace(shape, smooth=smooth)
    simulation = search.simulation((*model.effects[:-1], other))
    return Model((*model.effects[:-1], other), fit(simulation, scores, (FINAL,), ENOUGH, MOST_STEPS))


def _described(model: Model, shape: Shape, calibration: Calibration) -> FoundShape:
    """The function of a model with its band; like an effect's, its size is uncertain by at least a share of itself."""
    at = _places(shape)
    places = list(model.places(len(model.effects) - 1))
    there = overdispersed(model.fit, own_overdispersion(model, calibration))
    scores, covariance = there.scores[places], there.covariance[np.ix_(places, places)]
    both = linearised(lambda moved: _parts(_function(shape, moved, at)), scores, covariance)
    value, deviation = (np.asarray(each[: at.size] + 1j * each[at.size :]) for each in both)
    form = calibration.least_form_error * np.abs(value)
    half = np.asarray(Z90 * (np.hypot(deviation.real, form) + 1j * np.hypot(deviation.imag, form)))
    quantity, unit, over = _kind(shape)
    return FoundShape(
        place=_place(shape, scores, model.fit.likelihood.measurement),
        quantity=quantity,
        unit=unit,
        over=over,
        at=np.exp(at) if isinstance(shape, TesterOverAmplitude) else at,
        value=value,
        low=value - half,
        high=value + half,
        before=float("nan"),
        after=float("nan"),
        resembles=resemblance(shape, at, value, half),
    )


def _over_frequency(shape: Shape) -> bool:
    return not isinstance(shape, (ChainOverRows, JointOverSets, TesterOverOrder, TesterOverAmplitude))


def _places(shape: Shape) -> Real:
    """(n,) frequencies, Hz, or other coordinates."""
    smooth = shape.smooth
    if isinstance(shape, ChainOverRows):
        return np.arange(len(shape.points), dtype=float)
    if isinstance(shape, JointOverSets):
        return np.arange(smooth.last + 1)
    even = np.linspace(smooth.first, smooth.last, DRAWN)
    return np.asarray(LOW * np.expm1(even)) if _over_frequency(shape) else even


def _function(shape: Shape, scores: Real, at: Real) -> Complex:
    given = {each.name: each.value(float(score)) for each, score in zip(shape.parameters, scores, strict=True)}
    if isinstance(shape, BeamShape):
        return shape.stiffness(given, np.asarray(2j * np.pi * at))
    return shape.smooth.at(given, np.log1p(at / LOW) if _over_frequency(shape) else at)


def _kind(shape: Shape) -> tuple[str, str, str]:
    """Quantity, unit, and what it depends on."""
    if isinstance(shape, BeamShape):
        turns = shape.change.motion is Direction.ROTATION
        return "dynamic stiffness", "N m" if turns else "N/m", "frequency"
    if isinstance(shape, JointOverSets):
        return "relative change of stiffness", "1", "set"
    over = {ChainOverRows: "point", TesterOverOrder: "order", TesterOverAmplitude: "amplitude"}
    return "relative change of the reading", "1", over.get(type(shape), "frequency")


def _place(shape: Shape, scores: Real, measurement: Measurement) -> dict[str, str | float]:
    if isinstance(shape, TesterShape):
        used = {} if shape.configuration is None else {"configuration": shape.configuration.name.lower()}
        return {"rig": Rig.TESTER, "at": "tester", **used}
    if isinstance(shape, ChainShape):
        return {"rig": Rig.BEAM, "at": "channel"} | ({} if shape.of_set is None else {"set": shape.of_set + 1})
    if isinstance(shape, JointOverSets):
        return {"rig": Rig.BEAM, "at": f"joint {measurement.drawing.joints[shape.joint].name}"}
    assert isinstance(shape, BeamShape)
    number = [each.name for each in shape.parameters].index("position")
    position = shape.parameters[number].value(float(scores[number]))
    nodes, joints = measurement.drawing.node_positions, measurement.drawing.joints
    nearest = min(joints, key=lambda joint: abs(nodes[joint.node - 1] - position))
    at_joint = abs(nodes[nearest.node - 1] - position) < AT_A_JOINT
    motion = "bending" if isinstance(shape.change, BendingPiece) else str(shape.change.motion)
    return {"rig": Rig.BEAM, "at": f"joint {nearest.name}" if at_joint else "beam", "motion": motion} | {
        "position": position,
        "node": float(np.argmin(np.abs(nodes - position)) + 1),
    }


def resemblance(shape: Shape, at: Real, value: Complex, half: Complex) -> str:
    """Names of the fewest simple functions that make most of a function; empty where none does."""
    if isinstance(shape, BeamShape) and isinstance(shape.change, Absorber):
        return "resonance"
    things = _simple_things(shape, at)
    floor = 0.05 * float(np.max(np.abs(value)))
    weight = 1 / np.concatenate([half.real + floor, half.imag + floor])
    whole = _parts(value) * weight
    for count in (1, 2):
        fitted = [(*_share(_columns(things, chosen, weight), whole), chosen) for chosen in combinations(things, count)]
        share, sizes, chosen = max(fitted, key=lambda each: each[0])
        if share > LIKENESS:
            signed = zip(chosen, sizes, strict=True)
            return " and ".join(name if size > 0 else f"negative {name}" for name, size in signed)
    return ""


def _columns(things: Mapping[str, Complex], chosen: Sequence[str], weight: Real) -> Real:
    return np.array([_parts(things[name]) * weight for name in chosen]).T


def _share(columns: Real, whole: Real) -> tuple[float, list[float]]:
    """Share of the square of `whole` (n,) that `columns` (n, things) explain, and their sizes."""
    sizes, *_ = np.linalg.lstsq(columns, whole, rcond=None)
    return 1 - float(np.sum((whole - columns @ sizes) ** 2) / np.sum(whole**2)), sizes.tolist()


def _simple_things(shape: Shape, at: Real) -> dict[str, Complex]:
    """(n,) what simple things do, by name."""
    one, frequency = np.ones(at.size, dtype=complex), 2 * np.pi * at
    if isinstance(shape, BeamShape):
        return {"mass": -one * frequency**2, "spring": one, "structural loss": 1j * one, "dashpot": 1j * frequency}
    if not _over_frequency(shape):
        return {"gain": one, "drift of gain": one * (at - np.mean(at)), "phase": 1j * one}
    return {"gain": one, "phase": 1j * one, "delay": -1j * frequency, "resonance above the band": one * frequency**2}


def _parts(values: Complex | Real) -> Real:
    return np.concatenate([np.real(values), np.imag(values)])
