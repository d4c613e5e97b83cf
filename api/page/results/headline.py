"""The card at the top of the results: each joint by both experiments, what disagrees, and the verdict on the gap."""

from html import escape

from nicegui import ui

from api.page.frame import DATABASE_AWAY, Frame
from api.page.markup import Link, anchor, details, paragraph, show, table
from jointlab.errors import EXPECTED
from jointlab.report.headline import Headline, comparison_sentence, gap_sentence, joint_table, read_headline
from jointlab.report.summary import DO_NOT_RELY
from store.measurements.runs import Run
from store.states import RunState

ACTIONS = "actions"
"""The id of the place where jobs of the run are asked for."""
VALUES = "k, h and γ of each joint, with 95 % intervals"
READING = (
    "✓: both agree, ✗: they differ. The tester is carried to the amplitude that the blows caused; its h is k times γ, "
    "between the smallest and the largest that both intervals allow."
)


async def fill(frame: Frame, run: Run, place: ui.element, *, is_open: bool) -> None:
    """Read the headline of a run and draw it; with `is_open` the values of the joints are shown at once.

    Raises:
        SilentError, ConnectionLostError: the database does not answer (`DATABASE_AWAY`).
    """
    try:
        found = await frame.reading(lambda: read_headline(frame.services.catalogue, run))
    except DATABASE_AWAY:
        raise
    except EXPECTED as error:
        frame.tell(str(error))
        return
    place.clear()
    with place:
        _draw(run, found, is_open)


def _draw(run: Run, found: Headline, is_open: bool) -> None:
    show("<h2>In short</h2>")
    if not found.joints and found.diagnosis is None:
        show(f"<p>{_nothing(run)}</p>")
        return
    if found.failed:
        paragraph(f"The fit to the accelerances failed its checks. {DO_NOT_RELY}", "notice trouble")
    differ = any(each.verdict == "differ" for each in found.compared)
    paragraph(comparison_sentence(found.compared, found.not_compared), "notice" if differ else "")
    gap = escape(gap_sentence(None if found.diagnosis is None else found.diagnosis.document))
    if found.diagnosis is not None:
        gap += f" {anchor(Link('See the diagnosis', f'/page/gap?diagnosis={found.diagnosis.analysis_id}'))}"
    show(f"<p>{gap}</p>")
    if found.joints:
        tables = (joint_table(found, name) for name in found.joints)
        drawn = "".join(table(made.caption, made.head, made.rows) for made in tables)
        how = f"<p class='quiet'>{READING}</p>" if found.compared else ""
        show(details(VALUES, f'<div class="cards compact">{drawn}</div>{how}', is_open=is_open))


def _nothing(run: Run) -> str:
    if run.state is RunState.CREATED:
        return "This run has not begun, so that it has no results."
    return f'No results yet: nothing of this run was identified. Press Identify under <a href="#{ACTIONS}">actions</a>.'
