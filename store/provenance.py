"""Where a stored row comes from: a hash of its configuration, and who stored it."""

import getpass
import hashlib
import json
import os
import socket
from typing import Any

from store.errors import StoreError


def to_json(document: Any) -> str:
    """JSON text of plain values; StoreError for NaN, infinity and objects that have no JSON form."""
    try:
        return json.dumps(document, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise StoreError(f"a configuration cannot be stored as JSON: {error}") from error


def configuration_hash(document: Any) -> str:
    """SHA-256 of the document as JSON with sorted keys; StoreError if it has no JSON form."""
    to_json(document)
    canonical = json.dumps(document, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(canonical.encode()).hexdigest()


def who_is_here() -> str:
    """Person, computer and process, for histories."""
    try:
        person = getpass.getuser()
    except (KeyError, OSError):  # a computer without names for its users
        person = "somebody"
    return f"{person}@{socket.gethostname()}, process {os.getpid()}"
