"""A run whose process has died: the store calls it running, and nobody writes its records."""

from collections.abc import Iterable
from pathlib import Path

from rig.spool import spools
from store.alarms import NewAlarm
from store.catalogue import Catalogue
from store.runs import Run, latest_of_rig
from store.states import AlarmKind, RunState


def cut_off_run(catalogue: Catalogue, rig: str, folders: Iterable[Path]) -> NewAlarm | None:
    """The alarm where the run that was begun or resumed last on the rig was cut off; None where it was not.

    Args:
        catalogue: with the runs.
        rig: its name.
        folders: where spools of its runs are.
    """
    before = _running(catalogue, rig)
    if before is None or any(_writes(folder, before[0]) for folder in folders) or _running(catalogue, rig) != before:
        return None
    run, events = before
    text = f"run {run.id} ({run.title}) on {rig} was cut off: nothing carries it out any more"
    return NewAlarm(AlarmKind.RUN_CUT_OFF, rig, text, f"run {run.id} cut off, event {events} of its history", run.id)


def _running(catalogue: Catalogue, rig: str) -> tuple[Run, int] | None:
    with catalogue.reading() as session:
        found = latest_of_rig(session, rig)
    return found if found is not None and found[0].state is RunState.RUNNING else None


def _writes(folder: Path, run: Run) -> bool:
    """Whether a spool of the run is there that is written, or not stored yet."""
    stem = Path(run.waveform_file).stem
    return any(path.name.startswith(stem) for path in spools(folder))
