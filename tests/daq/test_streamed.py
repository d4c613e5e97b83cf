"""Blocks made of a plug-in's stream, and what is said of a plug-in that does wrong."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from datetime import UTC, datetime
from typing import Any, cast

import numpy as np
import pytest

from daq import streamed
from daq.channels import Channel, ChannelKind
from daq.errors import AcquisitionCancelledError, ChannelError, DaqError, OverrunError, TriggerTimeoutError
from daq.instrument import Device, EdgeTrigger
from daq.stream import Samples
from daq.streamed import StreamedInstrument
from tests.waiting import LONG, until

RATE, TONE = 8000.0, 100.0
LSB = 1e-4  # V
SINE = Channel("sine", "card/ai0", ChannelKind.VOLTAGE, 0.5, "m", -1.0, 1.0)
COSINE = Channel("cosine", "card/ai1", ChannelKind.VOLTAGE, 0.5, "m", -1.0, 1.0, polarity=-1)
SHAPES: dict[str, Callable[[Any], Any]] = {"card/ai0": np.sin, "card/ai1": np.cos}


class Card:
    """A source of tones of 0.25 V and its stream in one, whose methods a test may replace."""

    def __init__(self, address: str = "card://0") -> None:
        self.devices: Sequence[Device] = (Device("card", "sound card", address, ("card/ai0", "card/ai1")),)
        self.sample_rate, self.starts, self.opened, self.running = RATE, 0, 0, False

    def open(self, channels: Sequence[Channel], sample_rate: float) -> "Card":
        self.shapes = [SHAPES[each.physical] for each in channels]
        self.scaling: Sequence[Sequence[float]] = [(0.0, LSB)] * len(channels)
        self.ranges: Sequence[tuple[float, float]] = [(-1.0, 1.0)] * len(channels)
        self.opened += 1
        return self

    def start(self) -> None:
        assert not self.running
        self.began, self.given, self.running, self.starts = time.monotonic(), 0, True, self.starts + 1

    def read(self, timeout: float) -> Samples:
        time.sleep(min(timeout, 0.005))
        first, self.given = self.given, int((time.monotonic() - self.began) * self.sample_rate)
        phase = 2 * np.pi * TONE * np.arange(first, self.given) / self.sample_rate
        counts = [np.round(0.25 * shape(phase) / LSB) for shape in self.shapes]
        return Samples(first, np.array(counts).astype(np.int32))

    def stop(self) -> None:
        self.running = False

    def close(self) -> None:
        self.opened -= 1


@pytest.fixture
def card() -> Card:
    return Card()


@pytest.fixture
def instrument(card: Card) -> Iterator[StreamedInstrument]:
    with StreamedInstrument("card://0", lambda _: card) as found:
        yield found


def test_waiting_ends_although_samples_come_faster_than_they_are_looked_at(
    instrument: StreamedInstrument, card: Card, monkeypatch: pytest.MonkeyPatch
) -> None:
    def read(timeout: float) -> Samples:  # without any wait
        card.given += 1
        return Samples(card.given - 1, np.zeros((1, 1), np.int32))

    monkeypatch.setattr(card, "read", read)
    monkeypatch.setattr(streamed, "READ_OVERTIME", 0.2)
    given_up_at = time.monotonic() + 10.0
    with instrument.triggered([SINE], RATE, 0.01, EdgeTrigger("sine", 0.1, 0.005)) as task:
        task.arm()
        with pytest.raises(TriggerTimeoutError, match="sine: nothing came in time"):
            task.wait(0.1, lambda: time.monotonic() > given_up_at)


def test_a_record_has_the_length_units_signs_and_time_that_were_asked_for(
    instrument: StreamedInstrument, card: Card
) -> None:
    before = datetime.now(UTC)
    with instrument.record([SINE, COSINE], RATE, 0.1) as recorder:
        block = recorder.record()
        longer = recorder.record(0.2)
    assert block.counts.shape == (2, 800)
    assert longer.samples == 1600
    assert np.max(block.value("sine")) == pytest.approx(0.5, abs=1e-3)
    assert block.value("cosine")[0] == pytest.approx(-0.5, abs=1e-3)  # its polarity is -1
    assert before <= block.started_at < longer.started_at
    assert recorder.input_range("cosine") == (-1.0, 1.0)
    assert not block.overloaded
    assert (card.running, card.opened) == (False, 0)


def test_a_block_around_a_trigger_has_the_edge_at_its_index(instrument: StreamedInstrument) -> None:
    trigger = EdgeTrigger("sine", 0.3, 0.02)
    with instrument.triggered([SINE, COSINE], RATE, 0.1, trigger) as task:
        for _ in range(2):
            task.arm()
            block = task.wait(LONG)
            value = block.value("sine")
            assert block.trigger_index == 160
            assert value[159] < 0.3 <= value[160]
            assert block.samples == 800


def test_without_an_edge_the_task_ends_in_time_and_can_be_armed_again(
    instrument: StreamedInstrument, card: Card
) -> None:
    with instrument.triggered([SINE], RATE, 0.05, EdgeTrigger("sine", 0.9, 0.01)) as task:
        for _ in range(2):
            task.arm()
            with pytest.raises(TriggerTimeoutError, match="sine: nothing came in time"):
                task.wait(0.1)
            assert not card.running


def test_a_cancelled_record_ends_at_once_and_the_next_one_goes_on(instrument: StreamedInstrument) -> None:
    with instrument.record([SINE], RATE, 60.0) as recorder:
        began = time.monotonic()
        with pytest.raises(AcquisitionCancelledError):
            recorder.record(cancelled=lambda: time.monotonic() > began + 0.05)
        assert time.monotonic() - began < 30.0  # of 60 s
        assert recorder.record(0.05).samples == 400


def test_an_input_at_the_end_of_its_range_is_overloaded(instrument: StreamedInstrument, card: Card) -> None:
    small = Channel("sine", "card/ai0", ChannelKind.VOLTAGE, 0.5, "m", -0.4, 0.4)
    with instrument.record([small], RATE, 0.1) as recorder:
        assert recorder.record().overloaded == ()
        recorder._range = ((-0.25, 0.25),)  # an input with a smaller range
        assert recorder.record().overloaded == ("sine",)


def test_lost_samples_are_an_error_and_no_gap(instrument: StreamedInstrument, card: Card) -> None:
    sound = card.read

    def lossy(timeout: float) -> Samples:
        got = sound(timeout)
        return Samples(got.first + (3 if got.first > 200 else 0), got.counts)

    card.read = lossy  # type: ignore[method-assign]
    with instrument.record([SINE], RATE, 0.2) as recorder, pytest.raises(OverrunError, match="samples were lost"):
        recorder.record()
    assert (card.running, card.opened) == (False, 0)


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"read": lambda _: 1 / 0}, "read sine: the plug-in failed .ZeroDivisionError"),
        ({"read": lambda: None}, "read sine: the plug-in failed .TypeError"),
        (
            {"read": lambda _: Samples(0, cast(Any, np.zeros((1, 9))))},
            "gave float64 of shape .1, 9. in place of integers",
        ),
        ({"read": lambda _: Samples(0, np.zeros((2, 9), int))}, r"shape \(2, 9\) in place of integers, \(1, samples\)"),
        ({"start": lambda: dict[str, int]()["x"]}, "start sine: the plug-in failed .KeyError"),
        ({"sample_rate": 0.0}, "has a sample rate of 0.0 Hz"),
        ({"open": lambda *_: None}, "set up sine: the plug-in failed .AttributeError"),
        ({"open": lambda: None}, "sine at 8000 Hz at card://0: the plug-in failed .TypeError"),
    ],
)
def test_what_a_plug_in_does_wrong_is_named(
    wrong: dict[str, object], says: str, instrument: StreamedInstrument, card: Card
) -> None:
    vars(card).update(wrong)
    with pytest.raises(DaqError, match=says), instrument.record([SINE], RATE, 0.1) as recorder:
        recorder.record()


def test_a_plug_in_that_hangs_ends_a_record_in_time(instrument: StreamedInstrument, card: Card) -> None:
    goes_on = threading.Event()
    card.read = lambda _: goes_on.wait()  # type: ignore[assignment,method-assign,return-value]
    with pytest.raises(TriggerTimeoutError) as failed, instrument.record([SINE], RATE, 0.1) as recorder:
        recorder.record(timeout=0.1)
    assert "does not return from a read" in failed.value.__notes__[0]
    assert card.opened == 1  # a plug-in need not bear two calls at a time
    goes_on.set()
    until(lambda: card.opened == 0)


@pytest.mark.parametrize("fails", ["stop", "close"])
def test_a_stream_that_cannot_be_stopped_is_closed_all_the_same(
    fails: str, instrument: StreamedInstrument, card: Card, monkeypatch: pytest.MonkeyPatch
) -> None:
    closed = list[str]()
    monkeypatch.setattr(card, "stop", lambda: 1 / 0)
    monkeypatch.setattr(card, "close", lambda: closed.append("stream") if fails == "stop" else 1 / 0)
    task = instrument.triggered([SINE], RATE, 0.05, EdgeTrigger("sine", 0.9, 0.01))
    task.arm()
    with pytest.raises(DaqError, match=r"stop sine: the plug-in failed .ZeroDivisionError") as failed:
        task.close()
    assert closed == (["stream"] if fails == "stop" else [])
    assert len(getattr(failed.value, "__notes__", ())) == (fails == "close")
    monkeypatch.undo()  # the instrument has the same `close`


def test_channels_that_the_instrument_lacks_are_refused(instrument: StreamedInstrument) -> None:
    for channel, says in (
        (Channel("x", "card/ai9", ChannelKind.VOLTAGE, 1.0, "m", -1, 1), "has only card/ai0, card/ai1"),
        (Channel("x", "card/ai0", ChannelKind.VOLTAGE, 1.0, "m", -9, 9), "asks for -9 to 9 V, its input takes -1 to 1"),
    ):
        with pytest.raises(ChannelError, match=says):
            instrument.verify([channel])
    with pytest.raises(ChannelError, match="trigger on 'anvil'"):
        instrument.triggered([SINE], RATE, 0.1, EdgeTrigger("anvil", 1.0, 0.01))


def test_an_instrument_that_cannot_be_opened_says_why() -> None:
    with pytest.raises(DaqError, match=r"open card://0: the plug-in failed .OSError: no such card"):
        StreamedInstrument("card://0", lambda _: (_ for _ in ()).throw(OSError("no such card")))
