"""What was measured and computed, as the service shows it: the same as the identification found."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from api.service.application import create_app
from api.service.context import Services
from jointlab.client import Client
from store.catalogue import Catalogue
from tests.api.service.conftest import served


@pytest.fixture(scope="module")
def client(demo: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx.Client]:
    """A service in front of the demo's run."""
    folder = tmp_path_factory.mktemp("results")
    shutil.copy(demo / "jointlab.db", folder)
    shutil.copytree(demo / "jointlab-waveforms", folder / "jointlab-waveforms")
    with (
        Catalogue.open(f"sqlite:///{folder / 'jointlab.db'}") as catalogue,
        served(create_app(Services(catalogue))) as client,
    ):
        yield client


@pytest.fixture(scope="module")
def summary(demo: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((demo / "summary.json").read_text(encoding="utf-8"))
    return document


def get(client: httpx.Client, path: str, **query: Any) -> Any:
    answer = client.get(f"/api{path}", params=query)
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_modes_are_those_of_the_identification(client: httpx.Client, summary: dict[str, Any]) -> None:
    modes = get(client, "/runs/1/modes")
    for name in ("frequency_hz", "loss_factor", "frequency_ci95", "loss_factor_ci95", "predicted_hz"):
        assert modes[name] == summary["modes"][name], name
    assert modes["points"] == summary["modes"]["points"]
    assert modes["shapes_real"] == summary["modes"]["shapes"]["real"]


def test_joint_matrices_are_those_of_both_methods(client: httpx.Client, summary: dict[str, Any]) -> None:
    matrices = get(client, "/runs/1/joint-matrices")["items"]
    assert len(matrices) == 4
    for found in matrices:
        part = "inverse_paper" if found["method"].startswith("modal") else "inverse"
        for name in ("k", "h", "k_ci95", "h_ci95", "gamma", "gamma_ci95", "observable", "not_observable"):
            assert found[name] == summary[part][found["joint"]][name], (found["method"], name)
    likely = get(client, "/runs/1/joint-matrices", method="maximum likelihood on accelerances")["items"]
    assert [found["joint"] for found in likely] == ["I", "II"]


def test_elements_of_an_article_are_found_joint_by_joint(client: httpx.Client, summary: dict[str, Any]) -> None:
    article = get(client, "/runs/1")["article"]
    whole = get(client, "/joint-elements", article=article, limit=100)
    assert (len(whole["items"]), whole["next"]) == (36, None)
    first = get(client, "/joint-elements", article=article, joint="II", limit=10)
    second = get(client, "/joint-elements", article=article, joint="II", limit=10, cursor=first["next"])
    joined = first["items"] + second["items"]
    assert joined == [each for each in whole["items"] if each["joint"] == "II"]
    (k22,) = [
        each["stiffness"] for each in get(client, "/joint-elements", article=article, joint="I",
                                          method="maximum likelihood on accelerances")["items"]
        if (each["matrix_row"], each["matrix_column"]) == (2, 2)
    ]  # fmt: skip
    assert k22 == summary["inverse"]["I"]["k"][1][1]
    assert get(client, "/joint-elements", article="none")["items"] == []


def test_dynamic_stiffness_is_that_of_the_identification(client: httpx.Client, summary: dict[str, Any]) -> None:
    whole = get(client, "/runs/1/dynamic-stiffness")
    assert len(whole["items"]) == 36
    shear = get(client, "/runs/1/dynamic-stiffness", specimen="II", configuration="shear")["items"]
    assert {(point["specimen"], point["configuration"]) for point in shear} == {("II", "shear")}
    small = [point["stiffness"] for point in shear if point["amplitude_pp_mm"] == 0.01]
    series = summary["direct"]["II"]["shear"]["0.01"]
    assert small == series["k"]
    for point, reached, distortion, energy in zip(
        [point for point in shear if point["amplitude_pp_mm"] == 0.01],
        series["amplitude_pp_mm"], series["thd_force"], series["loop_energy"], strict=True,
    ):  # fmt: skip
        assert point["reached_pp_mm"] == reached
        assert point["thd_percent"] == pytest.approx(100 * distortion)
        assert point["loop_energy"] == energy > 0
        assert 0 < point["loop_energy_se"] < 0.1 * energy
        assert abs(point["loop_energy_excess"]) < 0.01 * energy
        assert min(point[name] for name in ("reached_pp_se_mm", "thd_se_percent", "loop_energy_excess_se")) > 0
    article = get(client, "/runs/1")["article"]
    found = get(
        client, "/dynamic-stiffness", article=article, specimen="II", configuration="shear", amplitude_pp_mm=0.01,
        lowest_frequency=100, highest_frequency=100,
    )["items"]  # fmt: skip
    assert [(point["frequency"], point["run_id"]) for point in found] == [(100, 1)]
    assert found[0]["reached_frequency"] == pytest.approx(98, rel=1e-3)  # beside the mains
    assert found[0]["stiffness"] == small[1]


def test_the_law_goes_through_what_was_measured_and_says_where_it_extrapolates(client: httpx.Client) -> None:
    path = "/runs/1/dynamic-stiffness/at"
    points = get(client, "/runs/1/dynamic-stiffness", specimen="II", configuration="shear")["items"]
    point = next(each for each in points if each["amplitude_pp_mm"] == 0.1 and round(each["frequency"]) == 100)
    inside = get(client, path, amplitude_pp_mm=0.1, frequency=100)
    assert (inside["extrapolated"], inside["analysis_id"]) == (False, point["analysis_id"])
    assert [each["specimen"] for each in inside["specimens"]] == ["I", "II"]
    shear = inside["specimens"][1]["shear"]
    # the tester holds a pair in shear
    assert 2 * shear["k"] == pytest.approx(point["stiffness"], rel=0.02)
    assert shear["gamma"] == pytest.approx(point["loss_factor"], rel=0.05)
    assert shear["h_ci95"][0] < shear["h"] < shear["h_ci95"][1]
    single = inside["scatter"]["shear"]["k"]["single_specimen_ci95"]
    assert single[0] < shear["k_ci95"][0]
    assert single[1] > shear["k_ci95"][1]

    outside = get(client, path, amplitude_pp_mm=0.004, frequency=400, specimen="II")
    assert (outside["extrapolated"], outside["scatter"]) == (True, None)
    (found,) = outside["specimens"]
    assert [phrase.split(" the ")[0] for phrase in found["beyond"]] == ["0.004 mm is below", "400 Hz is above"]
    low, high = found["shear"]["k_ci95"]
    assert (high - low) / found["shear"]["k"] > 2 * (shear["k_ci95"][1] - shear["k_ci95"][0]) / shear["k"]


def test_the_typed_client_asks_the_law(client: httpx.Client) -> None:
    with Client(str(client.base_url)) as lab:
        found = lab.stiffness_at(1, 0.03, 80)
    assert found.model_dump(mode="json") == get(
        client, "/runs/1/dynamic-stiffness/at", amplitude_pp_mm=0.03, frequency=80
    )


@pytest.mark.parametrize(
    ("run", "query", "status", "said"),
    [
        (77, {}, 404, "there is no run 77"),
        (1, {"specimen": "V"}, 422, "no law for joint V; there are I, II"),
        (1, {"amplitude_pp_mm": 0}, 422, "it has to be more than 0"),
    ],
)
def test_a_question_that_the_law_cannot_answer_is_refused(
    client: httpx.Client, run: int, query: dict[str, Any], status: int, said: str
) -> None:
    asked = {"amplitude_pp_mm": 0.03, "frequency": 80} | query
    answer = client.get(f"/api/runs/{run}/dynamic-stiffness/at", params=asked)
    assert answer.status_code == status
    assert said in answer.json()["detail"]


def test_comparisons_are_those_of_the_identification(client: httpx.Client, summary: dict[str, Any]) -> None:
    found = get(client, "/runs/1/comparisons")["items"]
    for each, other in zip(found, summary["comparison"], strict=True):
        for name in ("joint", "element", "inverse", "direct", "verdict"):
            assert each[name] == other[name]
    article = get(client, "/runs/1")["article"]
    over_runs = get(client, "/comparisons", article=article, verdict=found[0]["verdict"])["items"]
    assert {each["verdict"] for each in over_runs} == {found[0]["verdict"]}


def test_blows_come_in_pages_with_their_waveforms(client: httpx.Client) -> None:
    points = get(client, "/runs/1/points")["items"]
    assert [point["point"] for point in points[:3]] == ["1y", "3y", "4y"]
    assert {point["accepted"] for point in points} == {10}
    first = get(client, "/runs/1/blows", accepted=True, limit=60)
    second = get(client, "/runs/1/blows", accepted=True, limit=60, cursor=first["next"])
    assert (len(first["items"]), len(second["items"]), second["next"]) == (60, 50, None)
    blow = second["items"][-1]
    assert get(client, f"/blows/{blow['id']}") == blow
    whole = get(client, f"/blows/{blow['id']}/waveform")
    assert [trace["unit"] for trace in whole["traces"]] == ["N", "m/s^2"]
    force = whole["traces"][0]["values"]
    assert max(force) == pytest.approx(blow["peak_force"], rel=0.01)
    quick = get(client, f"/blows/{blow['id']}/waveform", every=10)
    assert quick["traces"][0]["values"] == force[::10]
    assert quick["sample_rate"] == whole["sample_rate"] / 10


def test_sine_records_come_with_their_waveforms(client: httpx.Client) -> None:
    records = get(client, "/runs/1/sine-records", specimen="I", configuration="angled")["items"]
    assert len(records) == 6
    record = get(client, f"/sine-records/{records[0]['id']}")
    assert record == records[0]
    traces = get(client, f"/sine-records/{record['id']}/waveform")["traces"]
    swing = (max(traces[0]["values"]) - min(traces[0]["values"])) * 1e3
    assert swing == pytest.approx(record["reached_pp_mm"], rel=0.05)


def test_frequency_responses_come_point_by_point(client: httpx.Client) -> None:
    (summary,) = get(client, "/runs/1/frequency-responses")["items"]
    assert (summary["response"], len(summary["inputs"])) == ("3y", 11)
    found = get(client, "/runs/1/frequency-responses/1/5y")
    assert len(found["real"]) == len(found["imaginary"]) == len(found["frequency"]) == summary["lines"]
    assert all(0 <= each <= 1 for each in found["coherence"])
    missing = client.get("/api/runs/1/frequency-responses/1/2y")
    assert (missing.status_code, missing.json()["detail"]) == (404, "run 1 has no accelerance of set 1 from 2y")


def test_channels_and_instruments_are_those_of_the_run(client: httpx.Client) -> None:
    channels = get(client, "/runs/1/channels")["items"]
    assert [channel["name"] for channel in channels] == ["accelerometer", "displacement", "force", "hammer"]
    assert {channel["polarity"] for channel in channels} == {1}
    instruments = get(client, "/instruments", limit=1000)["items"]
    assert {"tester", "thermometer", "force_iepe"} <= {each["kind"] for each in instruments}
    (hammer,) = get(client, "/instruments", kind="force_iepe")["items"]
    assert get(client, f"/instruments/{hammer['id']}") == hammer
    (calibration,) = get(client, f"/instruments/{hammer['id']}/calibrations")["items"]
    assert (calibration["calibrated_on"], calibration["sensitivity_unit"]) == ("2026-03-02", "V/(N)")


def test_specimens_are_the_joints_of_the_article(client: httpx.Client) -> None:
    specimens = get(client, "/specimens")["items"]
    assert [each["name"] for each in specimens] == ["I", "II"]
    assert get(client, f"/specimens/{specimens[1]['id']}") == specimens[1]


@pytest.mark.parametrize("what", ["modes", "joint-matrices", "dynamic-stiffness", "comparisons", "frequency-responses"])
def test_results_of_a_run_that_is_not_there_are_not_found(client: httpx.Client, what: str) -> None:
    answer = client.get(f"/api/runs/77/{what}")
    assert answer.status_code == 404
    assert "run 77" in answer.json()["detail"]
