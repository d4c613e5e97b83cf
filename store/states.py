"""Enumerations of the catalogue that programs without a database need, too. This module imports nothing heavy."""

from enum import StrEnum
from typing import Literal, get_args


class RunState(StrEnum):
    """State of a run. A finished run stays finished; a stopped or failed one may be resumed."""

    CREATED = "created"
    RUNNING = "running"
    FINISHED = "finished"
    STOPPED = "stopped"
    FAILED = "failed"


RunKind = Literal["sequence", "import"]
"""How a run came into the catalogue: measured from a sequence, or imported."""


class JobState(StrEnum):
    """State of a job."""

    QUEUED = "queued"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


class AlarmKind(StrEnum):
    """Cause of an alarm."""

    RUN_ENDED = "run_ended"
    RUN_CUT_OFF = "run_cut_off"
    DRIVE_SILENT = "drive_silent"
    TESTER_SILENT = "tester_silent"
    TESTER_TRIPPED = "tester_tripped"
    RUN_STUCK = "run_stuck"
    DATABASE_AWAY = "database_away"
    JOB_FAILED = "job_failed"
    AUDIT_DAMAGED = "audit_damaged"
    RECORD_REFUSED = "record_refused"
    TEST = "test"


ENDED_JOB_STATES = frozenset({JobState.DONE, JobState.FAILED, JobState.CANCELLED})
"""States of a job that will not change any more."""

OPEN_JOB_STATES = frozenset(JobState) - ENDED_JOB_STATES
"""States of a job that waits or runs. Queries use these, as an index does not find rows by inequality."""


class Verdict(StrEnum):
    """Verdict of an examination of a rig; incomplete: nothing failed, and something was not done."""

    PASSED = "passed"
    INCOMPLETE = "incomplete"
    FAILED = "failed"


class AnalysisKind(StrEnum):
    """Kind of an analysis; the value is also the name of the table with its results."""

    FREQUENCY_RESPONSES = "frequency_responses"
    MODES = "modes"
    JOINT_MATRICES = "joint_matrices"
    DYNAMIC_STIFFNESS = "dynamic_stiffness"
    COMPARISONS = "comparisons"
    DIAGNOSES = "diagnoses"
    MASTER_CURVES = "master_curves"


class Scope(StrEnum):
    """Permission of a key. No scope includes another one."""

    READ = "read:data"
    ANALYSE = "run:analysis"
    CONTROL = "control:rig"
    ENGINEER = "engineer"
    ADMIN = "admin"


Excitation = Literal["hammer", "sine"]
"""Excitation of a set of accelerances: a roving hammer, or a shaker that stays while the accelerometer roves."""
HAMMER: Excitation = "hammer"
SINE: Excitation = "sine"

ConfigurationName = Literal["compression", "shear", "angled"]
CONFIGURATIONS: tuple[ConfigurationName, ...] = get_args(ConfigurationName)
BLANK = "blank"
"""Configuration of a known piece in place of a specimen, by which the tester is calibrated."""


class InvestigationState(StrEnum):
    """What an investigation of a gap does at present."""

    WORKING = "working"
    """It diagnoses, or waits for its turn."""
    WAITING = "waiting"
    """It waits for an answer."""
    ENDED = "ended"
    """The verdict is certain enough, nothing would help, or the budget is spent."""
    STOPPED = "stopped"
    """A person has stopped it; it may go on."""
    FAILED = "failed"
    """Its last diagnosis has failed; it may go on, with the same answer or another one."""
