"""Orders of runs: what the catalogue says about a run, as the rig needs it to carry the run out."""

from typing import Any

from jointlab.runs.completed import completed_points
from jointlab.sequences import sequence_of
from rig.runs.completed_points import ResumeError
from rig.runs.records import BegunWith, RunOrder
from rig.sequences.sequence import Sequence
from rig.sequences.steps import check_plan
from rig.tester.limits import TesterLimits
from store.catalogue import Catalogue
from store.measurements.instruments import list_channels, list_instruments
from store.measurements.runs import Run, check_rig, get_run, start_run
from store.provenance import who_is_here
from store.states import RunState

KIND = "sequence"
RESUMED_WITHOUT_END = (
    "resumed; how it ended before could not be stored: its process was lost, or nothing could be written"
)


def plan_run(
    sequence: Sequence,
    limits: TesterLimits,
    catalogue: Catalogue,
    who: str | None = None,
    *,
    rig: str,
    provisional: bool = False,
) -> Run:
    """Store a run that `rig` carries out later; no instrument is connected. `provisional`: as for `start_run`.

    Raises PlanError, LimitExceededError where a step asks for something impossible, StoreError where it cannot be
    stored.
    """
    check_plan(sequence, limits)
    setup: dict[str, Any] = sequence.article.model_dump(mode="json")
    if sequence.sweep is not None:
        setup["direct"] = {"file": "direct.csv", "preset_mm": sequence.sweep.preset_mm}
    with catalogue.writing() as session:
        return start_run(
            session,
            kind=KIND,
            title=sequence.title,
            article=sequence.article_name,
            setup=setup,
            sequence=sequence.model_dump(mode="json"),
            who=who or who_is_here(),
            state=RunState.CREATED,
            provisional=provisional,
            rig=rig,
        )


def order_to_begin(
    run: Run, *, rig: str, reset: bool = False, who: str | None = None, planned: bool = True
) -> RunOrder:
    """The order for a run that was planned for `rig`; its seed is drawn. Attributes as those of `RunOrder`.

    Raises WrongRigError where it was planned for another rig.
    """
    check_rig(run, rig)
    sequence = sequence_of(run)
    assert sequence is not None, "it was planned with one"
    return RunOrder(run.id, run.waveform_file, sequence.with_seed(), who or who_is_here(), planned=planned, reset=reset)


def order_to_resume(
    catalogue: Catalogue, run_id: int, limits: TesterLimits, *, rig: str, reset: bool = False, who: str | None = None
) -> RunOrder:
    """The order for the rest of a run that was stopped, failed or lost its process.

    Raises:
        ResumeError: the run is finished or was not measured here.
        WrongRigError: the run belongs to another rig than `rig`.
        PlanError, LimitExceededError: a step asks for something that is impossible now.
        StoreError: there is no such run, or it cannot be read.
    """
    with catalogue.reading() as session:
        run = get_run(session, run_id)
        channels, instruments = list_channels(session, run_id), list_instruments(session, run_id)
    if run.kind != KIND or run.state in (RunState.FINISHED, RunState.CREATED):
        why = f"is {run.state}" if run.kind == KIND else "was not measured from a sequence here"
        raise ResumeError(f"run {run_id} {why}; there is nothing to resume")
    check_rig(run, rig)
    sequence = sequence_of(run)
    assert sequence is not None, "it was measured by one"
    check_plan(sequence, limits)
    reason = RESUMED_WITHOUT_END if run.state is RunState.RUNNING else f"resumed after it was {run.state}"
    return RunOrder(
        run_id,
        run.waveform_file,
        sequence,
        who or who_is_here(),
        completed_points(catalogue, run, sequence),
        BegunWith(run.started_at, tuple(channels), tuple(instruments), reason),
        reset=reset,
    )
