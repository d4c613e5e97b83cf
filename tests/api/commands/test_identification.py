"""What `identify` lets one choose by hand: the mesh, joints that follow frequency, and a prior under their terms."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from jointlab.report.typography import with_signs
from tests.api.conftest import Command
from tests.jointlab.identification.layouts import LAYOUTS, write_bundle


def test_mesh_joints_that_follow_frequency_and_a_prior_are_chosen_told_and_stored(
    jointlab: Command, measured: int, tmp_path: Path, query: Callable[[str], list[tuple[Any, ...]]]
) -> None:
    chosen = ("--elements", 4, "--joint-law", "power", "--regularise", 0.5)
    answer = jointlab("identify", measured, *chosen, "--json", "found.json")
    assert answer.returncode == 0, answer.stderr
    document = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))
    model, prior = document["inverse_model"], document["inverse_regularisation"]
    assert model["elements"] == 4 * 10
    assert model["law"] == "power"
    assert set(model["law_parameters"]) == {"I", "II"}
    for name, law in model["law_parameters"].items():
        exponent = law["exponent"]
        low, high = exponent["ci95"]
        assert low < exponent["value"] < high
        assert f"Joint {name} follows the power {exponent['value']:.4f}" in answer.stdout
    ((settings,),) = query("SELECT settings FROM analyses WHERE settings LIKE '%noise_scale%' ORDER BY id DESC LIMIT 1")
    stored = json.loads(settings)
    assert (stored["elements"], stored["tolerances"]["joint_law"], stored["regularised"]) == (40, "power", 0.5)
    over = document["inverse_over_frequency"]["II"]
    assert stored["over_frequency"]["II"] == over
    stated = over["frequency_hz"].index(model["reference_hz"])
    np.testing.assert_allclose(over["k_ci95"][stated], document["inverse"]["II"]["k_ci95"], rtol=1e-6)
    assert "Joint II over frequency, a power law" in answer.stdout
    assert "Regularised: every term is taken to lie within 50 %" in answer.stdout
    assert prior["within"] == 0.5
    for effect in prior["joints"].values():
        assert effect["k_prior_share"][1][1] < effect["k_prior_share"][0][0] < 1
        assert np.shape(effect["h_bias"]) == (3, 3)


def test_a_bundle_of_three_joints_is_identified_without_the_papers_method(jointlab: Command, tmp_path: Path) -> None:
    answer = jointlab("identify", write_bundle(LAYOUTS["three joints"], tmp_path / "bundle"), "--json", "found.json")
    assert answer.returncode == 0, answer.stderr
    assert "The paper's method is left out" in answer.stdout
    document = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))
    assert set(document["inverse"]) == {"I", "II", "III", "weak_directions"}
    assert document["inverse_paper"] is None
    assert "measure x at one point for each joint" in document["inverse_paper_left_out"]


def test_remedies_for_the_experiment_are_listed(jointlab: Command, measured: int, tmp_path: Path) -> None:
    answer = jointlab("identify", measured, "--elements", 4, "--json", "found.json")
    assert answer.returncode == 0, answer.stderr
    told = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))["inverse_remedies"]
    assert {text.split(":")[0] for text in told} >= {"the cylinders as parameters", "a second accelerometer at 1x"}
    for text in ("Remedies for the weakest direction", *map(with_signs, told)):
        assert text in " ".join(answer.stdout.split())


@pytest.mark.parametrize(("option", "value"), [("--elements", 0), ("--elements", 33), ("--regularise", 0)])
def test_a_choice_out_of_range_is_refused_with_what_is_allowed(jointlab: Command, option: str, value: float) -> None:
    answer = jointlab("identify", 1, option, value)
    assert answer.returncode == 2
    assert f"Invalid value for '{option}': Input should be" in answer.stderr
