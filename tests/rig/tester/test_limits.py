"""The rig's limits have hard caps that nobody widens."""

import math
from dataclasses import asdict, fields

import pytest

from rig.tester.limits import HARD_CAPS, LimitExceededError, TesterLimits


def test_every_limit_has_a_hard_cap() -> None:
    assert set(HARD_CAPS) == {field.name for field in fields(TesterLimits)}
    for name, (lowest, highest) in HARD_CAPS.items():
        assert lowest <= asdict(TesterLimits())[name] <= highest


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("amplitude_pp", 1.0),
        ("force", 1e12),
        ("highest_frequency", math.inf),
        ("highest_preset", 0.5),
        ("lowest_preset", -0.5),
        ("velocity", math.nan),
        ("acceleration", 1e6),
        ("lowest_frequency", -1.0),
    ],
)
def test_a_limit_beyond_its_hard_cap_is_refused(name: str, value: float) -> None:
    with pytest.raises(LimitExceededError, match=f"limit {name.replace('_', ' ')} .* give one inside"):
        TesterLimits(**{name: value})
