"""Runs and specimens, with filters that stay in the address."""

from datetime import date
from typing import get_args
from urllib.parse import urlencode

from starlette.datastructures import QueryParams

from api.page import history, master, overlay
from api.page.address import number, numbers
from api.page.formatting import WHOLE_LIST, moment, run_state
from api.page.frame import Frame
from api.page.markup import DAY, Cell, Choice, Link, filters, show, table
from jointlab.drive.state import RigState
from store.measurements.runs import Run, day_limits, list_runs
from store.measurements.specimens import Specimen, list_specimens
from store.states import RunKind, RunState

KINDS: tuple[RunKind, ...] = get_args(RunKind)
LARGEST_PAGE = 100
OVERLAY = "overlay"
"""Name of a run to overlay in the address, and id of the form that asks for it."""


async def build(frame: Frame, query: QueryParams) -> None:
    """Build the list that the address asks for."""
    state, kind = query.get("state", ""), query.get("kind", "")
    article, words = query.get("article", ""), query.get("text", "")
    since, until = query.get("since", ""), query.get("until", "")
    specimen = query.get("specimen", "")
    if shown := query.get("history"):
        await history.build(frame, article, shown, query)
        return
    if shown := query.get("master"):
        await master.build(frame, article, shown, query)
        return
    if OVERLAY in query:
        await overlay.build(frame, numbers(query, OVERLAY), query)
        return
    show(
        filters(
            {
                "text": ("Title contains", words, ()),
                "article": ("Test article", article, ()),
                "specimen": ("Joint (specimen)", specimen, ()),
                "state": ("State", state, tuple(RunState)),
                "kind": ("Kind", kind, KINDS),
                "since": ("From", since, DAY),
                "until": ("To", until, DAY),
            }
        )
    )

    first, end = day_limits(_day(since), _day(until), zone=None)  # as the list shows times

    def look() -> tuple[list[Run], list[Specimen]]:
        with frame.services.catalogue.reading() as session:
            found = list_runs(
                session,
                kind=next((each for each in KINDS if each == kind), None),
                state=RunState(state) if state in tuple(RunState) else None,
                article=article or None,
                specimen=specimen or None,
                text=words or None,
                since=first,
                until=end,
                before=number(query, "before"),
                limit=LARGEST_PAGE,
            )
            return found, list_specimens(session, article=article or None, limit=WHOLE_LIST)

    read = await frame.read(look)
    if read is None:
        return
    found, specimens = read
    if not found:
        is_filtered = any((state, kind, article, words, specimen, since, until, query.get("before")))
        said = "No run fits. Take a filter away, or press" if is_filtered else "There is no run yet. Press"
        show(
            f"<p>{said} <a href='/page/measure'>Measure</a> to make one; "
            "<code>jointlab import</code> brings in runs from elsewhere.</p>"
        )
    else:
        rows = [_row(run, frame.services.rig_state, frame.services.rig_name) for run in found]
        show(
            f'<form id="{OVERLAY}" class="row-of" method="get" action="/page/runs">'
            '<button class="act">Overlay the ticked runs</button></form>'
        )
        head = ("run", "overlay", "title", "article", "kind", "state", "reason", "started", "")
        show(table("Runs, newest first", head, rows))
    if len(found) == LARGEST_PAGE:
        asked = {"text": words, "state": state, "kind": kind, "article": article, "since": since, "until": until}
        asked["specimen"] = specimen
        address = f"/page/runs?{urlencode(asked | {'before': found[-1].id})}"
        show(table("Older runs", ("",), [(Link("show older runs", address),)]))
    show("<h2>Specimens</h2>")
    if specimens:
        show(
            table(
                "The cylinders of each joint",
                ("specimen", "test article", "joint", "", "", ""),
                map(_specimen, specimens),
            )
        )
    else:
        show("<p>None yet: a specimen is known from its first sine point or its first identification on.</p>")


def _day(text: str) -> date | None:
    """A day; None for any other text, and for days at which some clock of the world has no year."""
    try:
        day = date.fromisoformat(text)
    except ValueError:
        return None
    return day if date.min.year < day.year < date.max.year else None


def _row(run: Run, rig: RigState | None, name: str | None) -> tuple[Cell, ...]:
    way_on: Cell = ""
    if run.state in (RunState.STOPPED, RunState.FAILED):
        way_on = Link("measure it again", f"/page/measure?like={run.id}")
    return (
        Link(str(run.id), f"/page/results?run={run.id}"),
        Choice(OVERLAY, OVERLAY, str(run.id), f"overlay run {run.id}"),
        run.title,
        Link(run.article, f"/page/runs?{urlencode({'article': run.article})}"),
        run.kind,
        run_state(run, rig, name),
        run.reason or "",
        moment(run.began_at),
        way_on,
    )


def _specimen(specimen: Specimen) -> tuple[Cell, ...]:
    return (
        str(specimen.id),
        Link(specimen.article, f"/page/runs?{urlencode({'article': specimen.article})}"),
        Link(specimen.name, f"/page/runs?{urlencode({'article': specimen.article, 'specimen': specimen.name})}"),
        specimen.description or "",
        Link("history", f"/page/runs?{urlencode({'article': specimen.article, 'history': specimen.name})}"),
        Link("master curve", f"/page/runs?{urlencode({'article': specimen.article, 'master': specimen.name})}"),
    )
