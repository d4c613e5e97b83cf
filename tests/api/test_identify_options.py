"""What `identify` lets one choose by hand: the mesh, and joints that follow frequency."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.api.conftest import Command


def test_mesh_and_joints_that_follow_frequency_are_chosen_told_and_stored(
    jointlab: Command, measured: int, tmp_path: Path, query: Callable[[str], list[tuple[Any, ...]]]
) -> None:
    answer = jointlab("identify", measured, "--elements", 4, "--joint-exponent", 0.1, "--json", "found.json")
    assert answer.returncode == 0, answer.stderr
    model = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))["inverse_model"]
    assert model["elements"] == 4 * 10
    assert set(model["exponents"]) == {"I", "II"}
    for name, exponent in model["exponents"].items():
        low, high = exponent["ci95"]
        assert low < exponent["value"] < high
        assert f"Joint {name} follows the power {exponent['value']:.4f}" in answer.stdout
    ((settings,),) = query("SELECT settings FROM analyses WHERE settings LIKE '%noise_scale%' ORDER BY id DESC LIMIT 1")
    stored = json.loads(settings)
    assert (stored["elements"], stored["tolerances"]["joint_exponent"]) == (40, 0.1)


@pytest.mark.parametrize(("option", "value"), [("--elements", 0), ("--elements", 33), ("--joint-exponent", -0.1)])
def test_a_choice_out_of_range_is_refused_with_what_is_allowed(jointlab: Command, option: str, value: float) -> None:
    answer = jointlab("identify", 1, option, value)
    assert answer.returncode == 2
    assert f"Invalid value for '{option}': Input should be" in answer.stderr
