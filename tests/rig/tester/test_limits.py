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


@pytest.mark.parametrize(
    ("name", "lowest", "highest", "says"),
    [
        ("frequency", 50.0, 20.0, "lowest frequency 50 Hz is above the highest, 20 Hz"),
        ("preset", 5e-4, 1e-4, "lowest preset 0.5 mm is above the highest, 0.1 mm"),
    ],
)
def test_a_range_without_anything_in_it_is_refused(name: str, lowest: float, highest: float, says: str) -> None:
    with pytest.raises(LimitExceededError, match=f"{says}; exchange them, or give another range"):
        TesterLimits(**{f"lowest_{name}": lowest, f"highest_{name}": highest})
    only = TesterLimits(**{f"lowest_{name}": lowest, f"highest_{name}": lowest})
    assert asdict(only)[f"lowest_{name}"] == lowest
