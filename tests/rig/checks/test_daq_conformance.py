"""The checks for makers of acquisition plug-ins: a sound instrument passes, and what is wrong with another is named."""

import time
import wave
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from daq.device import connect
from daq.instrument import DaqInstrument
from daq.stream import Samples
from daq.streamed import StreamedInstrument
from jointlab.plug_ins import object_named
from rig.checks.check import Check, CheckState
from rig.checks.daq_conformance import check_daq
from simlab.bench import CALIBRATOR, SENSOR
from simlab.laboratory import Laboratory
from tests.rig.conftest import CHANNELS

EXAMPLE = Path(__file__).resolve().parents[3] / "docs" / "examples" / "own_daq.py"
RATE, TONE, AMPLITUDE = 8000, 160.0, 0.5
HAMMER, ACCELEROMETER = CHANNELS[:2]


@pytest.fixture(scope="module")
def laboratory() -> Iterator[Laboratory]:
    with Laboratory(5, 1.0) as running:
        running.bench.mount(SENSOR, CALIBRATOR)
        yield running


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file with whole periods of a tone, and its inverse on the second channel."""
    path = tmp_path_factory.mktemp("wav") / "tone.wav"
    tone = np.round(AMPLITUDE * 2**15 * np.sin(2 * np.pi * TONE * np.arange(RATE) / RATE)).astype("<i2")
    with wave.open(str(path), "wb") as file:
        file.setnchannels(2)
        file.setsampwidth(2)
        file.setframerate(RATE)
        file.writeframes(np.stack([tone, -tone], axis=1).tobytes())
    return path


def opened(recording: Path, *spoil: Callable[[Any], None]) -> Callable[[], DaqInstrument]:
    """Opens the example's instrument, whose streams are spoilt."""
    open_source = object_named(f"{EXAMPLE}:open_source", "plug-in", [])

    def source(address: str) -> Any:
        found = open_source(address)
        sound = found.open

        def spoilt(*asked: Any) -> Any:
            stream = sound(*asked)
            for each in spoil:
                each(stream)
            return stream

        found.open = spoilt
        return found

    return lambda: StreamedInstrument(f"replay://{recording}", source)


def failures(checks: tuple[Check, ...]) -> set[str]:
    return {check.id for check in checks if check.state is CheckState.FAILED}


def test_the_simulated_instrument_passes(laboratory: Laboratory) -> None:
    address = laboratory.addresses.daq
    checks = check_daq(lambda: connect(address), (ACCELEROMETER, HAMMER, *CHANNELS[2:]), tone=159.15)
    assert not failures(checks)
    not_done = {check.id for check in checks if check.state is CheckState.NOT_DONE}
    assert not_done == {"volts", "trigger_index"}


def test_the_example_of_a_plug_in_passes_every_check(recording: Path) -> None:
    assert len(EXAMPLE.read_text(encoding="utf-8").splitlines()) < 60
    checks = check_daq(opened(recording), tone=TONE)
    assert {check.id for check in checks if check.state is not CheckState.PASSED} == {"volts"}


def test_an_instrument_that_is_absent_fails_its_first_check() -> None:
    (check,) = check_daq(lambda: connect("grpc://127.0.0.1:9", 0.2))
    assert (check.id, check.state) == ("identity", CheckState.FAILED)


def loses(share: float, *, numbered: bool) -> Callable[[Any], None]:
    """Loses a share of the samples; they keep their numbers, or are numbered as if nothing was lost."""

    def spoil(stream: Any) -> None:
        sound, lost, given = stream.read, [0], [0]

        def read(timeout: float) -> Samples:
            got = sound(timeout)
            if got.first == 0:
                lost[0] = given[0] = 0
            kept = [column for column in range(got.counts.shape[1]) if (got.first + column) % round(1 / share)]
            first = got.first + (kept[0] if kept else 0) if numbered else given[0]
            given[0] += len(kept)
            return Samples(first, got.counts[:, kept])

        stream.read = read

    return spoil


def late(stream: Any) -> None:
    """Gives samples from before the start."""
    start = stream.start

    def early() -> None:
        start()
        stream.began = time.monotonic() - 0.5

    stream.start = early


def slow_clock(stream: Any) -> None:
    stream.sample_rate *= 1.2
    read = stream.read

    def paced(timeout: float) -> Samples:
        stream.sample_rate /= 1.2
        got: Samples = read(timeout)
        stream.sample_rate *= 1.2
        return got

    stream.read = paced


def in_millivolt(stream: Any) -> None:
    stream.scaling = [(0.0, 1000 / 2**15)] * len(stream.scaling)


def any_range(stream: Any) -> None:
    stream.ranges = [(-1e3, 1e3)] * len(stream.ranges)


@pytest.mark.parametrize(
    ("spoil", "shows"),
    [
        ([loses(0.002, numbered=False)], {"sine"}),
        ([loses(0.01, numbered=True)], {"record"}),
        ([slow_clock, in_millivolt], {"rate", "input"}),
        ([late, any_range], {"timestamps", "refusals"}),
    ],
    ids=["lost samples", "gaps", "slow clock and millivolt", "old samples and any range"],
)
def test_what_is_wrong_with_an_instrument_is_named(
    recording: Path, spoil: list[Callable[[Any], None]], shows: set[str]
) -> None:
    assert failures(check_daq(opened(recording, *spoil), tone=TONE)) >= shows
