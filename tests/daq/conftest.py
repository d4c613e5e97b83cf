"""A plant of known signals behind a real NI-DAQmx server on loopback, and the channel tables that fit it."""

import threading
from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from daq.channels import Channel
from daq.device import Chassis, connect
from simlab.clock import Clock
from simlab.daq_server import DaqServer, start_daq_server
from tests.channels import HAMMER_CHANNELS, TESTER_CHANNELS

Real = NDArray[np.float64]


class Plant:
    """Signals that are closed formulas of bench time: half-sine blows where asked for, and a steady sine."""

    def __init__(self, speed: float) -> None:
        self.clock = Clock(speed)
        self.width = 4e-3  # s
        self.blows: list[tuple[float, float]] = []  # start in bench s, peak in N
        self.served: list[tuple[float, float, int]] = []
        self._lock = threading.Lock()

    def strike(self, after: float = 0.05, peak: float = 100.0) -> None:
        with self._lock:
            self.blows.append((self.clock.now() + after, peak))

    def hammer(self, times: Real) -> Real:
        force = np.zeros_like(times)
        for start, peak in list(self.blows):
            phase = np.pi * (times - start) / self.width
            force += np.where((phase > 0) & (phase < np.pi), peak * np.sin(phase), 0.0)
        return force

    def hammer_signals(self, start: float, rate: float, samples: int) -> dict[str, Real]:
        self.served.append((start, rate, samples))
        times = start + np.arange(samples) / rate
        force = self.hammer(times)
        return {"hammer": force, "accelerometer": 0.5 * force + 3.0 * np.sin(2 * np.pi * 80 * times)}

    def tester_signals(self, times: Real) -> dict[str, Real]:
        sine = np.sin(2 * np.pi * 20 * times)
        return {"displacement": 5e-4 + 5e-5 * sine, "force": 1000.0 + 120.0 * sine}

    def next_crossing(self, channel: str, level: float, after: float) -> float | None:
        assert channel == "hammer"
        rises = [s + self.width / np.pi * np.arcsin(level / p) for s, p in list(self.blows) if p > level]
        return min((t for t in rises if t > after), default=None)


@pytest.fixture
def plant() -> Plant:
    return Plant(speed=20.0)


@pytest.fixture
def server(plant: Plant) -> Iterator[DaqServer]:
    server = start_daq_server(plant)
    yield server
    server.stop()


@pytest.fixture
def chassis(server: DaqServer) -> Iterator[Chassis]:
    with connect(server.address) as chassis:
        yield chassis


@pytest.fixture
def hammer_table() -> tuple[Channel, ...]:
    return HAMMER_CHANNELS


@pytest.fixture
def tester_table() -> tuple[Channel, ...]:
    return TESTER_CHANNELS
