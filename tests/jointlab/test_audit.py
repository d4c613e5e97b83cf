"""Actions and their outcome in the audit log."""

from typing import Any
from unittest.mock import Mock

import pytest

from jointlab.audit import AuditedAction
from rig.errors import RigError
from store.errors import StoreError


def test_why_an_action_failed_is_told_although_it_cannot_be_noted() -> None:
    away: Any = Mock(write=Mock(side_effect=StoreError("the database does not answer")))
    pause = Mock(side_effect=RigError("the actuator was not confirmed at rest"))
    with pytest.raises(RigError, match="not confirmed at rest") as told:
        AuditedAction("ann", "pause run", "run 7", moves=True).carry_out(away, 1, pause)
    assert told.value.__notes__ == ["this is not in the audit log: the database does not answer"]
