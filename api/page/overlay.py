"""Results of several runs over each other, which the view of runs shows where the address names them."""

from collections.abc import Mapping, Sequence

from nicegui import ui

from api.page.charts import sines
from api.page.charts.hammer import overlaid
from api.page.controls import chart
from api.page.formatting import moment
from api.page.frame import Frame
from api.page.markup import Cell, Link, filters, paragraph, show, table
from jointlab.errors import EXPECTED
from jointlab.overlay import (
    FEWEST,
    MOST_RUNS,
    RunResults,
    accelerances,
    common_amplitudes,
    common_rows,
    joint_intervals,
    read_results,
    sweeps,
)
from jointlab.report.curves import Ends, curve, loss_factor, stiffness
from jointlab.report.plots import stroke
from jointlab.report.section import ends
from rig.operator import loading_text

MEGA = 1e6
COMMON = f"{FEWEST} of these runs have"


async def build(frame: Frame, runs: Sequence[int], query: Mapping[str, str]) -> None:
    """Build the overlay of the runs with these numbers, at the amplitude and for the row that the address names."""
    back = "<a href='/page/runs'>list of runs</a>"
    if not FEWEST <= len(runs) <= MOST_RUNS:
        show(f"<p class='notice'>Tick {FEWEST} to {MOST_RUNS} runs in the {back}, then press Overlay.</p>")
        return
    try:
        results = await frame.reading(lambda: read_results(frame.services.catalogue, runs))
    except EXPECTED as error:
        frame.tell(str(error))
        return
    show(f"<h2>Runs over each other</h2><p>Chosen in the {back}.</p>")
    show(table("", ("run", "title", "article", "started", "results"), map(_row, results)))
    amplitudes = [f"{each:g}" for each in common_amplitudes(results)]
    rows = {f"{struck} → {response}": (struck, response) for struck, response in common_rows(results)}
    amplitude = _chosen(query.get("amplitude", ""), amplitudes)
    row = _chosen(query.get("row", ""), list(rows))
    fields = {
        name: (label, value, choices)
        for name, label, value, choices in (
            ("amplitude", "Tester at (mm p-p)", amplitude, amplitudes),
            ("row", "Accelerance", row, tuple(rows)),
        )
        if choices
    }
    if fields:
        show(filters(fields, kept={"overlay": [str(run) for run in runs]}))
    looks = {each.name: stroke(index) for index, each in enumerate(results)}
    _tester(results, amplitude, looks)
    show("<h2>Accelerances</h2>")
    if row:
        measured = accelerances(results, rows[row])
        for title, phase in (("Accelerance", False), ("Phase", True)):
            drawn = overlaid(measured, looks, phase=phase)
            chart(f"{title}: {row}, first set of each run", drawn, f"overlay-{title.lower()}", height="24rem")
    else:
        paragraph(f"No {COMMON} an accelerance in common. Identify runs with a hammer session first.")
    _joints(results, looks)


def _chosen(asked: str, choices: Sequence[str]) -> str:
    """The choice that is asked for, or the first one; empty where there is none."""
    return asked if asked in choices else next(iter(choices), "")


def _row(each: RunResults) -> tuple[Cell, ...]:
    known = {"sine points": each.points, "accelerances": each.responses, "joints": each.joints}
    return (
        Link(each.name, f"/page/results?run={each.run.id}"),
        each.run.title,
        each.run.article,
        moment(each.run.began_at),
        ", ".join(name for name, found in known.items() if found) or "none yet",
    )


def _tester(results: Sequence[RunResults], amplitude: str, looks: Mapping[str, sines.Look]) -> None:
    show("<h2>Dynamic stiffness by the tester</h2>")
    measured = sweeps(results, float(amplitude)) if amplitude else {}
    if not measured:
        paragraph(f"No {COMMON} sine points of one joint, in one configuration, at one amplitude.")
        return
    with ui.element("div").classes("cards"):
        for (specimen, configuration), by_run in measured.items():
            where = f"joint {specimen} {loading_text(configuration)}, {amplitude} mm"
            name = f"{specimen}-{configuration}"
            k, gamma = (
                {run: curve(points, quantity) for run, points in by_run.items()}
                for quantity in (stiffness, loss_factor)
            )
            chart(f"k, {where}", sines.over_frequency(k, "k (MN/m)", MEGA, looks), f"overlay-k-{name}")
            chart(f"γ, {where}", sines.over_frequency(gamma, "γ", looks=looks), f"overlay-gamma-{name}")


def _joints(results: Sequence[RunResults], looks: Mapping[str, sines.Look]) -> None:
    show("<h2>Joints by the hammer</h2>")
    if failed := [each.name for each in results if each.failed]:
        paragraph(f"Left out, as their fits failed their checks: {', '.join(failed)}.", "notice")
    found = joint_intervals(results)
    if not found:
        paragraph(f"No {COMMON} a joint's term in common that the hammer determines.")
        return
    runs = [each.name for each in results if any(each.name in own for own in found.values())]
    drawn = sines.intervals(found, {run: looks[run][0] for run in runs})
    height = sines.intervals_height(len(found), len(runs))
    chart("95 % intervals of each run", drawn, "overlay-joints", height=height)
    rows = ((name, *(_interval(name, own.get(run)) for run in runs)) for name, own in found.items())
    show(table("95 % intervals; k in MN/m", ("term, joint", *runs), rows))


def _interval(name: str, found: Ends | None) -> str:
    scale = MEGA if name.startswith("k") else 1.0
    return "–" if found is None else ends([end / scale for end in found], 4)
