"""One part of the view of results, and where its numbers come from."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from api.page.formatting import moment
from api.page.markup import Link, details, show, terms
from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.measurements.runs import Run
from store.results.analyses import Analysis, list_analyses

ReadT = TypeVar("ReadT")


@dataclass(frozen=True)
class Part(Generic[ReadT]):
    """One part.

    Attributes:
        title: its heading, which is also its name in the address.
        missing: the step to take first where there are no results.
        needs: the kind of step without which a run never has these results; empty where it takes more than one.
        read: reads the results of a run; raises NotFoundError where there are none.
        draw: puts them on the page.
    """

    title: str
    missing: str
    needs: str
    read: Callable[[Catalogue, Run], ReadT]
    draw: Callable[[Run, ReadT], None]


def analyses_of(catalogue: Catalogue, run: Run, kind: str) -> list[Analysis]:
    """The analyses of a kind of a run, newest first."""
    return catalogue.read(list_analyses, run.id, kind)


def newest_of(catalogue: Catalogue, run: Run, kind: str, what: str) -> Analysis:
    """The newest analysis of a kind of a run.

    Raises:
        NotFoundError: the run has no `what`.
    """
    analyses = analyses_of(catalogue, run, kind)
    if not analyses:
        raise NotFoundError(f"run {run.id} has no {what}")
    return analyses[0]


def where_known(read: Callable[[Catalogue, Run], ReadT], catalogue: Catalogue, run: Run) -> ReadT | None:
    """The result of `read` for a run; None where it is not stored, or the article is not known."""
    try:
        return read(catalogue, run)
    except NotFoundError:
        return None


def show_origin(analysis: Analysis) -> None:
    """Where the numbers above come from, one click away."""
    show(details("Where is this from?", terms(origin(analysis))))


def origin(analysis: Analysis) -> dict[str, str | Link]:
    """Terms on the origin of an analysis."""
    settings = ", ".join(f"{name} = {_short(value)}" for name, value in analysis.settings.items())
    return {
        "analysis": f"{analysis.id}, {analysis.kind}",
        "method": analysis.method,
        "settings": settings or "none",
        "made from": ", ".join(
            [*(f"run {run}" for run in analysis.runs), *(f"analysis {parent}" for parent in analysis.parents)]
        ),
        "made at": moment(analysis.created_at),
        "software": analysis.software_version,
        "configuration": analysis.configuration_hash,
    }


def _short(value: Any) -> str:
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return text if len(text) < 120 else f"{text[:117]}…"
