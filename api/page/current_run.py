"""Which run a view is about."""

from __future__ import annotations

from collections.abc import Mapping

from api.service.context import Services
from store.runs import list_runs


def current_run(services: Services, query: Mapping[str, str]) -> int | None:
    """The run that the address names, else the one that is carried out or was last; None where there is none."""
    asked = query.get("run", "")
    if asked.isdecimal():
        return int(asked)
    if services.runs is not None and services.runs.state.run_id is not None:
        return services.runs.state.run_id
    with services.catalogue.reading() as session:
        latest = list_runs(session, limit=1)
    return latest[0].id if latest else None
