"""The bar in cords: its own modes, hardly raised, and a slow bounce."""

from __future__ import annotations

import numpy as np
import pytest

from simlab.article import draw_article
from simlab.bench import Bench, Conditions
from simlab.clock import Clock
from simlab.supported_beam import SupportedBeam
from simlab.suspension import BOUNCE, cords_for

QUIET = Conditions(scatter=0.0, gain_error=0.0, force_noise=1e-9, acceleration_noise=1e-9)


def test_the_hanging_bar_bounces_slowly_and_rings_as_a_free_one() -> None:
    hanging = SupportedBeam(draw_article(1), supports=cords_for(draw_article(1)))
    frequency = np.abs(hanging.poles(3e-6)) / (2 * np.pi)
    elastic = frequency[frequency > 100]
    assert elastic[:3] == pytest.approx(hanging.free.frequency[3:6], rel=1e-3)
    assert np.all(elastic[:3] > hanging.free.frequency[3:6])
    rigid = frequency[frequency < 100]
    assert np.min(np.abs(rigid - BOUNCE)) < 0.05 * BOUNCE
    assert rigid.max() < 2.2 * BOUNCE


def rings(bench: Bench, at: float) -> float:
    """Frequency of the strongest line between 100 and 600 Hz after a blow at 8y."""
    bench.strike(8, "y", at=at, what="clean")
    signal = bench.hammer_signals(at - 0.05, 5120.0, 4 * 5120)["accelerometer"]
    spectrum = np.abs(np.fft.rfft(signal))
    frequency = np.fft.rfftfreq(signal.size, 1 / 5120.0)
    within = (frequency > 100) & (frequency < 600)
    return float(frequency[within][np.argmax(spectrum[within])])


def test_the_beam_is_hung_and_put_back() -> None:
    bench = Bench(1, Clock(), QUIET)
    supported = rings(bench, 1.0)
    bench.mount("beam", "suspended")
    assert not bench.hammer_signals(1.0, 5120.0, 5120)["hammer"].max() > 1.0  # what rang before is at rest
    hanging = rings(bench, 10.0)
    free = bench.truth()["free"]["frequency_hz"]
    assert min(abs(hanging - f) for f in free) < 1.0
    assert abs(supported - hanging) > 5.0
    bench.mount("beam", "supported")
    assert rings(bench, 20.0) == supported
    assert bench.mounted is None
