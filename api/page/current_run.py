"""The run that a view shows."""

from collections.abc import Mapping

from api.service.context import Services
from store.runs import list_runs


def current_run(services: Services, query: Mapping[str, str]) -> int | None:
    """The run that the address names, else the present or the latest one; None where there is none."""
    named = query.get("run", "")
    if named.isdecimal():
        return int(named)
    if services.runs is not None and services.runs.state.run_id is not None:
        return services.runs.state.run_id
    with services.catalogue.reading() as session:
        latest = list_runs(session, limit=1)
    return latest[0].id if latest else None
