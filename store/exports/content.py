"""The content of every export: the newest results of a run as arrays with units, intervals and origin.

An array has named dimensions. Where a variable has the name of a dimension, it says what its places are, such as
``frequency`` of ``accelerance (input, frequency)``.
"""

import json
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy.orm import Session

from store.measurements.frequency_responses import list_frequency_responses
from store.measurements.runs import Run, get_run
from store.results.analyses import NO_RESULT, Analysis, list_analyses
from store.results.comparisons import list_comparisons
from store.results.dynamic_stiffness import StoredStiffness, list_dynamic_stiffness
from store.results.joint_matrices import NOT_OBSERVABLE, list_joint_matrices
from store.results.modes import get_modes
from store.states import AnalysisKind
from store.version import software_version

Attribute = str | int | float | bool | tuple[str, ...] | tuple[int, ...]
Attributes = Mapping[str, Attribute]
LIMIT = "limit"
"""The dimension of intervals: low and high."""
_LIMITS, _AXES = ("low", "high"), ("x", "y", "rotation")
_TERMS = tuple(f"{each}{row}{column}" for each in "kh" for row in (1, 2, 3) for column in range(row, 4))
_JOINT_UNIT = "N/m, N, N m at rows and columns x, y, rotation"
UNITS: Mapping[str, str] = {
    "elapsed": "s",
    "amplitude_pp_mm": "mm",
    "frequency": "Hz",
    "stiffness": "N/m",
    "damping": "N/m",
    "magnitude": "N/m",
    "loss_angle_deg": "deg",
    "stiffness_se": "N/m",
    "damping_se": "N/m",
    "magnitude_se": "N/m",
    "loss_angle_se_deg": "deg",
    "stiffness_damping_covariance": "(N/m)^2",
    "reached_frequency": "Hz",
    "reached_pp_mm": "mm",
    "reached_pp_se_mm": "mm",
    "thd_percent": "%",
    "thd_se_percent": "%",
    "thd_displacement_percent": "%",
    "thd_displacement_se_percent": "%",
    "loop_energy": "J",
    "loop_energy_se": "J",
    "loop_energy_excess": "J",
    "loop_energy_excess_se": "J",
    "temperature_c": "degC",
}
"""Units of the numbers of a sine point; numbers that are not listed have no unit."""


@dataclass(frozen=True, eq=False)
class Variable:
    """An array over named dimensions; texts have an empty unit, ratios the unit 1."""

    dims: tuple[str, ...]
    values: NDArray[Any]
    unit: str


@dataclass(frozen=True, eq=False)
class RunPart:
    """Results that belong together.

    Attributes:
        path: kind of result, analysis, and set or joint where there are several.
        origin: of the analysis: runs, parents, settings, version of the program.
        labels: what tells this part from others of the kind, such as the name of the joint.
        attributes: what else holds for all of it.
        variables: by name.
    """

    path: tuple[str, ...]
    origin: Attributes
    labels: Attributes
    attributes: Attributes
    variables: Mapping[str, Variable]

    @property
    def analysis(self) -> tuple[str, ...]:
        """The path of its analysis."""
        return self.path[:2]

    @property
    def kind(self) -> str:
        """The kind of result, such as ``modes``."""
        return self.path[0]


@dataclass(frozen=True, eq=False)
class RunContent:
    """A run: what it is (`attributes`, and `setup` as JSON), and its parts."""

    attributes: Attributes
    setup: str
    parts: tuple[RunPart, ...]

    @property
    def analyses(self) -> int:
        """Number of analyses."""
        return len({part.analysis for part in self.parts})


def content_of(session: Session, run_id: int, kinds: Collection[str] | None = None) -> RunContent:
    """The newest results of each method of a run, of these kinds alone where they are given.

    Raises NotFoundError if there is no such run, DamagedError if a stored array is damaged.
    """
    run, parts = get_run(session, run_id), list[RunPart]()
    for kind, read in _READERS.items():
        if kinds is not None and kind not in kinds:
            continue
        newest: dict[str, Analysis] = {}
        for analysis in list_analyses(session, run_id, kind):
            newest.setdefault(analysis.method, analysis)
        for analysis in newest.values():
            if NO_RESULT in analysis.settings or _is_superseded(session, run_id, analysis):
                continue
            path, origin = (str(kind), f"analysis_{analysis.id}"), _origin(analysis)
            for name, labels, attributes, variables in read(session, run_id, analysis):
                labels = {"analysis": analysis.id, "method": analysis.method, **labels}
                parts.append(RunPart((*path, *name), origin, labels, attributes, _present(variables)))
    return RunContent(_attributes(run), json.dumps(run.setup), tuple(parts))


def _is_superseded(session: Session, run_id: int, analysis: Analysis) -> bool:
    """Whether a comparison is of joints that are no longer the newest of their method, and those are not compared."""
    if analysis.kind != AnalysisKind.COMPARISONS:
        return False
    newest, older = dict[str, int](), set[int]()
    for each in list_analyses(session, run_id, AnalysisKind.JOINT_MATRICES):
        if newest.setdefault(each.method, each.id) != each.id:
            older.add(each.id)
    return not older.isdisjoint(analysis.parents)


def known(**attributes: Any) -> dict[str, Any]:
    """The attributes that are not None; most formats have no null."""
    return {name: value for name, value in attributes.items() if value is not None}


def _attributes(run: Run) -> Attributes:
    return {
        "creator": f"Jointlab {software_version()}",
        "run": run.id,
        "kind": str(run.kind),
        "title": run.title,
        "article": run.article,
        "started_at": run.started_at.isoformat(),
        "measured_by": f"Jointlab {run.software_version}",
        "configuration_hash": run.configuration_hash,
    }


def _origin(analysis: Analysis) -> Attributes:
    return {
        "runs": analysis.runs,
        "parents": analysis.parents,
        "settings": json.dumps(analysis.settings),
        "configuration_hash": analysis.configuration_hash,
        "software_version": analysis.software_version,
        "created_at": analysis.created_at.isoformat(),
    }


_Given = tuple[tuple[str, ...], NDArray[Any] | None, str]
"""Dimensions, values and unit; None for what is not known."""
_Read = tuple[tuple[str, ...], dict[str, Attribute], dict[str, Any], dict[str, _Given]]
"""One part: the end of its path, its labels, attributes and variables."""


def _texts(dim: str, texts: Iterable[object]) -> _Given:
    return (dim,), np.array([str(each) for each in texts], dtype=object), ""


def _present(given: Mapping[str, _Given]) -> dict[str, Variable]:
    """The variables with values, without coordinates of a dimension that no array has."""
    present = {name: Variable(dims, values, unit) for name, (dims, values, unit) in given.items() if values is not None}
    used = {dim for name, variable in present.items() for dim in variable.dims if dim != name}
    return {name: each for name, each in present.items() if each.dims != (name,) or name in used}


def _frequency_responses(session: Session, run_id: int, analysis: Analysis) -> Iterator[_Read]:
    for measured in list_frequency_responses(session, run_id, analysis.id):
        attributes = known(
            averages=measured.averages,
            peak_force_n=measured.peak_force,
            temperature_c=measured.temperature_c,
            window=measured.window,
            sample_rate_hz=measured.sample_rate,
            block_seconds=measured.block_seconds,
            estimator=measured.estimator,
            excitation=str(measured.excitation),
            source=measured.source,
        )
        dims = ("input", "frequency")
        given: dict[str, _Given] = {
            "input": _texts("input", measured.inputs),
            "frequency": (("frequency",), measured.frequency, "Hz"),
            "accelerance": (dims, measured.accelerance, "(m/s^2)/N"),
            "coherence": (dims, measured.coherence, "1"),
            "variance": (dims, measured.variance, "((m/s^2)/N)^2"),
        }
        yield (
            (f"set{measured.number}",),
            {"set": measured.number, "response": str(measured.response)},
            attributes,
            given,
        )


def _modes(session: Session, _run: int, analysis: Analysis) -> Iterator[_Read]:
    modes = get_modes(session, analysis.id)
    numbers = np.arange(1, modes.frequency.size + 1)
    poles = [f"{what}{number}" for number in numbers for what in ("f", "eta")]
    halves = [f"{what} {dof}" for what in ("real", "imaginary") for dof in modes.dofs]
    halves_of_mode = ("mode", "shape_part", "other_shape_part")
    given: dict[str, _Given] = {
        "mode": (("mode",), numbers, "1"),
        "dof": _texts("dof", modes.dofs),
        LIMIT: _texts(LIMIT, _LIMITS),
        "pole": _texts("pole", poles),
        "other_pole": _texts("other_pole", poles),
        "shape_part": _texts("shape_part", halves),
        "other_shape_part": _texts("other_shape_part", halves),
        "frequency": (("mode",), modes.frequency, "Hz"),
        "frequency_ci95": (("mode", LIMIT), modes.frequency_ci95, "Hz"),
        "loss_factor": (("mode",), modes.loss_factor, "1"),
        "loss_factor_ci95": (("mode", LIMIT), modes.loss_factor_ci95, "1"),
        "predicted_frequency": (("mode",), modes.predicted_frequency, "Hz"),
        "shapes": (("mode", "dof"), modes.shapes, "1/kg, modal constants of the accelerances"),
        "pole_covariance": (("pole", "other_pole"), modes.pole_covariance, "of [Hz, 1] mode by mode"),
        "shape_covariance": (halves_of_mode, modes.shape_covariance, "of [real, imaginary] of each shape"),
    }
    yield (), {}, {}, given


def _joints(session: Session, _run: int, analysis: Analysis) -> Iterator[_Read]:
    element, interval = ("row", "column"), ("row", "column", LIMIT)
    unobservable = analysis.settings.get(NOT_OBSERVABLE, {})
    for joint in list_joint_matrices(session, analysis.id):
        given: dict[str, _Given] = {
            "row": _texts("row", _AXES),
            "column": _texts("column", _AXES),
            LIMIT: _texts(LIMIT, _LIMITS),
            "term": _texts("term", _TERMS),
            "other_term": _texts("other_term", _TERMS),
            "stiffness": (element, joint.stiffness, _JOINT_UNIT),
            "stiffness_ci95": (interval, joint.stiffness_ci95, _JOINT_UNIT),
            "damping": (element, joint.damping, _JOINT_UNIT),
            "damping_ci95": (interval, joint.damping_ci95, _JOINT_UNIT),
            "loss_factor": (element, joint.loss_factor, "1"),
            "loss_factor_ci95": (interval, joint.loss_factor_ci95, "1"),
            "observable": (element, joint.observable, "1"),
            "reason": (element, _reasons(unobservable.get(joint.joint, {})), ""),
            "covariance": (("term", "other_term"), joint.covariance, "of [k11, k12, k13, k22, k23, k33, h11, ...]"),
        }
        yield (joint.joint,), {"joint": joint.joint, "node": joint.node}, {}, given


def _reasons(by_term: Mapping[str, str]) -> NDArray[Any]:
    """(3, 3) why a term is not observable, from reasons by term such as ``k11``."""
    return np.array([[by_term.get(f"k{row}{column}", "") for column in (1, 2, 3)] for row in (1, 2, 3)], dtype=object)


def _comparisons(session: Session, _run: int, analysis: Analysis) -> Iterator[_Read]:
    found = list_comparisons(session, analysis.id)
    one, interval, own_unit = ("comparison",), ("comparison", LIMIT), "that of the element"
    unknown = (np.nan, np.nan)
    given: dict[str, _Given] = {
        LIMIT: _texts(LIMIT, _LIMITS),
        "joint": _texts(*one, (each.joint for each in found)),
        "element": _texts(*one, (each.element for each in found)),
        "inverse_ci95": (interval, np.array([each.inverse or unknown for each in found]), own_unit),
        "direct_ci95": (interval, np.array([each.direct for each in found]), own_unit),
        "verdict": _texts(*one, (each.verdict for each in found)),
        "reason": _texts(*one, (each.reason or "" for each in found)),
        "frequency": (one, np.array([each.frequency for each in found], dtype=float), "Hz"),
        "amplitude_pp_mm": (one, np.array([each.amplitude_pp_mm for each in found], dtype=float), "mm"),
    }
    yield (), {}, {}, given


def _dynamic_stiffness(session: Session, _run: int, analysis: Analysis) -> Iterator[_Read]:
    points = list_dynamic_stiffness(session, analysis.id)
    given: dict[str, _Given] = {}
    for each in fields(StoredStiffness):
        column = [getattr(point, each.name) for point in points]
        if each.name in ("flags", "shared_errors"):
            (_, texts, _) = _texts("point", map(json.dumps, column))
            given[each.name] = (("point",), texts, "JSON")
        elif each.name in ("specimen", "configuration"):
            given[each.name] = _texts("point", column)
        else:
            values = np.array([np.nan if value is None else value for value in column])
            given[each.name] = (("point",), values, UNITS.get(each.name, "1"))
    yield (), {}, {}, given


_READERS: Mapping[AnalysisKind, Callable[[Session, int, Analysis], Iterator[_Read]]] = {
    AnalysisKind.FREQUENCY_RESPONSES: _frequency_responses,
    AnalysisKind.MODES: _modes,
    AnalysisKind.JOINT_MATRICES: _joints,
    AnalysisKind.DYNAMIC_STIFFNESS: _dynamic_stiffness,
    AnalysisKind.COMPARISONS: _comparisons,
}
KINDS = tuple(map(str, _READERS))
"""The kinds of results that are exported."""
