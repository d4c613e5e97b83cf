"""Master curves in the store: each comes back, newest first, by article and specimen."""

from dataclasses import fields, replace

import pytest

from store.catalogue import Catalogue
from store.errors import NotFoundError, StoreError
from store.results.analyses import add_analysis
from store.results.master_curves import (
    StoredMasterSummary,
    add_master_curve,
    get_master_curve,
    list_master_curves,
)
from store.states import AnalysisKind
from tests.store.conftest import master_curve


def test_a_master_curve_comes_back_and_lists_have_it_in_short(catalogue: Catalogue, filled: int) -> None:
    with catalogue.reading() as session:
        (listed,) = list_master_curves(session, article="beam 3", specimen="I")
        found = get_master_curve(session, listed.analysis_id)
        assert list_master_curves(session, specimen="II") == list_master_curves(session, article="beam 4") == []
    assert replace(found, created_at=None) == master_curve(listed.analysis_id)
    assert found.created_at is not None
    assert {each.name: getattr(found, each.name) for each in fields(StoredMasterSummary)} == {
        each.name: getattr(listed, each.name) for each in fields(listed)
    }
    with catalogue.reading() as session, pytest.raises(NotFoundError, match="no master curve 99"):
        get_master_curve(session, 99)
    with pytest.raises(StoreError), catalogue.writing() as session:
        add_master_curve(session, master_curve(listed.analysis_id))


def test_the_newest_master_curve_is_the_first_of_a_page(catalogue: Catalogue, filled: int) -> None:
    with catalogue.writing() as session:
        again = add_analysis(session, kind=AnalysisKind.MASTER_CURVES, method="a method", settings={}, runs=[filled])
        add_master_curve(session, master_curve(again))
    with catalogue.reading() as session:
        newest, older = list_master_curves(session)
        assert newest.analysis_id == again > older.analysis_id
        assert list_master_curves(session, limit=1) == [newest]
        assert list_master_curves(session, before=again) == [older]
