"""How far each spool is stored, so that a record on the local disk is stored once, however often it is tried.

The number of the last stored record is stored in the transaction that stores the record itself.
"""

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from store.errors import StoreError
from store.models.measurements import BlowRow, PointRow, SineRecordRow
from store.models.rows import found_or_added
from store.models.service import SpoolRow


def last_stored(session: Session, spool: str) -> int:
    """Number of the last stored record of the spool of this name; 0 where none is stored."""
    return session.scalars(select(SpoolRow.last_stored).filter_by(name=spool)).one_or_none() or 0


def advance_spool(session: Session, spool: str, before: int, last: int) -> None:
    """Note that the records after number `before` up to `last` are stored in this transaction.

    Raises StoreError where another process has stored records after `before`.
    """
    known = select(SpoolRow).filter_by(name=spool).with_for_update()
    row, _ = found_or_added(session, known, lambda: SpoolRow(name=spool, last_stored=0))
    if row.last_stored != before:
        raise StoreError(f"spool {spool}: another process has stored its records up to {row.last_stored}")
    row.last_stored = last
    session.flush()


def last_waveform(session: Session, run_id: int) -> int:
    """The highest number of a waveform record that a blow or sine point of the run refers to; 0 where none does."""
    blows = select(func.max(BlowRow.waveform_record)).join(PointRow, PointRow.id == BlowRow.point_id)
    sines = select(func.max(SineRecordRow.waveform_record)).filter_by(run_id=run_id)
    return max(session.scalar(blows.where(PointRow.run_id == run_id)) or 0, session.scalar(sines) or 0)
