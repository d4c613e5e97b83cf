"""Amendments of a run's setup: corrected descriptions of how it was measured. Records and results stay as they are."""

from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from store.errors import NotFoundError
from store.models.measurements import RunRow, SetupAmendmentRow
from store.models.rows import add_row, from_row, get_row

AS_MEASURED = 1
"""Version of the setup that a run was measured with."""


@dataclass(frozen=True)
class Amendment:
    """A version of a run's setup, from 2; `setup` is whole, and in the form of a bundle's setup.json."""

    version: int
    setup: dict[str, Any]
    reason: str
    who: str
    created_at: datetime


def lock_setup(session: Session, run_id: int) -> None:
    """Let nobody else amend the setup of the run until this transaction ends. NotFoundError if there is no such run."""
    get_row(session, RunRow, run_id, "run", for_update=True)


def amend_setup(session: Session, run_id: int, setup: dict[str, Any], *, reason: str, who: str) -> Amendment:
    """Store `setup` as that of the run from now on. Raises NotFoundError if there is no such run."""
    version = AS_MEASURED + 1 + len(list_amendments(session, run_id))
    row = SetupAmendmentRow(run_id=run_id, version=version, setup=setup, reason=reason, who=who)
    return from_row(Amendment, add_row(session, row))


def list_amendments(session: Session, run_id: int) -> list[Amendment]:
    """The amendments of a run's setup, oldest first; NotFoundError where there is no such run."""
    get_row(session, RunRow, run_id, "run")
    rows = select(SetupAmendmentRow).filter_by(run_id=run_id).order_by(SetupAmendmentRow.version)
    return [from_row(Amendment, row) for row in session.scalars(rows)]


def setup_of_version(session: Session, run_id: int, version: int) -> dict[str, Any]:
    """The setup of a run as it was in force with `version`; NotFoundError where there is none."""
    if version == AS_MEASURED:
        return get_row(session, RunRow, run_id, "run").setup
    row = session.scalars(select(SetupAmendmentRow).filter_by(run_id=run_id, version=version)).one_or_none()
    if row is None:
        raise NotFoundError(f"run {run_id} has no version {version} of its setup")
    return row.setup
