"""Limits of a rig: the newest are in force, older ones stay."""

import pytest
from sqlalchemy import text

from store.catalogue import Catalogue
from store.errors import StoreError
from store.service.rig_limits import rig_limits, save_rig_limits


def test_the_limits_that_were_set_last_are_in_force_at_their_own_rig(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        assert rig_limits(session, "rig") is None
        save_rig_limits(session, "rig", {"force": 2e3}, "ann")
        save_rig_limits(session, "rig", {"force": 1e3}, "bob")
        save_rig_limits(session, "other", {"force": 3e3}, "bob")
    with catalogue.reading() as session:
        assert rig_limits(session, "rig") == {"force": 1e3}
        assert rig_limits(session, "none") is None


@pytest.mark.parametrize("statement", ["UPDATE rig_limits SET who = 'another'", "DELETE FROM rig_limits"])
def test_limits_that_were_in_force_are_never_changed(catalogue: Catalogue, filled: int, statement: str) -> None:
    with pytest.raises(StoreError, match="never changed or deleted"), catalogue.writing() as session:
        session.execute(text(statement))
