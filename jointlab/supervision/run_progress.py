"""Progress of any run: when its points were taken, how long the rest takes, and whether it was cut off."""

from collections.abc import Sequence
from datetime import datetime
from itertools import pairwise
from statistics import median

from jointlab.drive.state import RigState
from store.catalogue import Catalogue
from store.measurements.blows import list_blows
from store.measurements.runs import Run
from store.measurements.sine_records import list_sine_records
from store.states import RunState

LATEST = 20  # points that show the pace


def points_taken(catalogue: Catalogue, run_id: int) -> list[tuple[datetime, float | None]]:
    """Time and temperature (degrees Celsius) of each accepted blow and each sine point of a run, in order of time."""
    with catalogue.reading() as session:
        blows, records = list_blows(session, run_id), list_sine_records(session, run_id)
    struck = [(blow.struck_at, blow.temperature_c) for blow in blows if blow.accepted]
    recorded = [(record.recorded_at, record.temperature_c) for record in records]
    return sorted((at, celsius) for at, celsius in (*struck, *recorded) if at is not None)


def time_left(times: Sequence[datetime], left: int) -> float | None:
    """Seconds that `left` more points take at the pace of the `LATEST` ones; None where there is no pace yet, or
    nothing is left.

    The pace is the median of the gaps between points, so that a pause, a mounting or a night between does not count.
    """
    recent = sorted(times)[-LATEST - 1 :]
    if left <= 0 or len(recent) < 2:
        return None
    return left * median((later - earlier).total_seconds() for earlier, later in pairwise(recent))


def is_cut_off(run: Run, rig: RigState | None, name: str | None) -> bool:
    """Whether the process that carried `run` out has died: the store calls it running, but its rig does not run it.

    Args:
        run: of any rig.
        rig: the state of the rig of this service; None where it drives none, and cannot know.
        name: of that rig; of runs of others it cannot know.
    """
    if run.state is not RunState.RUNNING or rig is None or run.rig not in (None, name):
        return False
    return not rig.phase.is_of_a_run or rig.run_id != run.id
