"""The limits of each rig; the newest row is in force, and older ones stay with the names of those who set them."""

from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from store.models.rows import add_row
from store.models.service import RigLimitsRow


def save_rig_limits(session: Session, rig: str, limits: dict[str, Any], who: str) -> None:
    """Put `limits` in force at `rig` from now on; StoreError where they have no JSON form."""
    add_row(session, RigLimitsRow(rig=rig, limits=limits, who=who))


def rig_limits(session: Session, rig: str) -> dict[str, Any] | None:
    """The limits in force at `rig`; None if there are none."""
    rows = RigLimitsRow
    return session.scalars(select(rows.limits).filter_by(rig=rig).order_by(rows.id.desc()).limit(1)).one_or_none()
