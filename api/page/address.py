"""The run and the numbers that the address of a view names."""

from collections.abc import Mapping

from starlette.datastructures import QueryParams

from api.service.context import Services
from jointlab.documents.fields import LARGEST
from store.errors import NotFoundError
from store.measurements.runs import list_runs


def number(query: Mapping[str, str], name: str) -> int | None:
    """The number that the address has under this name; None where it has none.

    Raises:
        NotFoundError: nothing can have that number, or it is none.
    """
    text = query.get(name, "")
    found = _number(text, name)
    if found is None and text:
        raise _nothing_has(text, name)
    return found


def numbers(query: QueryParams, name: str) -> tuple[int, ...]:
    """The numbers that the address has under this name, each once, in their order; what is no number is left out.

    Raises:
        NotFoundError: nothing can have one of them.
    """
    found = (_number(text, name) for text in query.getlist(name))
    return tuple(dict.fromkeys(each for each in found if each is not None))


def _number(text: str, name: str) -> int | None:
    if not (text.isascii() and text.isdecimal()):
        return None
    if len(text) > len(str(LARGEST)) or not 1 <= int(text) <= LARGEST:
        raise _nothing_has(text, name)
    return int(text)


def _nothing_has(text: str, name: str) -> NotFoundError:
    return NotFoundError(f"nothing has the number {text[:20]} that the address gives as {name}")


def current_run(services: Services, query: Mapping[str, str]) -> int | None:
    """The run that the address names, else the present or the latest one; None where there is none.

    Raises:
        NotFoundError: no run can have that number.
    """
    named = number(query, "run")
    if named is not None:
        return named
    if services.runs is not None and services.runs.state.run_id is not None:
        return services.runs.state.run_id
    latest = services.catalogue.read(list_runs, limit=1)
    return latest[0].id if latest else None
