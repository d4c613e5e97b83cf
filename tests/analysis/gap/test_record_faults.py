"""What is wrong with single blows is found by the checks of the hammer session."""

from __future__ import annotations

import numpy as np

from analysis.dof import Direction, Dof
from analysis.gap.measurement import RawBlow
from analysis.gap.record_faults import record_faults

RATE, SAMPLES, TOUCH = 4096.0, 8192, 41


def struck(contacts: dict[float, float], answers: bool = True, name: str = "blow_1y") -> RawBlow:
    """A record with contacts: peak in N by time after the first touch, s."""
    random, time = np.random.default_rng(5), (np.arange(SAMPLES) - TOUCH) / RATE
    force = 0.01 * random.standard_normal(SAMPLES)
    acceleration = 0.01 * random.standard_normal(SAMPLES)
    for after, peak in contacts.items():
        since = time - after
        force += np.where(np.abs(since) < 0.5e-3, peak * np.cos(np.pi * since / 1e-3), 0.0)
        if answers:
            acceleration += np.where(since > 0, peak * np.exp(-12 * since) * np.sin(480 * since), 0.0)
    return RawBlow(name, Dof(1, Direction.Y), force, acceleration, RATE)


def test_a_clean_blow_has_no_fault() -> None:
    assert record_faults([struck({0.0: 100.0})]) == (None, ())


def test_a_bounce_is_a_double_hit_with_its_height() -> None:
    found, others = record_faults([struck({0.0: 100.0}), struck({0.0: 100.0, 0.012: 30.0}, name="blow_6y")])
    assert others == ()
    assert found is not None
    assert found.id == "double_hit"
    assert abs(found.parameters["ratio"].value - 0.3) < 0.02
    assert found.fault.startswith("1 of 2 blows kept are double hits: blow_6y at 1y")
    assert "12.0 ms after" in found.fault


def test_an_accelerometer_that_does_not_answer_is_named() -> None:
    found, (fault,) = record_faults([struck({0.0: 100.0}, answers=False)])
    assert found is None
    assert fault.startswith("blow blow_1y at 1y: accelerometer 1 did not respond")


def test_a_record_that_begins_with_the_blow_cannot_be_checked() -> None:
    blow = struck({0.0: 100.0})
    late = RawBlow(blow.name, blow.point, blow.force[TOUCH - 2 :], blow.acceleration[TOUCH - 2 :], RATE)
    found, (fault,) = record_faults([late])
    assert found is None
    assert "cannot be checked" in fault
    assert "longer pre-trigger" in fault
