"""A truth that is committed to before anybody is asked: its SHA-256 is told at once, what it hashes only afterwards."""

from __future__ import annotations

import hashlib
import json
import secrets
from collections.abc import Mapping
from typing import Any

NONCE_BYTES = 16
"""Of chance in each seal, so that nobody finds a truth by trying all there are."""


def sealed(truth: Mapping[str, Any]) -> dict[str, Any]:
    """A truth with its nonce, ready for JSON: `commitment` is the hash of this."""
    return {"nonce": secrets.token_hex(NONCE_BYTES), "truth": json.loads(json.dumps(truth))}


def commitment(sealed: Mapping[str, Any]) -> str:
    """SHA-256 of a nonce and a truth, in hexadecimal digits."""
    return hashlib.sha256(json.dumps(sealed, sort_keys=True, separators=(",", ":")).encode()).hexdigest()
