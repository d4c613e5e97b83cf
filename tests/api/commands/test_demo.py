"""The demo: the whole job through the wires, and how near to the truth it comes."""

import itertools
import json
import os
import re
import signal
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from api.cli import main
from jointlab.identification.inverse import LIKELIHOOD, PAPER
from jointlab.trials.instruments import sequence_of
from rig.sequences.sequence import Sequence
from tests.api.conftest import SPEED, Command, demo_sequence
from tests.once import made_once
from tests.waiting import LONG

CONFIGURATIONS = ["angled", "compression", "shear"]
FREQUENCIES = [20.0, 98.0, 180.0]


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What `jointlab demo` left, with the sealed bench."""
    return made_once(tmp_path_factory, "whole-demo", _run_demo)


def _run_demo(folder: Path) -> None:
    (folder / "demo.yaml").write_text(yaml.safe_dump(demo_sequence()), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        options = f"--folder={folder}", f"--sequence={folder}/demo.yaml", f"--speed={SPEED:g}"
        patch.setattr(sys, "argv", ["jointlab", "demo", *options])
        patch.setattr("jointlab.trials.demonstration.sequence_of", _short_sequence)
        with pytest.raises(SystemExit) as ended:
            main()
    assert not ended.value.code


def _short_sequence(drawing: dict[str, Any], blows: int, frequency_step: float) -> Sequence:
    """That of the sealed bench with blocks of 1 s, two of its hammer sets and a third of the sine points."""
    whole = sequence_of(drawing, blows, 3 * frequency_step)
    sets = (step.model_copy(update={"block_seconds": 1.0}) for step in whole.hammer_steps[:2])
    return whole.model_copy(update={"steps": (*sets, whole.steps[-1])})


@pytest.fixture(scope="session")
def summary(demo: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((demo / "summary.json").read_text(encoding="utf-8"))
    return document


def series(direct: dict[str, Any]) -> list[tuple[str, str, str, dict[str, Any]]]:
    return [
        (joint, configuration, amplitude, points)
        for joint, by_configuration in direct.items()
        for configuration, by_amplitude in by_configuration.items()
        for amplitude, points in by_amplitude.items()
    ]


def test_the_summary_has_the_form_of_an_identification(summary: dict[str, Any]) -> None:
    assert summary["format"] == "jointlab-identification/1"
    modes = summary["modes"]
    count = len(modes["frequency_hz"])
    assert count >= 6
    for name in ("loss_factor", "predicted_hz"):
        assert len(modes[name]) == count
    for name in ("frequency_ci95", "loss_factor_ci95"):
        assert np.shape(modes[name]) == (count, 2)
    for value, (low, high) in zip(modes["frequency_hz"], modes["frequency_ci95"], strict=True):
        assert low < value < high

    for inverse, joint in itertools.product((summary["inverse"], summary["inverse_paper"]), ("I", "II")):
        assert set(inverse) == {"I", "II", "weak_directions"}
        assert all(isinstance(text, str) for text in inverse["weak_directions"])
        found = inverse[joint]
        for name, shape in {
            "k": (3, 3),
            "h": (3, 3),
            "gamma": (3, 3),
            "k_ci95": (3, 3, 2),
            "h_ci95": (3, 3, 2),
            "observable": (3, 3),
        }.items():
            assert np.shape(found[name]) == shape, name
        assert np.allclose(found["k"], np.transpose(found["k"]))
        limits = np.array(found["k_ci95"])
        assert np.all((limits[..., 0] < found["k"]) & (found["k"] < limits[..., 1]))
        assert all(type(flag) is bool for row in found["observable"] for flag in row)

    assert [key[:3] for key in series(summary["direct"])] == [
        (joint, configuration, amplitude)
        for joint in ("I", "II")
        for configuration in ("compression", "shear", "angled")
        for amplitude in ("0.1", "0.01")
    ]
    for *_, points in series(summary["direct"]):
        assert points["frequency_hz"] == pytest.approx(FREQUENCIES, rel=1e-3)
        for name in ("k", "h", "gamma"):
            assert len(points[name]) == len(FREQUENCIES)
        for name in ("k_ci95", "gamma_ci95"):
            assert np.shape(points[name]) == (len(FREQUENCIES), 2)

    assert {(each["joint"], each["element"]) for each in summary["comparison"]} >= {
        (joint, element) for joint in ("I", "II") for element in ("k22", "k12", "gamma22")
    }
    for each in summary["comparison"]:
        assert len(each["direct"]) == 2
        assert each["inverse"] is None or len(each["inverse"]) == 2
        assert each["verdict"] in ("agree", "differ", "not comparable")


def test_the_truth_has_the_same_shape_beside_the_result(summary: dict[str, Any]) -> None:
    truth = summary["truth"]
    for joint in ("I", "II"):
        for name in ("k", "h", "gamma"):
            assert np.shape(truth["inverse"][joint][name]) == (3, 3)
    assert truth["modes"]
    found, true = series(summary["direct"]), series(truth["direct"])
    assert sorted(each[:3] for each in true) == sorted(each[:3] for each in found)
    for *_, points in true:
        assert points["frequency_hz"] == pytest.approx(FREQUENCIES, rel=1e-3)
        assert all(len(points[name]) == len(FREQUENCIES) for name in ("k", "h", "gamma"))


def test_seconds_are_told_for_every_stage(summary: dict[str, Any]) -> None:
    seconds = summary["seconds"]
    assert set(seconds) == {"start", "measure", "identify", "sealed bench", "report", "total"}
    stages = sum(value for stage, value in seconds.items() if stage != "total")
    assert 0.8 * seconds["total"] < stages <= seconds["total"] + 0.05


def test_direct_k_and_gamma_are_within_one_and_three_per_cent_of_the_truth(summary: dict[str, Any]) -> None:
    truth = summary["truth"]["direct"]
    for joint, configuration, amplitude, points in series(summary["direct"]):
        allowed = {"0.1": 0.01, "0.01": 0.03}[amplitude]
        for name in ("k", "gamma"):
            expected = truth[joint][configuration][amplitude][name]
            assert points[name] == pytest.approx(expected, rel=allowed), (joint, configuration, amplitude, name)


def test_k22_by_the_papers_method_is_within_three_per_cent_of_the_truth(summary: dict[str, Any]) -> None:
    for joint in ("I", "II"):
        true = summary["truth"]["inverse"][joint]["k"][1][1]
        assert summary["inverse_paper"][joint]["k"][1][1] == pytest.approx(true, rel=0.03)


def test_k12_and_k22_by_maximum_likelihood_are_within_three_per_cent_of_the_truth(summary: dict[str, Any]) -> None:
    for joint, element in itertools.product(("I", "II"), ((0, 1), (1, 1))):
        found, true = (
            np.array(part[joint]["k"])[element] for part in (summary["inverse"], summary["truth"]["inverse"])
        )
        assert found == pytest.approx(true, rel=0.03), (joint, element)


def test_what_the_demo_found_is_in_the_views(demo: Path, summary: dict[str, Any]) -> None:
    with closing(sqlite3.connect(f"file:{demo / 'jointlab.db'}?mode=ro", uri=True)) as connection:
        runs = connection.execute("SELECT state, blows_accepted, sine_records, kind FROM v_runs").fetchall()
        assert runs == [("finished", 110, 36, "sequence")]
        modes = connection.execute("SELECT frequency, frequency_low FROM v_modes WHERE latest ORDER BY number")
        rows = modes.fetchall()
        assert [row[0] for row in rows] == summary["modes"]["frequency_hz"]
        assert [row[1] for row in rows] == [low for low, _ in summary["modes"]["frequency_ci95"]]
        stiffness = connection.execute(
            "SELECT method, joint, matrix_row, matrix_column, stiffness, observable FROM v_joint_stiffness WHERE latest"
        ).fetchall()
        by_method = {LIKELIHOOD: summary["inverse"], PAPER: summary["inverse_paper"]}
        assert len(stiffness) == 2 * 18
        for method, joint, row, column, value, observable in stiffness:
            found = by_method[method][joint]
            assert value == found["k"][row - 1][column - 1]
            assert bool(observable) is found["observable"][row - 1][column - 1]
        shear = connection.execute(
            "SELECT stiffness, loss_factor FROM v_dynamic_stiffness WHERE latest AND specimen = 'II' "
            "AND configuration = 'shear' AND amplitude_pp_mm = 0.01 ORDER BY frequency"
        ).fetchall()
        points = summary["direct"]["II"]["shear"]["0.01"]
        assert shear == list(zip(points["k"], points["gamma"], strict=True))
        verdicts = connection.execute("SELECT joint, element, verdict FROM v_comparison WHERE latest").fetchall()
        assert set(verdicts) == {(each["joint"], each["element"], each["verdict"]) for each in summary["comparison"]}


def test_the_demo_ends_with_the_diagnosis_of_a_sealed_bench(demo: Path, summary: dict[str, Any]) -> None:
    gap = summary["gap"]
    assert gap["diagnosis"]["format"] == "jointlab-diagnosis/1"
    assert gap["diagnosis"]["verdict"]["effects"] == gap["seal"]["truth"]["effects"]
    assert gap["seal"]["right"]
    assert gap["diagnosis"]["gap"]["after"]["percent"] < gap["diagnosis"]["gap"]["before"]["percent"]
    with closing(sqlite3.connect(f"file:{demo / 'sealed.db'}?mode=ro", uri=True)) as connection:
        assert connection.execute("SELECT status FROM diagnoses").fetchall() == [("explained",)]
    assert gap["seal"]["commitment"] in (demo / "gap.html").read_text(encoding="utf-8")


def test_every_row_knows_the_calibration_behind_it(demo: Path) -> None:
    with closing(sqlite3.connect(demo / "jointlab.db")) as connection:
        rows = connection.execute(
            "SELECT channels.name, instruments.serial, calibrations.calibrated_on FROM channels "
            "JOIN calibrations ON calibrations.id = channels.calibration_id "
            "JOIN instruments ON instruments.id = calibrations.instrument_id"
        ).fetchall()
        tester = connection.execute("SELECT serial FROM instruments WHERE kind = 'tester'").fetchall()
    assert {row[0] for row in rows} == {"hammer", "accelerometer", "displacement", "force"}
    assert ("hammer", "SIM-H-01", "2026-03-02") in rows
    assert tester == [("SIM-ET-0001",)]


def test_a_demo_needs_nothing_of_the_laboratorys_own_configuration(jointlab: Command, tmp_path: Path) -> None:
    (tmp_path / "jointlab.toml").write_text("broken =", encoding="utf-8")
    (tmp_path / "not-a-folder").write_text("", encoding="utf-8")
    answer = jointlab("demo", "--folder", tmp_path / "not-a-folder", "--speed", 1000)
    assert answer.returncode == 3
    assert answer.stderr == f"jointlab: {tmp_path / 'not-a-folder'} cannot be made: File exists\n"


@pytest.mark.parametrize("arguments", [["--seed", "-1"], ["--speed", "0"], ["--speed", "nan"]])
def test_a_bench_that_cannot_be_is_wrong_usage(jointlab: Command, arguments: list[str]) -> None:
    answer = jointlab("demo", *arguments)
    assert answer.returncode == 2
    assert arguments[0] in answer.stderr


def test_ctrl_c_in_a_demo_stores_what_was_measured_as_a_stopped_run(tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-m", "api.cli", "demo", "--folder", str(tmp_path)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        cwd=Path(__file__).resolve().parents[3],
    )
    with process:
        database, patience_ends = tmp_path / "jointlab.db", time.monotonic() + LONG
        while not (database.exists() and _blows(database) > 2):
            assert process.poll() is None
            assert time.monotonic() < patience_ends
            time.sleep(0.1)
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to everybody in the foreground
        assert process.stderr is not None
        said = process.stderr.read()
        assert process.wait(LONG) == 130, said
    assert said.splitlines()[-1] == "jointlab: interrupted"
    assert "Traceback" not in said
    with closing(sqlite3.connect(database)) as connection:
        assert connection.execute("SELECT state, reason FROM runs").fetchall() == [("stopped", "stopped by hand")]
    assert _blows(database) > 2


def _blows(database: Path) -> int:
    with closing(sqlite3.connect(f"file:{database}?mode=ro", uri=True)) as connection:
        try:
            return int(connection.execute("SELECT count(*) FROM blows").fetchone()[0])
        except sqlite3.OperationalError:  # the tables are not there yet
            return 0


def test_nothing_in_the_report_is_loaded_from_elsewhere(demo: Path) -> None:
    page = (demo / "report.html").read_text(encoding="utf-8")
    references = re.findall(r"""(?:src|href|action|data|poster|srcset)\s*=\s*["']([^"']*)""", page)
    references += re.findall(r"url\(\s*[\"']?([^)\"']*)", page)
    assert references
    assert {reference for reference in references if not reference.startswith(("#", "data:"))} == set()
    assert not re.search(r"@import|<script|<link|<iframe|<object|<embed|<base|http-equiv", page)


def test_the_report_has_the_papers_figures_and_tables(demo: Path) -> None:
    page = (demo / "report.html").read_text(encoding="utf-8")
    for figure in (5, 6, 7, 8, 9, 11, 12, 13, 14):
        pictures = re.findall(rf"<figcaption>Fig. {figure}\b", page)
        assert len(pictures) == (2 if figure in (11, 12) else 1), figure
    assert page.count("<figcaption>") == 12 + 6  # stabilisation too; bars, maps and curves of the gap
    assert 'aria-label="Gap before and after"' in page
    assert "The seal, opened" in page
    for table in (2, 3, 4):
        assert re.search(rf"<caption>Table {table}: ", page), table
    assert "Identified against true" in page


def test_what_is_of_the_sealed_bench_comes_last_and_says_so(demo: Path) -> None:
    titles = re.findall(r"<h2>(?:\d+\. )?(.*?)</h2>", (demo / "report.html").read_text(encoding="utf-8"))
    marked = [title.startswith("The second, sealed bench: ") for title in titles]
    assert marked == sorted(marked)
    assert sum(marked) == 4
    assert not any("gap" in title.lower() or "seal" in title.lower() for title in titles[: -sum(marked)])


def test_ids_in_the_report_are_unique_and_references_find_them(demo: Path) -> None:
    page = (demo / "report.html").read_text(encoding="utf-8")
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(set(ids)) == len(ids)
    references = re.findall(r'href="#([^"]+)"|url\(#([^)]+)\)', page)
    assert set(itertools.chain(*references)) - {""} <= set(ids)
