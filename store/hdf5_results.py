"""Results of a run in an HDF5 file: values with units, intervals and where they come from."""

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields
from typing import Any

import numpy as np
from sqlalchemy.orm import Session

from store.analyses import Analysis, list_analyses
from store.dynamic_stiffness import StoredStiffness, list_dynamic_stiffness
from store.frequency_responses import list_frequency_responses
from store.joint_matrices import list_joint_matrices
from store.modes import get_modes
from store.states import AnalysisKind

_JOINT_UNITS = "N/m, N, N m at rows and columns x, y, rotation"
_STIFFNESS_UNITS: Mapping[str, str] = {
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
"""Of the numbers of a sine point; others have no unit."""


def add_results(session: Session, run_id: int, file: Any) -> int:
    """Write the newest results of each method as ``results/KIND/analysis_N``, and return how many analyses there were.

    Each group has where it comes from as attributes: method, runs, parents, settings, version of the program.

    Raises DamagedError if a stored array is damaged.
    """
    count = 0
    for kind, write in _WRITERS.items():
        newest: dict[str, Analysis] = {}
        for analysis in list_analyses(session, run_id, kind):
            newest.setdefault(analysis.method, analysis)
        for method, analysis in newest.items():
            group = file.create_group(f"results/{kind}/analysis_{analysis.id}")
            group.attrs.update(
                method=method,
                runs=analysis.runs,
                parents=analysis.parents,
                settings=json.dumps(analysis.settings),
                configuration_hash=analysis.configuration_hash,
                software_version=analysis.software_version,
                created_at=analysis.created_at.isoformat(),
            )
            write(session, run_id, analysis, group)
            count += 1
    return count


def known(**attributes: Any) -> dict[str, Any]:
    """Those that are not None, which HDF5 does not have."""
    return {name: value for name, value in attributes.items() if value is not None}


def _add(group: Any, name: str, values: Any, units: str) -> None:
    """One dataset with its unit in ``units``, as NeXus has it; none for None."""
    if values is not None:
        group.create_dataset(name, data=values).attrs["units"] = units


def _frequency_responses(session: Session, run_id: int, analysis: Analysis, group: Any) -> None:
    for measured in list_frequency_responses(session, run_id, analysis.id):
        part = group.create_group(f"set{measured.number}")
        part.attrs.update(
            known(
                response=str(measured.response),
                inputs=[str(dof) for dof in measured.inputs],
                averages=measured.averages,
                peak_force_n=measured.peak_force,
                temperature_c=measured.temperature_c,
                window=measured.window,
                sample_rate_hz=measured.sample_rate,
                block_seconds=measured.block_seconds,
                estimator=measured.estimator,
                excitation=measured.excitation,
                source=measured.source,
            )
        )
        _add(part, "frequency", measured.frequency, "Hz")
        _add(part, "accelerance", measured.accelerance, "(m/s^2)/N")
        _add(part, "coherence", measured.coherence, "1")
        _add(part, "variance", measured.variance, "((m/s^2)/N)^2")


def _modes(session: Session, _run: int, analysis: Analysis, group: Any) -> None:
    modes = get_modes(session, analysis.id)
    group.attrs["dofs"] = [str(dof) for dof in modes.dofs]
    for name, units in (
        ("frequency", "Hz"),
        ("frequency_ci95", "Hz"),
        ("loss_factor", "1"),
        ("loss_factor_ci95", "1"),
        ("predicted_frequency", "Hz"),
        ("shapes", "modal constants of the accelerances"),
        ("pole_covariance", "of [Hz, 1] mode by mode"),
        ("shape_covariance", "of [real, imaginary] of each shape"),
    ):
        _add(group, name, getattr(modes, name), units)


def _joints(session: Session, _run: int, analysis: Analysis, group: Any) -> None:
    for joint in list_joint_matrices(session, analysis.id):
        part = group.create_group(joint.joint)
        part.attrs["node"] = joint.node
        for name in ("stiffness", "stiffness_ci95", "damping", "damping_ci95"):
            _add(part, name, getattr(joint, name), _JOINT_UNITS)
        for name in ("loss_factor", "loss_factor_ci95", "observable"):
            _add(part, name, getattr(joint, name), "1")
        _add(part, "covariance", joint.covariance, "of [k11, k12, k13, k22, k23, k33, h11, ...]")


def _dynamic_stiffness(session: Session, _run: int, analysis: Analysis, group: Any) -> None:
    points = list_dynamic_stiffness(session, analysis.id)
    for each in fields(StoredStiffness):
        column = [getattr(point, each.name) for point in points]
        if each.name in ("flags", "shared_errors"):
            _add(group, each.name, _texts(json.dumps(value) for value in column), "JSON")
        elif each.name in ("specimen", "configuration"):
            _add(group, each.name, _texts(column), "")
        else:
            values = np.array([np.nan if value is None else value for value in column])
            _add(group, each.name, values, _STIFFNESS_UNITS.get(each.name, "1"))


def _texts(values: Iterable[str]) -> list[bytes]:
    return [value.encode() for value in values]


_WRITERS: Mapping[AnalysisKind, Callable[[Session, int, Analysis, Any], None]] = {
    AnalysisKind.FREQUENCY_RESPONSES: _frequency_responses,
    AnalysisKind.MODES: _modes,
    AnalysisKind.JOINT_MATRICES: _joints,
    AnalysisKind.DYNAMIC_STIFFNESS: _dynamic_stiffness,
}
