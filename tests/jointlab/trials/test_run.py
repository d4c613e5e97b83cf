"""A whole trial of one case, and a killed one that goes on."""

import json
from pathlib import Path

import pytest

from jointlab.errors import JointlabError
from jointlab.trials.folder import TrialFolder, read, write
from jointlab.trials.plan import plan
from jointlab.trials.run import TrialSettings, carry_out, seal_all
from tests.api.conftest import Command


def test_a_trial_seals_diagnoses_opens_and_scores(jointlab: Command, tmp_path: Path) -> None:
    arguments = ("gap", "trial", "--cases", 1, "--seed", 3, "--seal", "trial", "--workers", 1)
    answer = jointlab(*arguments, "--publish", "scores.json")
    assert answer.returncode == 0, answer.stderr
    assert "1 cases, 0 without an answer." in answer.stdout
    folder = TrialFolder(tmp_path / "trial")
    assert set(folder.commitments) == {"0001"}
    assert folder.open(plan(1, 3)[0])["kind"] == "single"
    written = {file.name for file in folder.path.iterdir()}
    assert written >= {"scores.json", "scores.md", "reliability.svg", "confusion.svg"}
    published = json.loads((tmp_path / "scores.json").read_text(encoding="utf-8"))
    assert (published["cases"], len(published["verdicts"])) == (1, 1)
    # given again, nothing is left to do
    file = folder.answer_file(plan(1, 3)[0])
    before = file.stat().st_mtime_ns
    assert jointlab(*arguments).returncode == 0
    assert file.stat().st_mtime_ns == before
    # and it is no other trial
    other = jointlab("gap", "trial", "--cases", 2, "--seed", 3, "--seal", "trial")
    assert other.returncode == 3
    assert "holds another trial" in other.stderr


def test_a_killed_trial_asks_for_what_has_no_answer_only(tmp_path: Path) -> None:
    trial = TrialSettings(cases=1, seed=3, folder=tmp_path / "trial", workers=1)
    folder, cases = TrialFolder(trial.folder), plan(1, 3)
    folder.begin(trial.settings)
    seal_all(folder, cases)
    committed = folder.commitments
    for case in cases:
        folder.keep(case, {"error": f"answered before it was killed: {case.name}", "seconds": 1.0})
    found = carry_out(trial)
    assert folder.commitments == committed
    assert [each.split(": ", 1)[1] for each in found["failed"]] == ["answered before it was killed: 0001"]
    assert read(trial.folder / "scores.json") == found


def test_a_trial_that_stops_judges_what_was_answered(tmp_path: Path) -> None:
    trial = TrialSettings(cases=3, seed=3, folder=tmp_path / "trial", workers=1)
    folder, cases = TrialFolder(trial.folder), plan(3, 3)
    folder.begin(trial.settings)
    seal_all(folder, cases)
    folder.keep(cases[2], {"error": "answered in time", "seconds": 1.0})
    found = carry_out(trial, stop=True)
    assert found["cases"] == 1
    assert [each.split(": ", 1)[1] for each in found["failed"]] == ["answered in time"]


def test_marks_of_another_version_are_refused_with_what_to_do(tmp_path: Path) -> None:
    trial = TrialSettings(cases=1, seed=3, folder=tmp_path / "trial", workers=1)
    folder, cases = TrialFolder(trial.folder), plan(1, 3)
    folder.begin(trial.settings)
    seal_all(folder, cases)
    folder.keep(cases[0], {"error": "answered before", "seconds": 1.0})
    carry_out(trial)
    write(folder.judgement_file(cases[0]), {"number": 1})
    with pytest.raises(JointlabError, match=r"0001\.json was written by another version .* judges all answers again"):
        carry_out(trial)


def test_random_laws_are_not_measured_over_the_wires(tmp_path: Path) -> None:
    with pytest.raises(JointlabError, match="add --plain"):
        TrialSettings(cases=1, seed=3, folder=tmp_path, through_instruments=True)
