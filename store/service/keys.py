"""API keys with scopes and an expiry, and sessions of the technician's page, each of which stands for a key.

The secret of a key is shown once, that of a session is in the browser; only hashes are stored. A session of a key that
has ended or was revoked opens nothing.
"""

import hashlib
import secrets
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from sqlalchemy import delete, func, select, update
from sqlalchemy.orm import Session

from store.errors import StoreError
from store.models.rows import add_row, from_row, get_row, newest_first
from store.models.service import ApiKeyRow, PageSessionRow
from store.states import Scope

PREFIX = "jl_"
KEPT = timedelta(days=30)
"""How long an ended session is kept."""
_SECRET_BYTES = 32


@dataclass(frozen=True)
class ApiKey:
    """A key, without its secret; times are UTC."""

    id: int
    name: str
    scopes: frozenset[Scope]
    created_at: datetime
    expires_at: datetime | None
    revoked_at: datetime | None

    def is_valid(self, now: datetime) -> bool:
        """Whether it opens anything at `now`."""
        return self.revoked_at is None and (self.expires_at is None or now < self.expires_at)


def add_key(
    session: Session, name: str, scopes: Iterable[Scope], expires_at: datetime | None = None
) -> tuple[ApiKey, str]:
    """Create a key, and return it with its secret, which is stored nowhere.

    Raises StoreError if the name or the scopes are empty, or the key would have expired already.
    """
    opened = frozenset(scopes)
    if not name.strip() or not opened:
        raise StoreError("a key needs a name and at least one scope")
    if expires_at is not None and expires_at <= datetime.now(UTC):
        raise StoreError(f"a key that ends at {expires_at:%Y-%m-%d %H:%M} UTC would open nothing; give a later time")
    secret = PREFIX + secrets.token_urlsafe(_SECRET_BYTES)
    row = ApiKeyRow(name=name, digest=digest_of(secret), scopes=sorted(opened), expires_at=expires_at)
    return _key(add_row(session, row)), secret


def find_key(session: Session, secret: str) -> ApiKey | None:
    """The key of a secret, valid or not; None where there is none.

    The secret is looked up by its hash, which is of 256 random bits: neither a salt nor a slow hash would add anything.
    """
    row = session.scalars(select(ApiKeyRow).filter_by(digest=digest_of(secret))).one_or_none()
    return None if row is None else _key(row)


def get_key(session: Session, key_id: int) -> ApiKey:
    """One key, or NotFoundError."""
    return _key(get_row(session, ApiKeyRow, key_id, "key"))


def list_keys(session: Session, *, before: int | None = None, limit: int = 100) -> list[ApiKey]:
    """Keys, newest first, with those that were revoked or have expired; a page begins before the number `before`."""
    return [_key(row) for row in session.scalars(newest_first(select(ApiKeyRow), ApiKeyRow.id, before, limit))]


def list_valid_keys(session: Session, now: datetime) -> list[ApiKey]:
    """Keys that open something at `now`, oldest first."""
    rows = session.scalars(select(ApiKeyRow).filter_by(revoked_at=None).order_by(ApiKeyRow.id))
    return [key for key in map(_key, rows) if key.is_valid(now)]


def count_keys(session: Session) -> int:
    """Number of keys that were ever made. Without any, access is open."""
    return session.scalar(select(func.count()).select_from(ApiKeyRow)) or 0


def revoke_key(session: Session, key_id: int) -> ApiKey:
    """Make a key invalid from now on, or NotFoundError; revoking it again changes nothing."""
    row = get_row(session, ApiKeyRow, key_id, "key")
    row.revoked_at = row.revoked_at or datetime.now(UTC)
    session.flush()
    return _key(row)


def digest_of(secret: str) -> str:
    """The hash by which a secret of 256 random bits is stored."""
    return hashlib.sha256(secret.encode()).hexdigest()


def _key(row: ApiKeyRow) -> ApiKey:
    return from_row(ApiKey, row, scopes=frozenset(map(Scope, row.scopes)))


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
