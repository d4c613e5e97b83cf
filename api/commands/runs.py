"""`jointlab runs` and `jointlab show`: what was measured, as a list and one run by itself."""

from collections import Counter
from datetime import datetime
from typing import Annotated

import typer

from api.commands.terminal import LARGEST_RUN, open_catalogue, out, show_sections, show_table
from jointlab.report.section import Item, Section, Table
from jointlab.sensitivity import stored_sensitivity_text
from store.measurements.amendments import list_amendments
from store.measurements.blows import list_blows
from store.measurements.instruments import list_channels, list_instruments
from store.measurements.runs import day_limits, get_run, list_run_events, list_runs
from store.measurements.sine_records import list_sine_records
from store.results.analyses import list_analyses
from store.states import RunState

PAGE = 20


def runs(
    article: Annotated[str | None, typer.Option(help="Only of this test article.")] = None,
    specimen: Annotated[str | None, typer.Option(help="Only with sines or results of this joint's cylinders.")] = None,
    state: Annotated[RunState | None, typer.Option(help="Only in this state.")] = None,
    since: Annotated[datetime | None, typer.Option(formats=["%Y-%m-%d"], help="Only from this day on, UTC.")] = None,
    until: Annotated[datetime | None, typer.Option(formats=["%Y-%m-%d"], help="Only to the end of this day.")] = None,
    limit: Annotated[int, typer.Option(min=1, max=10_000, help="So many at most.")] = PAGE,
    before: Annotated[int | None, typer.Option(min=1, max=LARGEST_RUN, help="Only before this run.")] = None,
) -> None:
    """List the runs of the catalogue, newest first."""
    first, end = day_limits(since and since.date(), until and until.date())
    with open_catalogue() as catalogue, catalogue.reading() as session:
        found = list_runs(
            session, article=article, specimen=specimen, state=state, since=first, until=end, limit=limit, before=before
        )
    if not found:
        out.print("no run fits")
        return
    rows = tuple((str(run.id), _minute(run.began_at), run.state.value, run.article, run.title) for run in found)
    show_table(Table("Runs, newest first", ("run", "began (UTC)", "state", "article", "title"), rows))
    if len(found) == limit:
        out.print(f"older ones: --before {found[-1].id}")


def show(number: Annotated[int, typer.Argument(metavar="RUN", min=1, max=LARGEST_RUN, help="Its number.")]) -> None:
    """Show one run: how it was measured, what it recorded, what was computed of it, and how it ended."""
    with open_catalogue() as catalogue, catalogue.reading() as session:
        run = get_run(session, number)
        blows, sines = list_blows(session, number), list_sine_records(session, number)
        channels, instruments = list_channels(session, number), list_instruments(session, number)
        analyses, events = list_analyses(session, number), list_run_events(session, number)
        amendments = list_amendments(session, number)
    out.print(f"run {run.id}, {run.state}: {run.title} ({run.article}), rig {run.rig or 'none'}")
    if run.reason:
        out.print(f"reason: {run.reason}")
    struck = Counter((blow.set_number, str(blow.point), blow.accepted) for blow in blows)
    mounted = Counter((each.specimen, each.configuration, each.commanded_pp_mm) for each in sines)
    tables = {
        "How it was measured": (
            Table(
                "Channels",
                ("channel", "input", "sensitivity", "sensor", "calibrated"),
                tuple(
                    (each.name, each.physical, stored_sensitivity_text(each), each.instrument.serial,
                     str(each.instrument.calibrated_on or "–"))
                    for each in channels
                ),
            ),
            Table("Instruments", ("kind", "model", "serial"), tuple((i.kind, i.model, i.serial) for i in instruments)),
            Table(
                "Amendments of the setup",
                ("version", "when (UTC)", "who", "why"),
                tuple((str(each.version), _minute(each.created_at), each.who, each.reason) for each in amendments),
            ),
        ),
        "What it recorded": (
            Table(
                "Blows",
                ("set", "point", "accepted", "refused"),
                tuple(
                    (str(number), point, str(struck[number, point, True]), str(struck[number, point, False]))
                    for number, point in dict.fromkeys(place[:2] for place in struck)
                ),
            ),
            Table(
                "Sine points",
                ("specimen", "configuration", "mm p-p", "points"),
                tuple((*place[:2], f"{place[2]:g}", str(count)) for place, count in mounted.items()),
            ),
        ),
        "What was computed of it": (
            Table(
                "Analyses, newest first",
                ("analysis", "made (UTC)", "kind", "method"),
                tuple((str(each.id), _minute(each.created_at), each.kind, each.method) for each in analyses),
            ),
        ),
        "How it went": (
            Table(
                "History",
                ("when (UTC)", "state", "who", "why"),
                tuple((_minute(e.happened_at), e.state.value, e.who or "", e.reason or "") for e in events),
            ),
        ),
    }  # fmt: skip
    show_sections([Section(title, _filled(content)) for title, content in tables.items()])


def _filled(tables: tuple[Table, ...]) -> tuple[Item, ...]:
    return tuple(table for table in tables if table.rows)


def _minute(at: datetime | None) -> str:
    return "–" if at is None else f"{at:%Y-%m-%d %H:%M}"
