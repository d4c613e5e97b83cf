"""`jointlab stiffness`: the fitted law from the command line, of a run and of a bundle."""

import json
from pathlib import Path
from typing import Any

import pytest

from store.catalogue import Catalogue
from store.measurements.runs import start_run
from tests.api.conftest import Command

AT = ("--amplitude", 0.03, "--frequency", 80)


def test_a_run_is_asked_for_people_and_for_programs(jointlab: Command, measured: int) -> None:
    answer = jointlab("stiffness", measured, *AT, "--json", "found.json")
    assert answer.returncode == 0, answer.stderr
    assert "Stiffness at 0.03 mm peak to peak and 80 Hz" in answer.stdout
    assert "Where a single specimen lies, if I, II are of one kind" in answer.stdout
    assert "extrapolated" not in answer.stdout
    found = _read("found.json")
    assert not found["extrapolated"]
    one, other = found["specimens"]
    assert [one["specimen"], other["specimen"]] == ["I", "II"]
    for term in (one["shear"], one["compression"], *one["joint"].values()):
        for name in ("k", "h", "gamma"):
            low, high = term[f"{name}_ci95"]
            assert low < term[name] < high
    # joints lean by 45 degrees to either side, Eqs. (13)-(15), and a frame that leans a little keeps the sum
    of_joint = one["joint"]["k11"]["k"] + one["joint"]["k22"]["k"]
    assert of_joint == pytest.approx(2 * (one["shear"]["k"] + one["compression"]["k"]))
    assert one["joint"]["k12"]["k"] > 0 > other["joint"]["k12"]["k"]
    scatter = found["scatter"]["shear"]["k"]
    assert scatter["mean"] == pytest.approx((one["shear"]["k"] + other["shear"]["k"]) / 2)


def test_outside_of_what_was_measured_it_says_so(jointlab: Command, measured: int) -> None:
    answer = jointlab("stiffness", measured, "--amplitude", 0.2, "--frequency", 10, "--specimen", "I")
    assert answer.returncode == 0, answer.stderr
    assert "extrapolated, joint I: 0.2 mm is above the measured 0." in answer.stdout
    assert "extrapolated, joint I: 10 Hz is below the measured 20 Hz" in answer.stdout
    assert "One specimen alone does not show" in answer.stdout


def test_a_bundle_is_asked_without_a_database(jointlab: Command, bundle: Path, measured: int, tmp_path: Path) -> None:
    assert jointlab("stiffness", measured, *AT, "--json", "run.json").returncode == 0
    (tmp_path / "jointlab.db").unlink()
    assert jointlab("stiffness", bundle, *AT, "--json", "bundle.json").returncode == 0
    assert not (tmp_path / "jointlab.db").exists()
    of_run, of_bundle = _read("run.json"), _read("bundle.json")
    assert of_bundle["analysis_id"] is None
    for one, other in zip(of_run["specimens"], of_bundle["specimens"], strict=True):
        assert other["compression"]["k"] == pytest.approx(one["compression"]["k"], rel=0.02)


def test_a_run_that_was_not_identified_is_refused_with_what_to_do(jointlab: Command, tmp_path: Path) -> None:
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue, catalogue.writing() as session:
        run = start_run(session, kind="sweep", title="sweep", article="beam 3", setup={})
    answer = jointlab("stiffness", run.id, *AT)
    assert answer.returncode == 3
    assert f"identify it first: jointlab identify {run.id}" in answer.stderr


def test_points_without_all_three_configurations_have_no_law(jointlab: Command, bundle: Path) -> None:
    table = bundle / "direct.csv"
    lines = table.read_text(encoding="utf-8").splitlines(keepends=True)
    table.write_text("".join(line for line in lines if ",angled," not in line), encoding="utf-8")
    answer = jointlab("stiffness", bundle, *AT)
    assert answer.returncode == 3
    assert "measured in compression, shear, angled: joint I 0, joint II 0" in answer.stderr


def test_a_joint_that_is_not_there_is_named(jointlab: Command, bundle: Path) -> None:
    answer = jointlab("stiffness", bundle, *AT, "--specimen", "III")
    assert (answer.returncode, "no law for joint III; there are I, II" in answer.stderr) == (3, True)


def test_help_says_what_is_asked_and_shows_an_example(jointlab: Command) -> None:
    said = " ".join(jointlab("stiffness", "--help").stdout.split())
    assert "jointlab stiffness 3 --amplitude 0.03 --frequency 80" in said
    assert "peak to peak, mm" in said
    assert "outside of what was measured the answer says so" in said


def _read(name: str) -> dict[str, Any]:
    document: dict[str, Any] = json.loads(Path(name).read_text(encoding="utf-8"))
    return document
