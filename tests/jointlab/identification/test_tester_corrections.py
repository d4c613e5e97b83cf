"""A tester with a frame, a fixture and a late channel: known pieces show them, and corrected results are the truth."""

import json
import re
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.stats import chi2

from analysis.direct.corrections import TesterEffect
from analysis.direct.point_covariance import joint_covariance
from analysis.direct.temperature import EFFECT as TEMPERATURE_SHIFT
from jointlab.errors import BAD_INPUT
from jointlab.identification.load import measurement_of_run
from jointlab.identification.options import SWITCHES, Options
from jointlab.identification.pipeline import Identification, identify
from jointlab.report.section import NO_BREAK
from jointlab.trials.simulated_truth import SineTruth, sine_truths
from simlab.laboratory import Laboratory
from simlab.ordinary import BenchConditions
from simlab.tester_frame import TesterFrame
from store.catalogue import Catalogue
from tests.api.conftest import SPEED, Command, paper

FRAME = TesterFrame(compliance=3e-8, fixture_mass=0.15, delay=150e-6)
COMPOUND = {
    "reference_celsius": 23.0,
    "stiffness_per_kelvin": -0.003,
    "stiffness_per_kelvin_error": 0.001,
    "loss_factor_per_kelvin": -0.004,
    "loss_factor_per_kelvin_error": 0.002,
}


@pytest.fixture(scope="module")
def running_laboratory() -> Iterator[Laboratory]:
    with Laboratory(3, SPEED, BenchConditions(frame=FRAME)) as laboratory:
        yield laboratory


@pytest.fixture
def calibrated(tmp_path: Path) -> Path:
    document = paper()
    document["compound"] = COMPOUND
    document["steps"] = [
        {"step": "blank", "stiffness": 2e8, "frequencies": {"first": 40, "last": 200, "step": 40}},
        document["steps"][1]
        | {"specimens": ["I"], "amplitudes_pp_mm": [0.1], "frequencies": {"first": 40, "last": 200, "step": 40}},
        {"step": "blank", "piece": "empty", "stiffness": 0, "amplitude_pp_mm": 0.1},
    ]
    path = tmp_path / "calibrated.yaml"
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    return path


def errors(found: Identification, dwells: list[dict[str, Any]]) -> tuple[float, list[SineTruth]]:
    """Largest relative error of the complex stiffness."""
    sines = sine_truths(found.measurement.points, dwells)
    off = [abs(each.point.result.complex_stiffness / complex(each.k, each.h) - 1) for each in sines]
    return float(np.max(off)), list(sines)


def misfit(sines: list[SineTruth]) -> float:
    """Sum of squared errors of k in standard errors, by the covariance that the points have together."""
    errors = [each.point.result.stiffness - each.k for each in sines]
    covariance = joint_covariance([each.point.result for each in sines])[::2, ::2]
    return float(errors @ np.linalg.solve(covariance, errors))


@pytest.mark.usefixtures("drive", "operator")
def test_corrected_results_are_within_one_per_cent_of_the_truth(
    jointlab: Command, calibrated: Path, laboratory: Laboratory, tmp_path: Path, query: Callable[[str], list[Any]]
) -> None:
    assert "blank: 5 sine points on 'blank' (2e+08 N/m, 0 kg)" in jointlab("run", calibrated, "--dry-run").stdout
    ran = jointlab("run", calibrated)
    assert ran.returncode == 0, ran.stderr
    rows = query("SELECT configuration, count(*) FROM sine_records GROUP BY configuration ORDER BY 1")
    assert rows == [("angled", 5), ("blank", 15), ("compression", 5), ("shear", 5)]
    dwells = [asdict(dwell) for dwell in laboratory.tester.actuator.log]
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue:
        measurement = measurement_of_run(catalogue, 1)
    as_measured, _ = errors(identify(measurement, Options(without=SWITCHES)), dwells)
    assert as_measured > 0.3
    found = identify(measurement, Options(without=("temperature_shift",)))
    worst, sines = errors(found, dwells)
    assert worst < 0.01
    assert misfit(sines) < chi2.isf(1e-6, len(sines))
    applied = {each.effect: each for each in found.corrections.applied}
    for effect, true in (
        ("frame_compliance", FRAME.compliance),
        ("fixture_inertia", FRAME.fixture_mass),
        ("transducer_lag", FRAME.delay),
    ):
        assert applied[effect].value == pytest.approx(true, rel=0.01), effect
        assert abs(applied[effect].value - true) < 6 * applied[effect].standard_error
    only_frame = identify(measurement, Options(without=("fixture_inertia", "transducer_lag", "temperature_shift")))
    assert 0.01 < errors(only_frame, dwells)[0] < as_measured

    answer = jointlab("identify", 1, "--json", "found.json", "--without", "transducer_lag")
    assert answer.returncode == 0, answer.stderr
    said = re.search(r"frame compliance\s+c\s+(\S+) ±", answer.stdout)
    assert said is not None
    assert float(said[1]) == pytest.approx(FRAME.compliance, rel=0.01)
    assert re.search(r"temperature shift\s+beta\s+-0\.004", answer.stdout)
    assert "Switched off by hand: transducer lag." in answer.stdout
    document = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))["corrections"]
    assert document["switched_off"] == ["transducer_lag"]
    assert [each["parameter"] for each in document["applied"]] == ["c", "m", "alpha", "beta"]
    calibration = document["calibration"]
    # noise alone exceeds the limit of that warning once in a thousand runs
    assert [each for each in calibration["warnings"] if not each.startswith("chi-square")] == []
    assert calibration["chi_square"] < chi2.isf(1e-6, calibration["degrees_of_freedom"])
    ((settings,),) = query("SELECT settings FROM analyses WHERE kind = 'dynamic_stiffness'")
    kept = json.loads(settings)
    assert (kept["corrections"], kept["switched_off"]) == (document["applied"], ["transducer_lag"])
    assert Options.of_settings(kept["options"]) == Options(without=("transducer_lag",))
    assert query("SELECT DISTINCT configuration FROM v_dynamic_stiffness ORDER BY 1") == [
        ("angled",), ("compression",), ("shear",)
    ]  # fmt: skip

    assert jointlab("report", 1, "-o", "report.html").returncode == 0
    page = (tmp_path / "report.html").read_text(encoding="utf-8").replace(NO_BREAK, " ")
    claim = "ASTM D5992: 2 of 5 points lie within its 0.01-100 Hz"
    for words in ("Corrections of the tester", "frame compliance", "transducer lag", claim):
        assert words in page


def test_a_correction_that_does_not_exist_is_named(jointlab: Command, bundle: Path) -> None:
    answer = jointlab("identify", bundle, "--without", "gravity")
    assert answer.returncode == BAD_INPUT
    assert "no correction gravity; there are transducer_lag, frame_compliance, fixture_inertia" in answer.stderr


def test_the_switches_are_all_corrections_there_are() -> None:
    assert set(SWITCHES) == {*map(str, TesterEffect), TEMPERATURE_SHIFT}
