"""The corrected simulation of a structure as a JSON file, from which it predicts under other conditions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import ValidationError

from analysis.errors import AnalysisError
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.model_evidence import overdispersed
from analysis.gap.findings.intervals import estimate, own_overdispersion
from analysis.gap.parameter import Parameter
from analysis.gap.structures.diagnosis import CurveDiagnosis
from analysis.gap.structures.effect import StructureEffect
from analysis.gap.structures.prediction import Known
from analysis.gap.structures.search import CurveModel
from analysis.gap.structures.simulator import Simulator
from jointlab.errors import JointlabError
from rig.document import Document
from store.version import software_version

SAME = 1e-6
"""Share by which a parameter's value may differ from that of the file: a simulator that differs by more has changed."""


class ParameterValue(Document):
    """A parameter: `score` counts standard deviations of its prior from its centre."""

    name: str
    unit: str
    value: float
    score: float
    ci90: tuple[float, float]


class EffectModel(Document):
    """An effect of the verdict; `fields` tell variants of its class from each other, such as its place."""

    id: str
    law: str
    kind: str
    fields: dict[str, Any]
    parameters: tuple[ParameterValue, ...]


class FittedModel(Document):
    """One model; `covariance` is that of all scores, those of the structure first, then of each effect."""

    parameters: tuple[ParameterValue, ...]
    effects: tuple[EffectModel, ...]
    covariance: tuple[tuple[float, ...], ...]

    @property
    def known(self) -> Known:
        """For predictions."""
        own = [*self.parameters, *(each for effect in self.effects for each in effect.parameters)]
        return Known(np.array([each.score for each in own]), np.array(self.covariance).reshape(len(own), -1))


class StructureModel(Document):
    """A simulation as it is, and with the effects that a diagnosis found."""

    format: Literal["jointlab-structure-model/1"] = "jointlab-structure-model/1"
    creator: str
    simulator: str
    before: FittedModel
    after: FittedModel


def structure_model(found: CurveDiagnosis, simulator: str) -> StructureModel:
    """The corrected simulation of a diagnosis made with the simulator of this name."""
    return StructureModel(
        creator=f"Jointlab {software_version()}",
        simulator=simulator,
        before=_fitted(found.none),
        after=_fitted(found.model),
    )


def _fitted(model: CurveModel) -> FittedModel:
    shared = model.fit.likelihood.parameters
    covariance = overdispersed(model.fit, own_overdispersion(model, UNCALIBRATED)).covariance[
        : len(shared), : len(shared)
    ]
    deviations, scores = np.sqrt(np.diag(covariance)), model.fit.scores
    values = [
        _value(parameter, float(score), float(deviation))
        for parameter, score, deviation in zip(shared, scores, deviations, strict=False)
    ]
    own = [values[place] for place in range(len(model.fit.likelihood.simulator.parameters))]
    effects = [
        EffectModel(
            id=effect.id,
            law=effect.law,
            kind=_kind(type(effect)),
            fields=asdict(effect),
            parameters=tuple(values[place] for place in model.places(number)),
        )
        for number, effect in enumerate(model.effects)
    ]
    return FittedModel(parameters=tuple(own), effects=tuple(effects), covariance=covariance.tolist())


def _value(parameter: Parameter, score: float, deviation: float) -> ParameterValue:
    found = estimate(parameter, score, deviation)
    return ParameterValue(name=parameter.name, unit=parameter.unit, value=found.value, score=score, ci90=found.ci90)


def write_structure_model(path: Path, model: StructureModel) -> None:
    """Write the file.

    Raises:
        JointlabError: it cannot be written.
    """
    try:
        path.write_text(model.model_dump_json(indent=1) + "\n", encoding="utf-8")
    except OSError as error:
        raise JointlabError(f"{path} cannot be written: {error.strerror or error}") from error


def read_structure_model(path: Path) -> StructureModel:
    """Read a file of `write_structure_model`.

    Raises:
        JointlabError: the file cannot be read, or is none.
    """
    try:
        return StructureModel.model_validate_json(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError) as error:
        raise JointlabError(f"{path} cannot be read: {error}") from error
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "the whole"
        raise JointlabError(f"{path} is no corrected simulation of a structure: {where}: {first['msg']}") from error


def effects_of(model: FittedModel, simulator: Simulator) -> tuple[StructureEffect, ...]:
    """The effects of a model, made of the classes that have been imported.

    Raises:
        JointlabError: one is not known, or the simulator or an effect has changed since the file was written.
    """
    kinds = {_kind(each): each for each in _imported(StructureEffect)}
    found = list[StructureEffect]()
    for each in model.effects:
        if each.kind not in kinds:
            raise JointlabError(f"the effect {each.id} ({each.kind}) is not known; name it with --effect")
        try:
            made = kinds[each.kind](**{name: _as_field(value) for name, value in each.fields.items()})
        except (TypeError, AnalysisError) as error:
            raise JointlabError(f"the effect {each.id} has changed since the file was written: {error}") from error
        _check(f"the effect {each.id}", made.parameters, each.parameters)
        found.append(made)
    _check(f"the simulator {simulator.name}", simulator.parameters, model.parameters)
    return tuple(found)


def _kind(effect: type[StructureEffect]) -> str:
    return f"{effect.__module__}.{effect.__qualname__}"


def _imported(kind: type[StructureEffect]) -> Iterator[type[StructureEffect]]:
    for each in kind.__subclasses__():
        yield each
        yield from _imported(each)


def _as_field(value: Any) -> Any:
    return tuple(map(_as_field, value)) if isinstance(value, list) else value


def _check(what: str, parameters: Sequence[Parameter], stored: Sequence[ParameterValue]) -> None:
    names = [each.name for each in parameters]
    if names != [each.name for each in stored]:
        raise JointlabError(f"{what} has changed since the file was written: its parameters are {', '.join(names)}")
    for now, then in zip(parameters, stored, strict=True):
        if not np.isclose(now.value(then.score), then.value, rtol=SAME, atol=SAME * abs(now.spread)):
            raise JointlabError(f"{what} has changed since the file was written: the prior of {now.name} is another")
