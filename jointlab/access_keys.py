"""Revoking a key without locking everybody out."""

from datetime import UTC, datetime

from sqlalchemy.orm import Session

from jointlab.errors import ConflictError
from store.service.keys import ApiKey, get_key, list_valid_keys, revoke_key
from store.states import Scope


def revoke(session: Session, key_id: int) -> ApiKey:
    """Make a key invalid from now on.

    Raises:
        NotFoundError: there is no such key.
        ConflictError: it is the last valid one that manages keys; only `jointlab key revoke` revokes that.
    """
    managers = {key.id for key in list_valid_keys(session, datetime.now(UTC)) if Scope.ADMIN in key.scopes}
    if managers == {key_id}:
        name = get_key(session, key_id).name
        raise ConflictError(
            f"key {key_id} ({name}) is the last one that manages keys; make another with the scope {Scope.ADMIN} first"
        )
    return revoke_key(session, key_id)
