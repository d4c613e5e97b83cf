"""A truth that is committed to before anybody is asked: its SHA-256 is told at once, what it hashes only afterwards."""

from __future__ import annotations

import hashlib
import json
import secrets
from collections.abc import Mapping
from typing import Any

from simlab.case.bundle import truth
from simlab.case.draw import Case

NONCE_BYTES = 16
"""Of chance in each seal, so that nobody finds a truth by trying all there are."""


def sealed(case: Case) -> dict[str, Any]:
    """The truth of a case with its nonce, ready for JSON: what `commitment` is of."""
    return {"nonce": secrets.token_hex(NONCE_BYTES), "truth": json.loads(json.dumps(truth(case)))}


def commitment(sealed: Mapping[str, Any]) -> str:
    """SHA-256 of a nonce and a truth, in hexadecimal digits."""
    return hashlib.sha256(json.dumps(sealed, sort_keys=True, separators=(",", ":")).encode()).hexdigest()
