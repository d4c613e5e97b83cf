"""Master curves over REST: computed as a job, stored with their sweeps, and refused where too little was measured."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from api.service.application import create_app
from api.service.context import Services
from jointlab.client import Client
from jointlab.client.connection import ProblemError
from jointlab.documents.master import Cause
from jointlab.jobs.executors import ProcessExecutor
from jointlab.jobs.queue import JobQueue
from store.catalogue import Catalogue
from store.measurements.runs import start_run
from store.states import JobState
from tests.api.service.conftest import Acting, served
from tests.master_sweeps import ARTICLE, SPECIMEN, store_sweeps

PATH = "/api/master-curves"
ASKED: dict[str, Any] = {"article": ARTICLE, "specimen": SPECIMEN}


@pytest.fixture
def catalogue(database_url: str, tmp_path: Path) -> Iterator[Catalogue]:
    with Catalogue.open(database_url, tmp_path / "waveforms") as opened:
        yield opened


@pytest.fixture
def client(catalogue: Catalogue) -> Iterator[httpx.Client]:
    """A service that does jobs."""
    with served(create_app(Services(catalogue, jobs=JobQueue(catalogue, ProcessExecutor())))) as client:
        yield client


def test_a_master_curve_is_computed_stored_and_holds_the_material(client: httpx.Client, catalogue: Catalogue) -> None:
    material = store_sweeps(catalogue, [5.0, 23.0, 38.0, None])
    store_sweeps(catalogue, [50.0], amplitude_pp_mm=0.1)
    with Client(str(client.base_url)) as lab:
        job = lab.wait_for_job(lab.compute_master_curve(ARTICLE, SPECIMEN, frequencies=(1000,)).id)
        assert job.state is JobState.DONE, job.error
        assert job.result is not None
        stored = lab.master_curve(job.result["master_curve"])
        assert [each.id for each in lab.master_curves(ARTICLE, SPECIMEN)] == [stored.id]
        assert list(lab.master_curves(ARTICLE, "II")) == []
        made = [each.id for each in lab.analyses(1) if each.kind == "master_curves"]
    assert made == [stored.id]
    found = stored.document
    assert (found.runs, found.configuration, found.reference_c) == ([1, 2, 3], "angled", 23.0)

    (point,) = found.predictions
    true = material.stiffness(1000, 23)
    assert point.k_ci95[0] < true.real < point.k_ci95[1]
    assert point.gamma_ci95[0] < true.imag / true.real < point.gamma_ci95[1]
    assert point.beyond == []

    curve = found.curve
    low, high = found.reduced_frequencies_covered
    assert curve.reduced_frequency[0] == pytest.approx(low / 10)
    assert curve.reduced_frequency[-1] == pytest.approx(high * 10)
    held = [
        below < abs(material.stiffness(at, 23)) < above
        for at, (below, above) in zip(curve.reduced_frequency, curve.magnitude_ci95, strict=True)
        if low < at < high
    ]
    assert np.mean(held) > 0.9

    assert [(each.name, each.unit) for each in found.parameters] == [("C1", "1"), ("C2", "K")]
    for each in found.parameters:
        assert each.ci95 is not None
        assert each.standard_error is not None
        assert each.ci95[0] < each.value < each.ci95[1]
        # the ends are those of the logarithm, so a little beyond 2 x 1.96 standard errors apart
        assert 1.0 <= (each.ci95[1] - each.ci95[0]) / (2 * 1.96 * each.standard_error) < 1.5
    assert [round(each.temperature_c) for each in found.sweeps] == [5, 23, 38]
    for sweep in found.sweeps:
        assert sweep.shift_factor_ci95[0] <= sweep.shift_factor <= sweep.shift_factor_ci95[1]
        assert sweep.own_shift_factor_ci95[0] < sweep.own_shift_factor < sweep.own_shift_factor_ci95[1]
        assert sweep.own_shift_factor == pytest.approx(sweep.shift_factor, rel=0.3)
    assert found.sweeps[1].shift_factor == pytest.approx(1.0)
    assert {each.cause: (each.runs, each.points) for each in found.left_out} == {
        Cause.NO_TEMPERATURE: ([4], 12),
        Cause.OTHER_SERIES: ([5], 12),
    }
    assert len(found.measured) == 36


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({}, "do not determine C1 and C2 of WLF. Take Arrhenius, give C1 and C2, or measure at a third temperature"),
        ({}, "angled, 0.1 mm p-p, run 3 at 50.0 degrees Celsius is another series"),
        ({"runs": [1]}, "Measure the same specimen again 10 to 20 K colder"),
        ({"runs": [1]}, "angled, 0.01 mm p-p, run 2 at 23.0 degrees Celsius is not among the runs asked for"),
        ({"amplitude_pp_mm": 0.1}, "needs sweeps at two temperatures at least"),
        ({"amplitude_pp_mm": [0.01, 0.1]}, "amplitude_pp_mm"),
        ({"configuration": "shear"}, "there are: angled, 0.01 mm p-p; angled, 0.1 mm p-p"),
        ({"specimen": "IX"}, "there are: nothing. Identify the runs of the tester first"),
        ({"shift": "arrhenius", "wlf": {"c1": 9, "c2": 100}}, "given constants are C1 and C2 of WLF"),
        ({"wlf": {"c1": 9, "c2": 10}}, "measure colder, or take Arrhenius"),
        ({"wlf": {"c1": 9, "c2": 0}}, "it has to be more than 0 K"),
        ({"temperature_c": 1000}, "it has to be 300"),
        ({"reference": 23}, "there is no such key"),
    ],
)
@pytest.mark.parametrize("database_kind", ["sqlite"])
def test_what_gives_no_curve_is_refused_with_what_to_do(
    client: httpx.Client, catalogue: Catalogue, acting: Acting, asked: dict[str, Any], said: str
) -> None:
    store_sweeps(catalogue, [8.0, 23.0])
    store_sweeps(catalogue, [50.0], amplitude_pp_mm=0.1)
    answer = client.post(PATH, json=ASKED | asked, headers=acting())
    assert answer.status_code == 422
    assert said in answer.json()["detail"]
    assert client.get("/api/jobs").json()["items"] == []


def test_a_run_or_a_curve_that_is_not_there_is_not_found(
    client: httpx.Client, catalogue: Catalogue, acting: Acting
) -> None:
    store_sweeps(catalogue, [5.0, 23.0, 38.0])
    answer = client.post(PATH, json=ASKED | {"runs": [1, 77]}, headers=acting())
    assert (answer.status_code, answer.json()["detail"]) == (404, "there is no run 77")
    answer = client.get(f"{PATH}/7")
    assert (answer.status_code, answer.json()["detail"]) == (404, "there is no master curve 7")
    assert client.get(PATH).json()["items"] == []


@pytest.mark.parametrize("database_kind", ["sqlite"])
def test_a_fit_that_fails_says_why_as_the_error_of_its_job(client: httpx.Client, catalogue: Catalogue) -> None:
    store_sweeps(catalogue, [5.0, 23.0, 38.0])
    with Client(str(client.base_url)) as lab:
        asked = lab.compute_master_curve(ARTICLE, SPECIMEN, frequencies=(1e6,), temperature_c=-80.0, reference_c=23.0)
        job = lab.wait_for_job(asked.id)
        assert job.state is JobState.FAILED
        assert job.error is not None
        with pytest.raises(ProblemError, match="there is no run 9"):
            lab.compute_master_curve(ARTICLE, SPECIMEN, runs=(9,))


@pytest.mark.parametrize("database_kind", ["sqlite"])
def test_a_run_without_any_point_of_the_specimen_is_refused(
    client: httpx.Client, catalogue: Catalogue, acting: Acting
) -> None:
    store_sweeps(catalogue, [5.0, 23.0, 38.0])
    with catalogue.writing() as session:
        other = start_run(session, kind="hammer", title="hammer", article=ARTICLE, setup={})
    answer = client.post(PATH, json=ASKED | {"runs": [other.id]}, headers=acting())
    assert answer.status_code == 422
    assert f"no sine points of run {other.id} as asked for; there are: angled, 0.01 mm p-p" in answer.json()["detail"]
