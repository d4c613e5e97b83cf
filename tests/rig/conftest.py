"""A whole simulated laboratory, an empty catalogue, and a small sequence for them."""

from collections.abc import Callable, Iterator
from copy import deepcopy
from datetime import date
from functools import partial
from typing import Any

import pytest

from daq.channels import Channel, ChannelKind
from rig.instruments import Instruments
from rig.sequences.sequence import Sequence, sequence_from
from simlab.laboratory import Laboratory
from simlab.ordinary import BenchConditions
from tests.repair import repair as make_whole
from tests.rig.person import Person

CALIBRATED = date(2026, 3, 2)
CHANNELS = (
    Channel("hammer", "cDAQ1Mod1/ai0", ChannelKind.FORCE_IEPE, 2.25e-3, "N", -2000, 2000, 2e-3, "H-01", CALIBRATED),
    Channel("accelerometer", "cDAQ1Mod1/ai1", ChannelKind.ACCELERATION_IEPE, 10.2e-3, "m/s^2", -450, 450, 2e-3, "A-01"),
    Channel("displacement", "cDAQ1Mod2/ai0", ChannelKind.VOLTAGE, 2e3, "m", -5e-3, 5e-3, serial="D-01"),
    Channel("force", "cDAQ1Mod2/ai1", ChannelKind.VOLTAGE, 2e-3, "N", -5000, 5000, serial="F-01"),
)
DOCUMENT: dict[str, Any] = {
    "format": "jointlab-sequence/1",
    "title": "a small sequence",
    "article_name": "beam 3",
    "article": {
        "beam": {
            "length": 0.914,
            "height": 0.0254,
            "width": 0.0507874,
            "youngs_modulus": 207e9,
            "poisson_ratio": 0.3,
            "density": 7850.0,
            "free_damping_ratios": [0.004, 0.001],
        },
        "node_positions": [0.0, 0.0595, 0.158875, 0.25825, 0.357625, 0.457, 0.556375, 0.65575, 0.755125, 0.8545, 0.914],
        "joints": [
            {"name": "I", "node": 2, "inclinations_deg": [-45, 135], "eccentricity": 0.006, "added_mass": 0.0},
            {"name": "II", "node": 10, "inclinations_deg": [45, -135], "eccentricity": 0.006, "added_mass": 0.0},
        ],
        "accelerometer": {"node": 3, "direction": "y", "mass": 0.0},
        "tolerances": {
            "node_position": 0.001,
            "sensor_gain": 0.005,
            "youngs_modulus": 0.005,
            "density": 0.003,
            "impact_position": 0.0015,
            "inclination_deg": 0.5,
            "tester_gain": 0.003,
        },
    },
    "steps": [
        {"step": "hammer", "points": ["5y", "1x"], "blows": 2, "block_seconds": 1.0},
        {
            "step": "sweep",
            "specimens": ["I"],
            "configurations": ["shear"],
            "amplitudes_pp_mm": [0.1],
            "frequencies": {"first": 40, "last": 120, "step": 80},
        },
    ],
}


@pytest.fixture
def document() -> dict[str, Any]:
    """A sequence with two points of two blows and two sine points, as plain values to be changed."""
    return deepcopy(DOCUMENT)


@pytest.fixture
def channel_table() -> tuple[Channel, ...]:
    return CHANNELS


@pytest.fixture(scope="module")
def running_laboratory() -> Iterator[Laboratory]:
    with Laboratory(5, 200.0, BenchConditions(double_hits=0.0)) as running:
        yield running


@pytest.fixture
def repair(running_laboratory: Laboratory) -> Callable[[], None]:
    """Clear every simulated fault."""
    return partial(make_whole, running_laboratory)


@pytest.fixture
def whole_laboratory(running_laboratory: Laboratory, repair: Callable[[], None]) -> Iterator[Laboratory]:
    """Bench, instruments and hand, repaired after each test; no blow bounces."""
    yield running_laboratory
    repair()


@pytest.fixture
def instruments(whole_laboratory: Laboratory) -> Instruments:
    addresses = whole_laboratory.addresses
    return Instruments(addresses.daq, addresses.tester, addresses.thermometer, CHANNELS)


@pytest.fixture
def person(whole_laboratory: Laboratory) -> Person:
    """Who strikes and mounts."""
    return Person(whole_laboratory)


@pytest.fixture
def sequence(document: dict[str, Any]) -> Sequence:
    """Four blows and two sine points."""
    return sequence_from(document)
