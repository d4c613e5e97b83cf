"""Sets of one content are one set, wherever they were read or sent."""

import pickle
from dataclasses import fields, replace
from typing import Any

import numpy as np

from analysis.dof import Direction, Dof
from analysis.gap.measurement import HammerSet

SET = HammerSet(
    inputs=(Dof(1, Direction.Y), Dof(4, Direction.Y)),
    frequency=np.array([10.0, 20.0, 30.0]),
    accelerance=np.array([[1.0, 2.0j, 3.0], [0.5, 1.0, 1.5j]]),
    deviation=np.full((2, 3), 0.1),
    peak_force=100.0,
    temperature=21.0,
    coherence=np.full((2, 3), 0.9),
    decay=1.0,
    reference=np.ones((2, 3), dtype=complex),
)
OTHER: dict[str, Any] = {
    "inputs": (Dof(1, Direction.Y), Dof(5, Direction.Y)),
    "frequency": np.array([10.0, 20.0, 31.0]),
    "accelerance": SET.accelerance + 1e-12,
    "deviation": SET.deviation * 2,
    "peak_force": 101.0,
    "temperature": float("nan"),
    "coherence": None,
    "decay": 2.0,
    "reference": None,
    "asked": 1,
}


def test_a_copy_of_a_set_is_equal_to_it() -> None:
    sent = pickle.loads(pickle.dumps(SET))
    assert sent is not SET
    assert (sent, hash(sent)) == (SET, hash(SET))


def test_a_set_that_differs_in_any_value_is_another() -> None:
    assert OTHER.keys() == {each.name for each in fields(HammerSet)}
    others = [replace(SET, **{name: value}) for name, value in OTHER.items()]
    assert len({SET, *others}) == 1 + len(others)
