"""Results of several runs over each other, over REST and in the client."""

from collections.abc import Iterator

import httpx
import numpy as np
import pytest

from api.service.application import create_app
from api.service.context import Services
from jointlab.client import Client, ProblemError
from jointlab.identification.pipeline import Identification
from jointlab.identification.save import save_identification
from jointlab.overlay import joint_intervals, read_results
from store.catalogue import Catalogue
from store.measurements.runs import get_run, start_run
from tests.api.service.conftest import served


@pytest.fixture
def http(measured_catalogue: Catalogue, identified: Identification) -> Iterator[httpx.Client]:
    """A service with run 1, run 2 with the same results, and run 3 without any."""
    with measured_catalogue.writing() as session:
        setup = get_run(session, 1).setup
        same = start_run(session, kind="import", title="again", article="a", setup=setup)
        save_identification(session, same.id, identified)
        start_run(session, kind="import", title="not identified", article="a", setup=setup)
    with served(create_app(Services(measured_catalogue))) as http:
        yield http


@pytest.fixture
def lab(http: httpx.Client) -> Iterator[Client]:
    with Client(str(http.base_url)) as client:
        yield client


def test_runs_are_overlaid_with_what_they_have_in_common(lab: Client, measured_catalogue: Catalogue) -> None:
    found = lab.overlay(2, 1, 3)
    assert [each.run_id for each in found.runs] == [2, 1, 3]
    assert [each.sine_points for each in found.runs] == [36, 36, 0]
    assert [each.has_accelerances for each in found.runs] == [True, True, False]
    assert (found.runs[0].joints, found.runs[2].joints) == (["I", "II"], [])
    assert found.amplitudes_pp_mm == [0.01, 0.1]
    assert found.amplitude_pp_mm == 0.01
    assert len(found.sweeps) == 6  # two joints in three configurations
    assert [curve.run_id for curve in found.sweeps[0].curves] == [2, 1]
    assert found.row is not None
    assert (found.row.input, found.row.response) == ("3y", "3y")
    assert found.rows[0] == found.row
    assert [each.run_id for each in found.accelerances] == [2, 1]
    expected = joint_intervals(read_results(measured_catalogue, [2, 1]))
    assert {
        f"{each.term} {each.joint}": {f"run {own.run_id}": own.ci95 for own in each.intervals} for each in found.joints
    } == expected


def test_curves_are_those_of_the_single_runs(lab: Client) -> None:
    found = lab.overlay(1, 2, amplitude_pp_mm=0.1, point="1y")
    shear = next(each for each in found.sweeps if (each.specimen, each.configuration) == ("II", "shear"))
    points = [
        each
        for each in lab.dynamic_stiffness(1)
        if (each.specimen, each.configuration, each.amplitude_pp_mm) == ("II", "shear", 0.1)
    ]
    points.sort(key=lambda each: each.frequency)
    first = shear.curves[0]
    assert first.frequency == [each.reached_frequency for each in points]
    assert first.stiffness == pytest.approx([each.stiffness for each in points])
    assert first.loss_factor == pytest.approx([each.loss_factor for each in points])
    low, high = np.array(first.stiffness_ci95, dtype=float).T
    assert (low + high) / 2 == pytest.approx(first.stiffness)
    assert np.all(high - low > 2 * 1.9 * np.array([each.stiffness_se for each in points], dtype=float))
    assert found.row is not None
    assert (found.row.input, found.row.response) == ("1y", "3y")
    single = lab.accelerance(1, 1, "1y")
    drawn = found.accelerances[0]
    assert (drawn.frequency, drawn.real, drawn.imaginary) == (single.frequency, single.real, single.imaginary)


def test_what_runs_do_not_have_in_common_is_said(lab: Client) -> None:
    with pytest.raises(ProblemError, match=r"at 0\.3 mm peak to peak; there are 0\.01, 0\.1$") as refused:
        lab.overlay(1, 2, amplitude_pp_mm=0.3)
    assert refused.value.status == 404
    with pytest.raises(ProblemError, match=r"from 2r to any point; there are 3y to 3y, ") as refused:
        lab.overlay(1, 2, point="2r")
    assert refused.value.status == 404
    alone = lab.overlay(1, 3)
    assert (alone.amplitudes_pp_mm, alone.amplitude_pp_mm, alone.rows, alone.row) == ([], None, [], None)
    assert (alone.sweeps, alone.accelerances, alone.joints) == ([], [], [])
    with pytest.raises(ProblemError, match=r"at 0\.1 mm peak to peak$"):
        lab.overlay(1, 3, amplitude_pp_mm=0.1)
    with pytest.raises(ProblemError, match="no run 99") as missing:
        lab.overlay(1, 99)
    assert missing.value.status == 404


@pytest.mark.parametrize(
    ("runs", "said"),
    [([1], "needs 2 or more"), ([1] * 13, "may have 12"), ([1, 1], "each run once"), (["x", 1], "run")],
)
def test_two_to_twelve_runs_are_overlaid_each_once(http: httpx.Client, runs: list[object], said: str) -> None:
    answer = http.get("/api/overlay", params={"run": [str(run) for run in runs]})
    assert answer.status_code == 422
    assert said in answer.json()["detail"]
