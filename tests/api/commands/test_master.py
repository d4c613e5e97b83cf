"""`jointlab master`: the master curve of a specimen from the runs in the catalogue."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from jointlab.identification.inverse import LIKELIHOOD
from jointlab.sequences import BUILT_IN, built_in
from store.catalogue import Catalogue
from store.measurements.runs import start_run
from store.results.analyses import add_analysis
from store.results.joint_matrices import JointMatrix, add_joint_matrix
from store.states import AnalysisKind
from tests.analysis.direct.materials import Material
from tests.api.conftest import Command
from tests.master_sweeps import store_sweeps

ASKED = ("beam 3", "I", "--frequency", 1000, "--temperature", 23)


@pytest.fixture
def catalogue_file(tmp_path: Path, sqlite_template: Path) -> Path:
    path = tmp_path / "jointlab.db"
    path.write_bytes(sqlite_template.read_bytes())
    return path


def stored(path: Path, sweeps: Sequence[float | None], configuration: str = "angled") -> Material:
    """A run of the tester at each temperature; None for one without a thermometer."""
    with Catalogue.open(f"sqlite:///{path}") as catalogue:
        return store_sweeps(catalogue, sweeps, configuration)


def test_a_frequency_beyond_the_tester_is_answered_from_colder_sweeps(
    jointlab: Command, catalogue_file: Path, tmp_path: Path
) -> None:
    material = stored(catalogue_file, [5.0, 23.0, 38.0])
    answer = jointlab("master", *ASKED, "--picture", "curve.svg", "--json", "found.json")
    assert answer.returncode == 0, answer.stderr
    assert "Reduced frequencies from" in answer.stdout
    assert "extrapolated" not in answer.stdout
    found = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))
    (point,) = found["predictions"]
    true = material.stiffness(1000, 23)
    assert point["k_ci95"][0] < true.real < point["k_ci95"][1]
    assert point["gamma_ci95"][0] < true.imag / true.real < point["gamma_ci95"][1]
    assert found["runs"] == [1, 2, 3]
    low, high = found["reduced_frequencies_covered"]
    assert low < 5 < 1000 < high
    assert "<svg" in (tmp_path / "curve.svg").read_text(encoding="utf-8")


def test_beyond_the_covered_frequencies_it_says_so(jointlab: Command, catalogue_file: Path) -> None:
    stored(catalogue_file, [23.0, 38.0, 53.0, None])
    answer = jointlab("master", *ASKED)
    assert answer.returncode == 0, answer.stderr
    assert "extrapolated at 1000 Hz: 1e+03 Hz of reduced frequency is above the measured" in answer.stdout
    assert (
        "as no temperature was recorded: 12 points in the angled configuration, 0.01 mm peak to peak (run 4)"
        in answer.stdout
    )


def test_too_few_temperatures_are_answered_with_what_to_do(jointlab: Command, catalogue_file: Path) -> None:
    stored(catalogue_file, [23.0])
    answer = jointlab("master", *ASKED)
    assert answer.returncode != 0
    assert "Measure the same specimen again 10 to 20 K colder" in answer.stderr
    stored(catalogue_file, [8.0])
    assert "Take Arrhenius, give C1 and C2" in jointlab("master", *ASKED).stderr
    assert "E = " in jointlab("master", *ASKED, "--shift", "arrhenius").stdout
    assert "C1 = 9.00 (given), C2 = 100 K (given)" in jointlab("master", *ASKED, "--wlf", 9, 100).stdout


def test_a_specimen_without_points_is_answered_with_what_there_is(jointlab: Command, catalogue_file: Path) -> None:
    stored(catalogue_file, [8.0, 23.0], configuration="shear")
    assert "there are: shear, 0.01 mm p-p" in jointlab("master", *ASKED, "--configuration", "angled").stderr
    assert "there are: nothing" in jointlab("master", "beam 3", "IX", *ASKED[2:]).stderr


def test_runs_may_be_named_and_the_others_are_said_to_be_left_out(jointlab: Command, catalogue_file: Path) -> None:
    stored(catalogue_file, [5.0, 23.0, 38.0, 70.0])
    answer = jointlab("master", *ASKED, "--run", 1, "--run", 2, "--run", 3)
    assert answer.returncode == 0, answer.stderr
    assert (
        "as other runs were asked for: 12 points in the angled configuration, 0.01 mm peak to peak (run 4)"
        in answer.stdout
    )
    assert "there is no run 77" in jointlab("master", *ASKED, "--run", 77).stderr


@pytest.mark.parametrize("law", ["constant", "zener"])
def test_k22_by_the_hammer_stands_beside_the_angled_pair(jointlab: Command, catalogue_file: Path, law: str) -> None:
    stored(catalogue_file, [5.0, 23.0, 38.0])
    _store_hammer(catalogue_file, law)
    answer = jointlab("master", *ASKED, "--json", "found.json")
    assert answer.returncode == 0, answer.stderr
    assert "Beside k22 by the hammer" in answer.stdout
    (beside,) = json.loads((catalogue_file.parent / "found.json").read_text(encoding="utf-8"))["hammer_k22"]
    assert beside["law"] == law
    # a joint that follows frequency is known from 20 to 2000 Hz: half way in the logarithm is 200 Hz, 1 kHz is 0.85
    expected = 2e6 if law == "constant" else 2e6 + 1e6 * np.log(1000 / 20) / np.log(100)
    assert beside["k"] == pytest.approx(expected)


def test_k22_of_a_joint_that_is_not_drawn_at_45_degrees_is_another_stiffness_and_not_shown(
    jointlab: Command, catalogue_file: Path
) -> None:
    stored(catalogue_file, [5.0, 23.0, 38.0])
    _store_hammer(catalogue_file, "constant", inclination=40.0)
    answer = jointlab("master", *ASKED, "--json", "found.json")
    assert answer.returncode == 0, answer.stderr
    assert "Beside k22 by the hammer" not in answer.stdout
    assert json.loads((catalogue_file.parent / "found.json").read_text(encoding="utf-8"))["hammer_k22"] == []


def _store_hammer(path: Path, law: str, inclination: float = 45.0) -> None:
    setup = built_in(BUILT_IN).article.model_dump(mode="json")
    for joint in setup["joints"]:
        joint["inclinations_deg"] = [float(np.copysign(inclination, each)) for each in joint["inclinations_deg"]]
    grid = np.full((3, 3), 2e6)
    ends = np.stack([0.9 * grid, 1.1 * grid], axis=-1)

    def at(stiffness: float) -> dict[str, Any]:
        return {"k": np.full((3, 3), stiffness).tolist(), "k_ci95": np.full((3, 3, 2), stiffness).tolist()}

    both = [at(2e6), at(3e6)]
    followed = {"law": law, "frequency_hz": [20.0, 2000.0]} | {name: [each[name] for each in both] for name in both[0]}
    settings = {"passed": True, "over_frequency": {} if law == "constant" else {"I": followed}}
    with Catalogue.open(f"sqlite:///{path}") as catalogue, catalogue.writing() as session:
        run = start_run(session, kind="hammer", title="hammer", article="beam 3", setup=setup)
        made = add_analysis(
            session, kind=AnalysisKind.JOINT_MATRICES, method=LIKELIHOOD, settings=settings, runs=[run.id]
        )
        observable = np.ones((3, 3), dtype=np.bool_)
        add_joint_matrix(session, made, JointMatrix("I", 2, grid, grid, ends, ends, grid, ends, observable))


def test_a_picture_of_another_kind_is_refused_before_the_fit(jointlab: Command, tmp_path: Path) -> None:
    answer = jointlab(
        "master", "beam", "I", "--frequency", "100", "--temperature", "23", "--picture", tmp_path / "p.xyz"
    )
    assert answer.returncode != 0
    assert "is to end in .svg or .png" in answer.stderr
