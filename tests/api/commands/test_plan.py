"""`jointlab plan`: what the paper's test will tell, as text, as numbers and as pictures."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from jointlab.errors import BAD_INPUT
from tests.api.conftest import Command, paper


def test_the_papers_bench_is_planned_with_its_weak_directions_and_remedies(jointlab: Command, tmp_path: Path) -> None:
    answer = jointlab("plan", "paper", "--json", "plan.json")
    assert answer.returncode == 0, answer.stderr
    assert "k11(I) - k11(II) is known to ±" in answer.stdout
    assert "taking k11 = k22 in each joint" in answer.stdout
    document: dict[str, Any] = json.loads((tmp_path / "plan.json").read_text(encoding="utf-8"))
    assert document["format"] == "jointlab-plan/1"
    for joint in ("I", "II"):
        k, half = (np.array(document["joints"][joint][name]) for name in ("k", "k_half_width95"))
        assert 0.003 < half[1, 1] / k[1, 1] < 0.006  # a common factor: gain, density, modulus
        assert half[0, 0] > 0.1 * k[0, 0]  # the sum of both alone is observable
        assert document["design"][joint]["R"] == pytest.approx(2.5 / 0.4)
    assert document["design"]["I"]["theta_deg"] == pytest.approx(45)
    assert document["design"]["II"]["theta_deg"] == pytest.approx(-45)
    conditions = np.array(document["studies"]["condition_numbers"]["modes 1-3"])
    assert np.all(conditions[:20] < 6)
    assert conditions[-1, 0] > 20
    assert np.shape(document["studies"]["sensitivity"]) == (6, len(document["studies"]["k_bar"]))
    page = (tmp_path / "plan.html").read_text(encoding="utf-8")
    assert len(re.findall(r"<figcaption>(?:Fig. [34]|Expected)", page)) == 3


def test_less_noise_and_fewer_points_show_in_what_is_expected(jointlab: Command, tmp_path: Path) -> None:
    document = paper()
    document["article"]["tolerances"] = dict.fromkeys(document["article"]["tolerances"], 0.0)
    (tmp_path / "exact.yaml").write_text(yaml.safe_dump(document), encoding="utf-8")
    widths = []
    for noise in (0.003, 0.0015):
        assert jointlab("plan", "exact.yaml", "--noise", noise, "--json", "plan.json").returncode == 0
        found = json.loads((tmp_path / "plan.json").read_text(encoding="utf-8"))
        widths.append(found["joints"]["I"]["k_half_width95"][1][1])
    assert widths[0] / widths[1] == pytest.approx(2.0, rel=1e-3)


def test_a_bench_of_three_joints_is_planned_as_one_of_two_is(jointlab: Command, tmp_path: Path) -> None:
    document = paper()
    amid = {**document["article"]["joints"][0], "name": "M", "node": 5}
    document["article"]["joints"].insert(1, amid)
    (tmp_path / "three.yaml").write_text(yaml.safe_dump(document), encoding="utf-8")
    answer = jointlab("plan", "three.yaml", "--elements", 1, "--json", "plan.json")
    assert answer.returncode == 0, answer.stderr
    found = json.loads((tmp_path / "plan.json").read_text(encoding="utf-8"))
    assert list(found["joints"]) == list(found["design"]) == ["I", "M", "II"]
    assert np.shape(found["studies"]["condition_numbers"]["modes 1-6"]) == (41, 3)
    assert any("k11(M)" in text for text in found["weak_directions"])
    page = (tmp_path / "plan.html").read_text(encoding="utf-8")
    assert "joint M" in page


def test_a_sequence_without_supported_beam_cannot_be_planned(jointlab: Command) -> None:
    refused = jointlab("plan", "suspended")
    assert refused.returncode == BAD_INPUT
    assert "no hammer step on the supported beam to plan" in refused.stderr


@pytest.mark.filterwarnings("error")
def test_a_term_that_is_zero_has_a_half_width_and_no_share_of_it(jointlab: Command, tmp_path: Path) -> None:
    """Upright cylinders do not couple, and an ideal spring has no loss."""
    article = paper()
    for joint in article["article"]["joints"]:
        joint["inclinations_deg"] = [0, 180]
    (tmp_path / "upright.yaml").write_text(yaml.safe_dump(article), encoding="utf-8")
    answer = jointlab("plan", "upright.yaml", "--loss-factor", 0, "--elements", 1)
    assert answer.returncode == 0, answer.stderr
    widths = {line[:10]: line for line in answer.stdout.splitlines() if "± " in line and line.startswith("I ")}
    assert [key.split()[1] for key, line in widths.items() if "%" in line] == ["k11", "k22"]
    assert len(widths) == 6


@pytest.mark.parametrize("highest", [4.0, 19.0])
def test_a_range_without_a_line_is_refused_with_what_to_change(
    jointlab: Command, tmp_path: Path, highest: float
) -> None:
    sequence = paper()
    sequence["steps"][0]["highest_frequency"] = highest
    (tmp_path / "low.yaml").write_text(yaml.safe_dump(sequence), encoding="utf-8")
    refused = jointlab("plan", "low.yaml")
    assert refused.returncode != 0
    assert f"no line from 20 to {highest:g} Hz; raise highest_frequency" in refused.stderr


def test_the_sequence_is_not_written_over_by_its_plan(jointlab: Command, tmp_path: Path) -> None:
    text = yaml.safe_dump(paper())
    (tmp_path / "own.yaml").write_text(text, encoding="utf-8")
    refused = jointlab("plan", "own.yaml", "-o", "own.yaml")
    assert refused.returncode != 0
    assert "name another file to write" in refused.stderr
    assert (tmp_path / "own.yaml").read_text(encoding="utf-8") == text


@pytest.mark.parametrize(("option", "value"), [("--elements", "100000000"), ("--noise", "inf")])
def test_options_beyond_their_limits_are_refused(jointlab: Command, option: str, value: str) -> None:
    """A mesh of any size was built, until the memory was full."""
    answer = jointlab("plan", "paper", option, value)
    assert answer.returncode == 2
    assert f"Invalid value for '{option}'" in answer.stderr
