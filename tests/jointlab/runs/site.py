"""Where runs of the tests are carried out, and what is kept of them."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import pytest
from sqlalchemy import func, select, text

from jointlab.runs.carry_out import carry_out_order, run_sequence, store_spools
from jointlab.runs.orders import order_to_begin, order_to_resume
from rig.control import RunControl
from rig.errors import RunStoppedError
from rig.events import Event, Observer
from rig.instruments import Instruments
from rig.operator import Operator
from rig.registers import State
from rig.sequences.sequence import Sequence
from simlab.laboratory import Laboratory
from store.catalogue import Catalogue
from store.measurements.locks import run_lock
from store.measurements.runs import Run, get_run, list_run_events, list_runs
from store.models.base import Base
from tests.rig.person import Person


def stopping(control: RunControl, kind: type[Event], count: int, events: list[Event]) -> Observer:
    """An observer that asks for a stop after the `count`-th event of a kind."""

    def observe(event: Event) -> None:
        events.append(event)
        if isinstance(event, kind) and sum(isinstance(each, kind) for each in events) == count:
            control.stop()

    return observe


def resume_run(
    run_id: int, instruments: Instruments, catalogue: Catalogue, *others: Any, reset: bool = False, **named: Any
) -> None:
    """Continue a run in this process, as the drive process does it for the service."""
    run = catalogue.read(get_run, run_id)
    with run_lock(catalogue, run):
        store_spools(catalogue)
        order = order_to_resume(catalogue, run_id, instruments.limits, rig=instruments.rig, reset=reset)
        carry_out_order(order, run, instruments, catalogue, *others, **named)


def carry_out_planned(
    run_id: int, instruments: Instruments, catalogue: Catalogue, operator: Operator, reset: bool = False
) -> None:
    """Carry out a planned run in this process."""
    run = catalogue.read(get_run, run_id)
    order = order_to_begin(run, rig=instruments.rig, reset=reset)
    with run_lock(catalogue, run):
        carry_out_order(order, run, instruments, catalogue, operator)


@dataclass(frozen=True)
class Site:
    """A laboratory with its person, a small sequence, and a catalogue; `repair` clears every fault."""

    sequence: Sequence
    instruments: Instruments
    catalogue: Catalogue
    person: Person
    laboratory: Laboratory
    repair: Callable[[], None]

    def run(self, sequence: Sequence | None = None, **others: Any) -> int:
        """Carry out the sequence, with other arguments where they are given; the number of the run."""
        return run_sequence(sequence or self.sequence, **self._arguments | others)

    def resume(self, run: int, **others: Any) -> None:
        """Continue a run."""
        resume_run(run, **self._arguments | others)

    def run_planned(self, run: int, **others: Any) -> None:
        """Carry out a run that `plan_run` stored."""
        carry_out_planned(run, **self._arguments | others)

    def stop_after(self, kind: type[Event], count: int, sequence: Sequence | None = None, **others: Any) -> int:
        """Carry out the sequence until it is stopped after the `count`-th event of a kind; the number of the run."""
        control = RunControl()
        with pytest.raises(RunStoppedError):
            self.run(sequence, observer=stopping(control, kind, count, []), control=control, **others)
        return self.newest().id

    @contextmanager
    def left_alone(self) -> Iterator[None]:
        """What happens in the context stores nothing and asks nothing of the person."""
        before = self._stored()
        yield
        assert self._stored() == before
        assert self.person.counts == {"strike": 0, "mount": 0}

    def _stored(self) -> dict[str, int]:
        """Rows of every table and the number of waveform files."""
        tables = Base.metadata.tables.items()
        with self.catalogue.reading() as session:
            rows = {name: session.scalar(select(func.count()).select_from(table)) or 0 for name, table in tables}
        folder = self.catalogue.waveforms.folder
        return rows | {"waveform files": len(list(folder.iterdir())) if folder.exists() else 0}

    @property
    def _arguments(self) -> dict[str, Any]:
        return {"instruments": self.instruments, "catalogue": self.catalogue, "operator": self.person}

    def newest(self) -> Run:
        """The newest run."""
        with self.catalogue.reading() as session:
            return list_runs(session)[0]

    def kept(self) -> tuple[int, int, int]:
        """Blows accepted and refused, and sine records of the newest run."""
        query = "SELECT blows_accepted, blows_refused, sine_records FROM v_runs WHERE run_id = :run"
        with self.catalogue.reading() as session:
            row = session.execute(text(query), {"run": self.newest().id}).one()
        return int(row[0] or 0), int(row[1] or 0), int(row[2] or 0)

    def history(self, run: int) -> list[tuple[str, str | None]]:
        """States and reasons of a run."""
        with self.catalogue.reading() as session:
            return [(event.state.value, event.reason) for event in list_run_events(session, run)]

    def is_at_rest(self) -> bool:
        """Whether the actuator is."""
        tester = self.laboratory.tester
        resting = State.HYDRAULICS_OFF, State.TRIPPED
        return tester.actuator.steady_pp() == 0.0 and tester.device.status()["state"] in resting
