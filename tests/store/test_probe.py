"""The state of the database is known without waiting for it, also where it is silent."""

from pathlib import Path

import pytest

from store.catalogue import Catalogue
from store.database.time_limits import TimeLimits
from store.probe import DatabaseProbe
from tests.fault_proxy import FaultProxy, Impairment, Way
from tests.waiting import until


def test_a_database_that_answers_is_known_to(catalogue: Catalogue) -> None:
    with DatabaseProbe(catalogue, 0.01) as probe:
        until(lambda: probe.state.answers is True)
        assert probe.state.why is None


@pytest.mark.parametrize("database_kind", ["postgresql"])
def test_a_silent_database_is_told_at_once_and_so_is_its_return(
    distant_url: str, proxy: FaultProxy, tmp_path: Path
) -> None:
    with (
        Catalogue.open(distant_url, tmp_path, TimeLimits(connect=1.0, answer=2.0)) as opened,
        DatabaseProbe(opened, 0.01) as probe,
    ):
        until(lambda: probe.state.answers is True)
        proxy.impair(Impairment(lost=Way.BOTH))
        until(lambda: probe.state.answers is False)
        state = probe.state
        assert state.why is not None
        assert "has not answered" in state.why
        proxy.repair()
        until(lambda: probe.state.answers is True)
