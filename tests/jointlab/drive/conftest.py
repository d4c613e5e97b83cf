"""A rig on simulated instruments, driven in this process by all that a drive process has, and a link to it."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from jointlab.drive.process import Drive, driving
from jointlab.drive.protocol import AnswerPrompt, Begin, News, Snapshot
from jointlab.settings import DriveSettings, Settings
from jointlab.supervision.drive_link import DriveLink
from jointlab.trials.simulated_laboratory import simulated_settings
from rig.runs.records import Record, RunOrder, SinePointRecord
from rig.sequences.sequence import sequence_from
from rig.tester.limits import TesterLimits
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from store.states import RunState
from store.waveforms.waveform import Waveform
from tests.api.conftest import paper
from tests.waiting import LONG, until

SWEEP = {
    "step": "sweep", "specimens": ["I"], "configurations": ["shear"], "amplitudes_pp_mm": [0.1],
    "frequencies": {"first": 20, "last": 200, "step": 0.02},  # longer than any test
}  # fmt: skip


@dataclass
class Kept:
    """The records of all runs, in memory; a run begins when they may be opened."""

    records: list[Record] = field(default_factory=list)
    may_open: threading.Event = field(default_factory=threading.Event)

    @contextmanager
    def open(self, folder: Path, order: RunOrder) -> Iterator["Kept"]:
        assert self.may_open.wait(LONG)
        yield self

    def write(self, record: Record, waveform: Waveform | None = None) -> None:
        self.records.append(record)

    @property
    def sines(self) -> list[int]:
        return [record.order_number for record in self.records if isinstance(record, SinePointRecord)]


@dataclass
class Heard:
    """What a link was told."""

    news: list[News] = field(default_factory=list)
    losses: list[str] = field(default_factory=list)

    @property
    def now(self) -> Snapshot:
        return self.news[-1].snapshot if self.news else Snapshot()

    @property
    def names(self) -> list[str]:
        return [entry.name for news in self.news for entry in news.entries]

    def end(self) -> RunState | None:
        """How the run ended, as soon as it has; one that ends in another way fails a test at once."""
        until(lambda: self.now.state.ended_as is not None)
        return self.now.state.ended_as


@pytest.fixture
def drive_settings(laboratory: Laboratory, tmp_path: Path) -> Settings:
    return simulated_settings(
        laboratory.addresses, drive=DriveSettings(folder=tmp_path / "drive", stop_port=0), rig="rig under test"
    )


@pytest.fixture
def kept() -> Kept:
    kept = Kept()
    kept.may_open.set()
    return kept


@pytest.fixture
def drive(drive_settings: Settings, kept: Kept, monkeypatch: pytest.MonkeyPatch) -> Iterator[Drive]:
    monkeypatch.setattr("jointlab.drive.process.spooling", kept.open)
    with driving(drive_settings) as driven:
        yield driven


@pytest.fixture
def heard() -> Heard:
    return Heard()


@pytest.fixture
def link(drive: Drive, drive_settings: Settings, heard: Heard) -> Iterator[DriveLink]:
    linked = DriveLink(
        drive_settings, "test", heard.news.append, heard.losses.append, lambda welcome: None, starts=False
    )
    yield linked
    linked.close()


@pytest.fixture
def hand(laboratory: Laboratory) -> Iterator[OperatorClient]:
    """Mounts specimens on the simulated bench."""
    client = OperatorClient(laboratory.addresses.operator)
    client.do("mount", specimen="I", configuration="shear")
    yield client
    client.close()


@pytest.fixture
def order() -> RunOrder:
    return RunOrder(1, "run-1", sequence_from(paper() | {"steps": [SWEEP]}).with_seed(), "test")


def begin(link: DriveLink, heard: Heard, order: RunOrder, lease: int) -> None:
    """Begin the sweep, and see it move."""
    link.ask(Begin(order=order, limits=TesterLimits(), lease=lease))
    until(lambda: heard.now.prompt is not None)
    assert heard.now.prompt is not None
    link.ask(AnswerPrompt(run_id=1, prompt=heard.now.prompt.number, lease=lease))
    until(lambda: heard.now.state.sines > 0)


def is_at_rest(laboratory: Laboratory) -> bool:
    return laboratory.tester.actuator.steady_pp() == 0.0
