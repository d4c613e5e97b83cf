"""A run on its instruments while the connections to its database break again and again: nothing is lost."""

from pathlib import Path

import pytest

from jointlab.runs.carry_out import run_sequence
from rig.events import BlowAccepted, Event, SinePointMeasured
from rig.instruments import Instruments
from rig.sequences.sequence import Sequence
from store.backup.check import check
from store.catalogue import Catalogue
from store.database.time_limits import TimeLimits
from store.measurements.blows import list_blows
from store.measurements.runs import get_run, list_run_events
from store.measurements.sine_records import list_sine_records
from store.states import RunState
from tests.fault_proxy import FaultProxy
from tests.rig.person import Person


@pytest.mark.parametrize("database_kind", ["postgresql"])
def test_a_run_goes_on_though_its_database_is_lost_at_every_point(
    proxy: FaultProxy, distant_url: str, tmp_path: Path, sequence: Sequence, instruments: Instruments, person: Person
) -> None:
    cut = 0

    def lose(event: Event) -> None:
        nonlocal cut
        if isinstance(event, BlowAccepted | SinePointMeasured):
            cut += 1
            proxy.cut()
            proxy.repair()

    with Catalogue.open(distant_url, tmp_path / "waveforms", TimeLimits(connect=2.0)) as catalogue:
        number = run_sequence(sequence, instruments, catalogue, person, lose)
        with catalogue.reading() as session:
            assert get_run(session, number).state is RunState.FINISHED
            assert [event.state for event in list_run_events(session, number)] == ["running", "finished"]
            blows, sines = list_blows(session, number), list_sine_records(session, number)
        assert cut == 6
        assert [(str(blow.point), blow.number) for blow in blows] == [("5y", 1), ("5y", 2), ("1x", 1), ("1x", 2)]
        assert [sine.order_number for sine in sines] == [1, 2]
        assert [finding for finding in check(catalogue) if finding.damage] == []
