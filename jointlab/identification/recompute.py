"""Identifying a run as its stored identification was: by the same choices, on the same beam."""

from __future__ import annotations

import numpy as np

from jointlab.identification.inverse import LIKELIHOOD
from jointlab.identification.load import measurement_of_run, with_free_beam
from jointlab.identification.options import options_of
from jointlab.identification.pipeline import Identification, identify
from jointlab.identification.save import OPTIONS
from store.analyses import Analysis, list_analyses
from store.catalogue import Catalogue
from store.joint_matrices import list_joint_matrices
from store.progress import Progress, silent
from store.states import AnalysisKind

ALIKE = 1e-6  # of a stiffness; what another computer's rounding may make of the same records


def identified_as_stored(catalogue: Catalogue, run_id: int, progress: Progress = silent) -> tuple[Identification, str]:
    """The newest stored identification of a run with all that the store has no place for, and a sentence on it.

    It is computed from the run's records by the choices that are stored, which gives the stored numbers; where it does
    not, because blows were taken back since or the software is another, the sentence says so. A run that was not
    identified yet is identified with nothing chosen.

    Raises:
        StoreError, AnalysisError, JointlabError: as for `measurement_of_run` and `identify`.
    """
    stored = _newest(catalogue, run_id)
    chosen = {} if stored is None else dict(stored.settings.get(OPTIONS, {}))
    free_beam = chosen.pop("free_beam", None)
    options = options_of(chosen)
    measurement = measurement_of_run(catalogue, run_id, progress, options.averaging)
    if free_beam not in (None, run_id):
        measurement = with_free_beam(measurement, catalogue, free_beam, progress, options.averaging)
    found = identify(measurement, options)
    if stored is None:
        return found, "It is not stored: the run was not identified before"
    if _is_alike(catalogue, stored, found):
        return found, f"It is that of analysis {stored.id}"
    return found, (
        f"It is not that of analysis {stored.id}: blows were taken back since, or the software is another; identify "
        "the run again to store it"
    )


def _newest(catalogue: Catalogue, run_id: int) -> Analysis | None:
    """The newest joints by maximum likelihood, or the newest sine points of a run without a hammer session."""
    with catalogue.reading() as session:
        joints = list_analyses(session, run_id, AnalysisKind.JOINT_MATRICES)
        points = list_analyses(session, run_id, AnalysisKind.DYNAMIC_STIFFNESS)
    return next((each for each in joints if each.method == LIKELIHOOD), points[0] if points else None)


def _is_alike(catalogue: Catalogue, stored: Analysis, found: Identification) -> bool:
    """Whether the joints are the stored ones; there is nothing that could differ where none were identified."""
    if found.inverse is None or stored.kind != AnalysisKind.JOINT_MATRICES:
        return found.inverse is None
    with catalogue.reading() as session:
        known = {joint.joint: joint for joint in list_joint_matrices(session, stored.id)}
    joints = found.inverse.likelihood.joints
    return set(known) == set(joints) and all(
        bool(np.all(np.abs(known[name].stiffness - joint.stiffness) <= ALIKE * np.max(np.abs(joint.stiffness))))
        for name, joint in joints.items()
    )
