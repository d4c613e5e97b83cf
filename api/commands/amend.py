"""`jointlab amend`: correct the article of a run after the measurement."""

from typing import Annotated

import typer

from api.commands.terminal import LARGEST_RUN, open_catalogue, out
from jointlab.audit import AuditedAction
from jointlab.runs.amendment import amend_article, changes_of
from store.measurements.amendments import Amendment
from store.provenance import who_is_here


def amend(
    run: Annotated[int, typer.Argument(min=1, max=LARGEST_RUN, help="Number of the run.")],
    values: Annotated[
        list[str], typer.Argument(metavar="KEY=VALUE...", help="Values of its article, such as beam.length=0.914.")
    ],
    reason: Annotated[str, typer.Option(help="What was wrong; kept with the new version.")],
) -> None:
    """Correct values of the article of a run; records and earlier results stay as they are.

    A value is JSON. What holds a list is given as a whole: joints='[{"name": "I", ...}, ...]'.
    """
    changes, who = changes_of(values), who_is_here()
    action = AuditedAction(who, "amend setup", f"run {run}", details={"article": changes, "reason": reason})
    with open_catalogue() as catalogue:

        def store() -> Amendment:
            with catalogue.writing() as session:
                return amend_article(session, run, changes, reason=reason, who=who)

        version = action.carry_out(catalogue, None, store).version
    out.print(
        f"run {run} has version {version} of its setup; jointlab identify {run} computes results of it, beside the "
        "earlier ones"
    )
