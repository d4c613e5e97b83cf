"""The values of a fitted model, without any prior: they are stored, passed on, and made a simulation again."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from hashlib import sha256

import numpy as np

from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.gap.catalogue import laws
from analysis.gap.effect import Effect
from analysis.gap.evidence.calibration import Calibration
from analysis.gap.findings.intervals import deviations_of, estimate, estimates
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.model import Model
from analysis.gap.measurement import Drawing, Measurement
from analysis.gap.parameter import Parameter, ParameterEstimate
from analysis.gap.simulation.baseline import baseline_of
from analysis.gap.simulation.blow_motion import POINT_SCATTER
from analysis.gap.simulation.free_beam_modes import beam_modes_of
from analysis.gap.simulation.two_rigs import Simulation


@dataclass(frozen=True)
class EffectValues:
    """The values of one effect.

    Attributes:
        id, law: as in the catalogue.
        variant: what tells it from other variants of its law, such as the index of a joint, by name.
        parameters: by name.
    """

    id: str
    law: str
    variant: Mapping[str, str]
    parameters: Mapping[str, ParameterEstimate]


@dataclass(frozen=True)
class ModelValues:
    """The values of one model.

    Attributes:
        effects: in the order in which they act.
        parameters: of the paper's model, by name.
        gain: of hammer and accelerometer together in the reference set, relative to one; None without the beam.
        joints: stiffness of each joint after the set-up of the reference set, relative to one, by name.
        motion: for each point struck, (2 joints,) logarithm of the amplitude of each joint along both axes,
            over the computed one; empty where no effect follows motion.
        drawing: name, by `drawing_digest`, of the drawing that the model was fitted to.
    """

    effects: tuple[EffectValues, ...]
    parameters: Mapping[str, ParameterEstimate]
    gain: ParameterEstimate | None
    joints: Mapping[str, ParameterEstimate]
    motion: Mapping[str, tuple[float, ...]]
    drawing: str


def drawing_digest(drawing: Drawing) -> str:
    """A name that changes with every dimension of a drawing."""
    nodes, joints, sensor = drawing.node_positions.tolist(), drawing.joints, drawing.accelerometer
    whole = drawing.beam, nodes, drawing.damping_ratios, joints, sensor, drawing.accelerometer_mass
    return sha256(repr(whole).encode()).hexdigest()[:16]


def values_of(model: Model, calibration: Calibration) -> ModelValues:
    """The values of a fitted model with their 90 % intervals."""
    likelihood, scores, deviations = model.fit.likelihood, model.fit.scores, deviations_of(model, calibration)
    measurement, own = likelihood.measurement, likelihood.simulation.baseline.parameters

    def known(parameter: Parameter, place: int) -> ParameterEstimate:
        return estimate(parameter, float(scores[place]), float(deviations[place]))

    effects = tuple(
        EffectValues(effect.id, effect.law, variant_of(effect, measurement), found)
        for effect, found in zip(model.effects, estimates(model, calibration), strict=True)
    )
    parameters = {each.name: known(each, place) for place, each in enumerate(own)}
    gain, joints = None, dict[str, ParameterEstimate]()
    if measurement.sets:
        of_gain, of_joints = _of_set_up(likelihood)
        gain, *found = map(known, (of_gain, *of_joints), likelihood.setups[0])
        joints = {each.name: value for each, value in zip(of_joints, found, strict=True)}
    errors = {str(point): POINT_SCATTER * scores[likelihood.amplitudes_of_point(point)] for point in likelihood.points}
    motion = {point: tuple(each.tolist()) for point, each in errors.items()}
    return ModelValues(effects, parameters, gain, joints, motion, drawing_digest(measurement.drawing))


def simulated(values: ModelValues, measurement: Measurement) -> tuple[Likelihood, Real]:
    """The simulation that values describe, of a measurement on the same article, and its (unknowns,) scores.

    Parameters of the tester alone that an earlier version did not have keep the centre of their priors.

    Raises:
        AnalysisError: the article was amended, or the catalogue no longer has an effect or a parameter.
    """
    if values.drawing != drawing_digest(measurement.drawing):
        raise AnalysisError("the article has other dimensions than its model was fitted with; diagnose it again")
    effects = tuple(effect_of(each, measurement) for each in values.effects)
    simulation = Simulation(baseline_of(measurement), beam_modes_of(measurement.drawing), effects)
    likelihood = Likelihood(simulation)
    scores = np.zeros(likelihood.unknowns)
    given = [values.parameters, *(each.parameters for each in values.effects)]
    owners = [simulation.baseline.parameters, *(each.parameters for each in effects)]
    pairs = [(each, known) for owned, known in zip(owners, given, strict=True) for each in owned]
    for place, (parameter, known) in enumerate(pairs):
        if parameter.name in known:
            scores[place] = parameter.score(known[parameter.name].value)
        elif known is not values.parameters or place in simulation.under_beam:
            raise AnalysisError(f"the model has no parameter {parameter.name!r}, which this simulation needs")
    if values.gain is not None and measurement.sets:
        of_gain, of_joints = _of_set_up(likelihood)
        found = [values.gain, *(values.joints[each.name] for each in of_joints)]
        scores[likelihood.setups[0]] = [
            each.score(known.value) for each, known in zip((of_gain, *of_joints), found, strict=True)
        ]
    for point in likelihood.points:
        scores[likelihood.amplitudes_of_point(point)] = np.array(values.motion.get(str(point), 0.0)) / POINT_SCATTER
    return likelihood, scores


def _of_set_up(likelihood: Likelihood) -> tuple[Parameter, list[Parameter]]:
    """The gain of a hammer set, and the factor of each joint's stiffness, as parameters."""
    scatter, joints = likelihood.scales.setup_scatter, likelihood.measurement.drawing.joints
    gain = Parameter("gain", "1", 1.0, likelihood.measurement.tolerances.sensor_gain)
    return gain, [Parameter(joint.name, "1", 1.0, scatter) for joint in joints]


def variant_of(effect: Effect, measurement: Measurement) -> dict[str, str]:
    """The values that distinguish an effect from other variants of its law: names and values of its fields, as text."""
    variants = [each for each in _every(measurement) if type(each) is type(effect)]
    names = [each.name for each in fields(effect)]
    return {name: str(getattr(effect, name)) for name in names if len({getattr(v, name) for v in variants}) > 1}


def effect_of(values: EffectValues, measurement: Measurement) -> Effect:
    """The effect of the catalogue that values describe, for a measurement.

    Raises:
        AnalysisError: the catalogue has no such effect, or it cannot show in the measurement.
    """
    if not any((law.id, law.law) == (values.id, values.law) for law in laws()):
        raise AnalysisError(f"the catalogue has no effect {values.id!r} with the law {values.law!r}")
    for effect in _every(measurement):
        if (effect.id, effect.law) == (values.id, values.law) and all(
            str(getattr(effect, name, None)) == text for name, text in values.variant.items()
        ):
            return effect
    which = ", ".join(f"{name} {text}" for name, text in values.variant.items())
    raise AnalysisError(f"{values.id} ({values.law}{'; ' + which if which else ''}) cannot show in this measurement")


def _every(measurement: Measurement) -> Iterator[Effect]:
    """Every variant of every law that a measurement could show, and each with a deviation from its law."""
    for law in laws():
        for variant in law.variants(measurement):
            yield variant
            if (bent := variant.bent(measurement)) is not None:
                yield bent
