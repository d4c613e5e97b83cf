"""The ingest: stores the spools of a rig in the catalogue, each record exactly once, even if a process is killed.

A spool may be written meanwhile, by this process or another. A database that is away is waited for.
"""

import logging
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Self

from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from jointlab.alarms.new import refused_record
from jointlab.errors import ConflictError
from jointlab.runs.rows import add_record
from rig.runs.records import RunOrder
from rig.runs.spool import (
    DAMAGED,
    REFUSED,
    Spooled,
    SpoolReader,
    discard_spool,
    is_written,
    set_aside,
    spools,
    spools_of,
)
from rig.runs.spool_file import SpoolDamagedError
from store.catalogue import Catalogue
from store.database.connection import driver_message
from store.errors import ContradictionError, DamagedError, NotFoundError, StoreError
from store.measurements.runs import Run, discard_run, get_run
from store.measurements.spools import advance_spool, last_stored, last_waveform
from store.service.alarms import add_alarm
from store.states import RunState

BATCH = 50  # records that one transaction stores, at most
PERIOD = 0.2  # s between two looks for new records
LONGEST_PAUSE = 5.0  # s between two attempts while the database is away
SETTLED = 30.0  # s that callers wait until everything is stored
log = logging.getLogger(__name__)


class ForeignSpoolError(StoreError):
    """The spool is of a run that this database does not have."""


class SpoolIngest:
    """Stores one spool."""

    def __init__(self, catalogue: Catalogue, path: Path) -> None:
        self._catalogue = catalogue
        self._path = path
        self._reader = SpoolReader(path)
        self._last = 0

    def advance(self) -> None:
        """Store what was written since the last call; a spool that nothing writes any more is removed then.

        A damaged one, and one with a record that contradicts what is stored, is kept unchanged under another name when
        nothing writes it any more: what is after the damage, or from that record on, cannot be stored.

        Raises:
            ContradictionError: a record contradicts what is stored, and the spool is still written.
            ForeignSpoolError: the run is not in this database.
            StoreError: the database or the waveforms cannot be written now; nothing is lost.
        """
        is_growing = is_written(self._path)  # asked first: nothing comes after a record that is read afterwards
        try:
            for batch in _batches(self._reader.records()):
                assert self._reader.order is not None, "the order is before the first record"
                self._store_most(self._reader.order, batch)
        except SpoolDamagedError as error:
            if is_growing:
                raise
            log.error("%s; what is before that is stored, and the spool is set aside", error)
            set_aside(self._path, DAMAGED)
            return
        except BaseException as error:  # whatever it is, more was read than stored; what is stored, the database tells
            order, self._reader, self._last = self._reader.order, SpoolReader(self._path), 0
            if isinstance(error, ContradictionError) and order is not None and not is_growing:
                self._refuse(order, error)
                return
            raise
        if not is_growing:
            self._finish()

    def _finish(self) -> None:
        """Remove the spool, everything of which is stored, and a run that was made for it and did not begin."""
        order = self._reader.order
        if order is not None:
            self._catalogue.waveforms.finish(order.waveform_file)
            discard_if_not_begun(self._catalogue, order)
        discard_spool(self._path)

    def _refuse(self, order: RunOrder, error: ContradictionError) -> None:
        """Keep the spool under another name, and tell people; the alarm first, as it may have to be tried again."""
        rig = self._catalogue.read(get_run, order.run_id).rig or ""
        alarm = refused_record(order, rig, self._path.name + REFUSED, str(error))
        self._catalogue.write(partial(add_alarm, new=alarm))
        log.error("%s", alarm.text)
        set_aside(self._path, REFUSED)

    def _store_most(self, order: RunOrder, batch: list[Spooled]) -> None:
        """Store a batch; where one of it contradicts what is stored, those before it. Raises as `advance`."""
        try:
            self._store(order, batch)
        except ContradictionError:
            for each in batch:
                self._store(order, [each])

    def _store(self, order: RunOrder, batch: list[Spooled]) -> None:
        name = self._path.name
        with self._catalogue.reading() as session:
            before = self._last or last_stored(session, name)
            new = [each for each in batch if each.number > before]
            if not new:
                return
            if new[0].number != before + 1:
                raise StoreError(f"{self._path}: record {new[0].number} would be stored after record {before}")
            if _run_of(session, order) is None:
                raise ForeignSpoolError(f"{self._path} is of run {order.run_id} in another database; it stays there")
            after = last_waveform(session, order.run_id)
        rows = {each.number: each.waveform for each in new if each.waveform is not None}
        references = self._catalogue.waveforms.append_once(order.waveform_file, list(rows.values()), after)
        referred = dict(zip(rows, references, strict=True))

        def store(session: Session) -> None:
            advance_spool(session, name, before, new[-1].number)
            for each in new:
                with _explained(order, each.number):
                    add_record(session, order, each.record, referred.get(each.number))
                    session.flush()

        self._catalogue.write(store)
        self._last = new[-1].number


@contextmanager
def _explained(order: RunOrder, number: int) -> Iterator[None]:
    """Raise a ContradictionError where a record fits nothing that is stored, however often it is tried."""
    try:
        yield
    except (DamagedError, ContradictionError):
        raise
    except IntegrityError as error:
        raise ContradictionError(_refused(order, number, driver_message(error.orig or error))) from error
    except StoreError as error:
        raise ContradictionError(_refused(order, number, str(error))) from error


def _refused(order: RunOrder, number: int, why: str) -> str:
    return f"record {number} of run {order.run_id} contradicts what is stored ({why})"


def discard_if_not_begun(catalogue: Catalogue, order: RunOrder) -> None:
    """Remove the run of `order` if it was made for this order alone and did not begin."""
    if order.planned:
        return
    with catalogue.writing() as session:
        run = _run_of(session, order)
        if run is not None and run.state is RunState.CREATED:
            discard_run(session, run.id)


def _run_of(session: Session, order: RunOrder) -> Run | None:
    """The run of `order`; None where this database does not have it."""
    try:
        run = get_run(session, order.run_id)
    except NotFoundError:
        return None
    return run if run.waveform_file == order.waveform_file else None


def _batches(records: Iterator[Spooled]) -> Iterator[list[Spooled]]:
    """The records in lists of BATCH at most; where the spool is damaged, what is before that comes first."""
    batch, damage = list[Spooled](), None
    try:
        for record in records:
            batch.append(record)
            if len(batch) == BATCH:
                yield batch
                batch = []
    except SpoolDamagedError as error:
        damage = error
    if batch:
        yield batch
    if damage is not None:
        raise damage


class Ingester:
    """Stores every spool in a folder, in a thread of its own, until it is closed.

    Args:
        folder: of the spools; need not exist yet.
    """

    def __init__(self, catalogue: Catalogue, folder: Path) -> None:
        self.folder = folder
        self._catalogue = catalogue
        self._ingests = dict[Path, SpoolIngest]()
        self._foreign = set[Path]()
        self._problem: str | None = None
        self._changed = threading.Condition()
        self._asked = self._done = 0
        self._closed = False
        self._thread = threading.Thread(target=self._work, name="ingest", daemon=True)
        self._thread.start()

    @property
    def problem(self) -> str | None:
        """Why nothing can be stored at present; None where everything can."""
        return self._problem

    def settle(self, timeout: float = SETTLED) -> bool:
        """Wait until everything that is in the spools now is stored; whether that came about within `timeout` s."""
        with self._changed:
            self._asked = asked = self._asked + 1
            self._changed.notify_all()
            return self._changed.wait_for(lambda: self._done >= asked or self._closed, timeout) and self._done >= asked

    def check_stored(self, order: RunOrder) -> None:
        """Raise ConflictError where records of the run of `order` wait: its points would be measured again."""
        if spools_of(self.folder, order.waveform_file):
            why = f": {self._problem}" if self._problem else ""
            raise ConflictError(
                f"records of run {order.run_id} wait to be stored{why}; resume it when they are stored, or its points "
                "would be measured again"
            )

    def close(self) -> None:
        """End the thread; what is not stored yet stays in the spools, and the next ingester stores it."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def _work(self) -> None:
        pause = PERIOD
        while not self._closed:
            asked = self._asked
            try:
                self._look()
                pause, self._problem = PERIOD, None
            except Exception as error:  # whatever it is: records wait until they can be stored
                if self._problem != str(error):
                    unexpected = None if isinstance(error, StoreError) else error
                    log.warning("records wait in %s: %s", self.folder, error, exc_info=unexpected)
                pause, self._problem = min(2 * pause, LONGEST_PAUSE), str(error)
            with self._changed:
                if self._problem is None:
                    self._done = asked
                    self._changed.notify_all()
                if self._asked == asked and not self._closed:
                    self._changed.wait(pause)

    def _look(self) -> None:
        """Store what is new in every spool; raises the first error where that cannot be done now with one of them."""
        present = {path: self._ingests.get(path) for path in spools(self.folder) if path not in self._foreign}
        self._ingests = {path: known or SpoolIngest(self._catalogue, path) for path, known in present.items()}
        problems = list[Exception]()
        for path, ingest in self._ingests.items():
            try:
                ingest.advance()
            except ForeignSpoolError as error:
                log.warning("%s", error)
                self._foreign.add(path)
            except Exception as error:  # noqa: BLE001 - it is told below, and other spools are stored meanwhile
                problems.append(error)
        if problems:
            raise problems[0]
