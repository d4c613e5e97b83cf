"""Identification of a run: load, identify and save it, or compute again what was saved."""

import math

import numpy as np

from jointlab.identification.inverse import LIKELIHOOD
from jointlab.identification.load import measurement_of_run
from jointlab.identification.options import AS_MEASURED, Options
from jointlab.identification.pipeline import Identification, identify
from jointlab.identification.save import OPTIONS, save_identification, setup_version_of
from jointlab.identification.sine_points import stored_point
from store.catalogue import Catalogue
from store.progress import Progress, silent
from store.results.analyses import NO_RESULT, Analysis, list_analyses
from store.results.dynamic_stiffness import list_dynamic_stiffness
from store.results.joint_matrices import list_joint_matrices
from store.states import AnalysisKind

ALIKE = 1e-6
"""Largest relative difference of a stiffness that rounding on another computer may cause."""


def identify_run(
    catalogue: Catalogue, run_id: int, options: Options = AS_MEASURED, progress: Progress = silent
) -> Identification:
    """Load the measurement of a run and identify it; nothing is stored.

    Raises:
        StoreError, AnalysisError, JointlabError: as for `measurement_of_run` and `identify`.
    """
    measurement = measurement_of_run(catalogue, run_id, options, progress)
    with progress("identification", 1) as advance:
        found = identify(measurement, options)
        advance(1)
    return found


def identify_and_save(
    catalogue: Catalogue, run_id: int, options: Options = AS_MEASURED, progress: Progress = silent
) -> Identification:
    """Identify a run and store everything in one transaction.

    Raises:
        StoreError, AnalysisError, JointlabError: as for `identify_run`, or the database refuses. Then nothing
            is stored.
    """
    found = identify_run(catalogue, run_id, options, progress)
    with catalogue.writing() as session:
        save_identification(session, run_id, found)
    return found


def recompute(catalogue: Catalogue, run_id: int, progress: Progress = silent) -> tuple[Identification, str]:
    """The newest stored identification of a run with everything that is not stored of it, and a sentence about it.

    It is computed from the run's records with the stored options, which gives the stored numbers. The sentence says so
    where it does not, because blows were taken back since, the setup was amended or the software is another. A run that
    was not identified yet is identified with all options at their defaults.

    Raises:
        StoreError, AnalysisError, JointlabError: as for `identify_run`.
    """
    stored = _newest(catalogue, run_id)
    options = AS_MEASURED if stored is None else Options.of_settings(stored.settings.get(OPTIONS, {}))
    if options.free_beam == run_id:
        options = options.model_copy(update={"free_beam": None})
    found = identify_run(catalogue, run_id, options, progress)
    return found, _standing(catalogue, stored, found)


def standing_of(catalogue: Catalogue, run_id: int, found: Identification) -> str:
    """How `found` compares with the newest stored identification of the run, in a sentence.

    Raises:
        StoreError: the database cannot be read.
    """
    return _standing(catalogue, _newest(catalogue, run_id), found)


def _standing(catalogue: Catalogue, stored: Analysis | None, found: Identification) -> str:
    if stored is None:
        return "It is not stored: the run was not identified before"
    amended = setup_version_of(stored) != found.measurement.setup_version
    if not amended and _is_alike(catalogue, stored, found):
        return f"It is that of analysis {stored.id}"
    why = "blows were taken back or points measured since, or the software is another"
    if amended:
        why = f"the setup was amended since, and this is of its version {found.measurement.setup_version}"
    return f"It is not that of analysis {stored.id}: {why}; identify the run again to store it"


def _newest(catalogue: Catalogue, run_id: int) -> Analysis | None:
    """The newest joints by maximum likelihood, or the newest sine points of a run without a hammer session."""
    with catalogue.reading() as session:
        joints = list_analyses(session, run_id, AnalysisKind.JOINT_MATRICES)
        points = list_analyses(session, run_id, AnalysisKind.DYNAMIC_STIFFNESS)
    return next((each for each in joints if each.method == LIKELIHOOD), points[0] if points else None)


def _is_alike(catalogue: Catalogue, stored: Analysis, found: Identification) -> bool:
    """Whether sine points and joints are the stored ones."""
    return _points_are_alike(catalogue, stored, found) and _joints_are_alike(catalogue, stored, found)


def _points_are_alike(catalogue: Catalogue, stored: Analysis, found: Identification) -> bool:
    """Whether the newest sine points of the run are those that were found."""
    with catalogue.reading() as session:
        newest = next(iter(list_analyses(session, stored.runs[0], AnalysisKind.DYNAMIC_STIFFNESS)), None)
        known = [] if newest is None else list_dynamic_stiffness(session, newest.id)
    points = {each.order_number: each for each in map(stored_point, found.measurement.points)}
    return {each.order_number for each in known} == set(points) and all(
        math.hypot(each.stiffness - own.stiffness, each.damping - own.damping) <= ALIKE * own.magnitude
        for each in known
        for own in [points[each.order_number]]
    )


def _joints_are_alike(catalogue: Catalogue, stored: Analysis, found: Identification) -> bool:
    """Whether the joints are the stored ones; there is nothing that could differ where none were identified."""
    left_out = stored.kind != AnalysisKind.JOINT_MATRICES or NO_RESULT in stored.settings
    if found.inverse is None or left_out:
        return found.inverse is None and left_out
    with catalogue.reading() as session:
        known = {joint.joint: joint for joint in list_joint_matrices(session, stored.id)}
    joints = found.inverse.likelihood.joints
    return set(known) == set(joints) and all(
        bool(np.all(np.abs(known[name].stiffness - joint.stiffness) <= ALIKE * np.max(np.abs(joint.stiffness))))
        for name, joint in joints.items()
    )
