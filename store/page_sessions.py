"""Sessions of the technician's page: a random secret in the browser stands for a key until it ends or is logged out.

Only a hash of the secret is stored. A session of a key that has ended or was revoked opens nothing.
"""

import secrets
from datetime import datetime, timedelta

from sqlalchemy import delete, select, update
from sqlalchemy.orm import Session

from store.keys import ApiKey, digest_of, get_key
from store.models.service import PageSessionRow
from store.rows import add_row

KEPT = timedelta(days=30)
"""How long an ended session is kept."""
_SECRET_BYTES = 32


def begin_page_session(session: Session, key: ApiKey, now: datetime, lasts: timedelta) -> str:
    """Begin a session of `key`; its secret, which is stored nowhere. Sessions that ended long ago are forgotten."""
    session.execute(delete(PageSessionRow).where(PageSessionRow.ends_at < now - KEPT))
    secret = secrets.token_urlsafe(_SECRET_BYTES)
    add_row(session, PageSessionRow(digest=digest_of(secret), key_id=key.id, ends_at=now + lasts))
    return secret


def key_of_page_session(session: Session, secret: str, now: datetime) -> ApiKey | None:
    """The key of a session that has not ended, whether or not the key itself is still valid; else None."""
    query = select(PageSessionRow.key_id).where(
        PageSessionRow.digest == digest_of(secret), PageSessionRow.ends_at > now
    )
    number = session.scalars(query).one_or_none()
    return None if number is None else get_key(session, number)


def end_page_session(session: Session, secret: str, now: datetime) -> None:
    """End a session now; one that is not there or has ended stays as it is."""
    found = (PageSessionRow.digest == digest_of(secret), PageSessionRow.ends_at > now)
    session.execute(update(PageSessionRow).where(*found).values(ends_at=now))
