"""A form that corrects the article of a run, as `jointlab amend` does; what is wrong is said at its field."""

from collections.abc import Callable

from nicegui import ui
from pydantic import ValidationError

from api.page.controls import button
from api.page.frame import Frame
from api.page.markup import paragraph, show
from api.service.access import Caller
from jointlab.documents.runs import NewAmendment
from jointlab.errors import JointlabError
from jointlab.runs.amendment import amend_article, changes_of
from store.measurements.amendments import Amendment
from store.measurements.runs import Run
from store.states import Scope

EXAMPLE = "beam.length=0.914"


def amendment_form(frame: Frame, run: Run, redraw: Callable[[], None]) -> None:
    """The form; `redraw` is called when the run has a new version of its setup."""
    show("<h2>Correct the article</h2>")
    paragraph(
        "Records and earlier results stay. Identify the run again afterwards: new results are stored beside them."
    )
    show(f"<p>Write one value a line, such as <code>{EXAMPLE}</code>.</p>")
    values = ui.textarea("Values of the article").props("outlined autogrow")
    reason = ui.input("Reason: what was wrong").props("outlined")

    def tell(text: str) -> None:
        values.error = text or None

    async def amend() -> None:
        values.error = reason.error = None
        try:
            changes = changes_of([line.strip() for line in (values.value or "").splitlines() if line.strip()])
            given = NewAmendment(article=changes, reason=(reason.value or "").strip())
        except JointlabError as error:
            values.error = str(error)
            return
        except ValidationError as error:
            wrong = {item["loc"][0] for item in error.errors()}
            values.error = f"write key=value, such as {EXAMPLE}" if "article" in wrong else None
            reason.error = "say in one line what was wrong" if "reason" in wrong else None
            return

        def store(caller: Caller) -> Amendment:
            with frame.services.catalogue.writing() as session:
                return amend_article(session, run.id, given.article, reason=given.reason, who=caller.name)

        actions = frame.actions.telling(tell)
        made = await actions.act(Scope.CONTROL, "amend setup", f"run {run.id}", store, **given.model_dump())
        if made is not None:
            redraw()

    for field in (values, reason):
        field.classes("w-full").props("hide-bottom-space")  # what is wrong may take several lines
    button("Amend", amend)
