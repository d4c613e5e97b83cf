"""The limits of each rig as they were set last; older ones stay, with who set them."""

from __future__ import annotations

from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from store.models.service import RigLimitsRow


def save_rig_limits(session: Session, rig: str, limits: dict[str, Any], who: str) -> None:
    """Let `limits` be in force at `rig` from now on.

    Raises:
        StoreError: they have no JSON form.
    """
    session.add(RigLimitsRow(rig=rig, limits=limits, who=who))
    session.flush()


def rig_limits(session: Session, rig: str) -> dict[str, Any] | None:
    """The limits in force at `rig`; None where nobody has set any."""
    rows = RigLimitsRow
    return session.scalars(select(rows.limits).filter_by(rig=rig).order_by(rows.id.desc()).limit(1)).one_or_none()
