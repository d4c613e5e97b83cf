"""Every route for everybody: anonymous, each scope alone, a key that has ended, a revoked one.

A route that nobody has thought of here fails: each has to be in the table.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import httpx
import pytest

from api.service.application import create_app
from api.service.context import Services
from jointlab.settings import DriveSettings, Settings
from jointlab.trials.simulated_laboratory import CHANNELS
from store.catalogue import Catalogue
from store.states import Scope
from tests.api.conftest import paper
from tests.api.service.conftest import PROBLEM, MakeKey, make_key_in, managing, served
from tests.ports import free_port

READ, ANALYSE, CONTROL, ENGINEER, ADMIN = Scope
SEQUENCE = paper()
OPEN = {
    "GET /api/health", "GET /api/health/live", "GET /api/health/ready", "POST /api/rig/stop",
    "POST /api/rigs/{name}/stop",
}  # fmt: skip

# Which scope opens which route.
ROUTES: dict[str, Scope] = {
    "GET /api/metrics": READ,
    "GET /api/instruments": READ,
    "GET /api/instruments/{instrument_id}": READ,
    "GET /api/instruments/{instrument_id}/calibrations": READ,
    "POST /api/instruments/{instrument_id}/calibrations": ENGINEER,
    "GET /api/channels": READ,
    "GET /api/runs/{run_id}/channels": READ,
    "GET /api/specimens": READ,
    "GET /api/specimens/{specimen_id}": READ,
    "GET /api/specimens/{specimen_id}/history": READ,
    "GET /api/sequences": READ,
    "GET /api/sequences/{name}": READ,
    "PUT /api/sequences/{name}": CONTROL,
    "DELETE /api/sequences/{name}": CONTROL,
    "GET /api/examinations": READ,
    "GET /api/examinations/{examination_id}": READ,
    "POST /api/examinations": CONTROL,
    "GET /api/rig": READ,
    "GET /api/rigs": READ,
    "GET /api/rig/events": READ,
    "GET /api/rig/limits": READ,
    "PUT /api/rig/limits": ENGINEER,
    "POST /api/rig/lease": CONTROL,
    "POST /api/rig/reset-stop": CONTROL,
    "PUT /api/rig/lease": CONTROL,
    "DELETE /api/rig/lease": CONTROL,
    "GET /api/runs": READ,
    "POST /api/runs": CONTROL,
    "GET /api/runs/{run_id}": READ,
    "GET /api/runs/{run_id}/history": READ,
    "GET /api/runs/{run_id}/amendments": READ,
    "POST /api/runs/{run_id}/amendments": CONTROL,
    "POST /api/runs/{run_id}/start": CONTROL,
    "POST /api/runs/{run_id}/pause": CONTROL,
    "POST /api/runs/{run_id}/resume": CONTROL,
    "POST /api/runs/{run_id}/stop": CONTROL,
    "POST /api/runs/{run_id}/answer": CONTROL,
    "POST /api/runs/{run_id}/acknowledge-interlock": CONTROL,
    "GET /api/runs/{run_id}/points": READ,
    "GET /api/runs/{run_id}/blows": READ,
    "GET /api/blows/{blow_id}": READ,
    "GET /api/blows/{blow_id}/waveform": READ,
    "POST /api/blows/{blow_id}/withdraw": CONTROL,
    "GET /api/runs/{run_id}/sine-records": READ,
    "GET /api/sine-records/{record_id}": READ,
    "GET /api/sine-records/{record_id}/waveform": READ,
    "GET /api/runs/{run_id}/analyses": READ,
    "GET /api/runs/{run_id}/frequency-responses": READ,
    "GET /api/runs/{run_id}/frequency-responses/{set_number}/{point}": READ,
    "GET /api/runs/{run_id}/modes": READ,
    "GET /api/runs/{run_id}/tables": READ,
    "GET /api/runs/{run_id}/tables/{name}.{form}": READ,
    "GET /api/runs/{run_id}/joint-matrices": READ,
    "GET /api/joint-elements": READ,
    "GET /api/runs/{run_id}/dynamic-stiffness": READ,
    "GET /api/runs/{run_id}/dynamic-stiffness/at": READ,
    "GET /api/dynamic-stiffness": READ,
    "GET /api/runs/{run_id}/comparisons": READ,
    "GET /api/comparisons": READ,
    "GET /api/overlay": READ,
    "GET /api/diagnoses": READ,
    "GET /api/diagnoses/{diagnosis_id}": READ,
    "POST /api/diagnoses": ANALYSE,
    "GET /api/master-curves": READ,
    "GET /api/master-curves/{curve_id}": READ,
    "POST /api/master-curves": ANALYSE,
    "GET /api/investigations": READ,
    "GET /api/investigations/{investigation_id}": READ,
    "GET /api/investigations/{investigation_id}/sequence": READ,
    "POST /api/investigations": ANALYSE,
    "POST /api/investigations/{investigation_id}/answer": ANALYSE,
    "POST /api/investigations/{investigation_id}/continue": ANALYSE,
    "POST /api/investigations/{investigation_id}/stop": ANALYSE,
    "POST /api/identifications": ANALYSE,
    "GET /api/trials": READ,
    "POST /api/trials": ANALYSE,
    "GET /api/exports": READ,
    "POST /api/exports": ANALYSE,
    "GET /api/exports/{job_id}/file": READ,
    "GET /api/jobs": READ,
    "GET /api/jobs/{job_id}": READ,
    "POST /api/jobs/{job_id}/cancel": ANALYSE,
    "GET /api/jobs/{job_id}/events": READ,
    "GET /api/alarms": READ,
    "GET /api/alarms/{alarm_id}": READ,
    "POST /api/alarms/test": ADMIN,
    "POST /api/alarms/{alarm_id}/acknowledge": CONTROL,
    "GET /api/keys": ADMIN,
    "POST /api/keys": ADMIN,
    "POST /api/keys/{key_id}/revoke": ADMIN,
    "GET /api/audit": ADMIN,
}

LIMITS = {
    "amplitude_pp": 3e-4, "lowest_frequency": 1.0, "highest_frequency": 250.0, "lowest_preset": 0.0,
    "highest_preset": 1e-3, "velocity": 0.15, "acceleration": 150.0, "force": 4e3,
}  # fmt: skip
QUERIES: dict[str, dict[str, Any]] = {
    "GET /api/joint-elements": {"article": "beam 3"},
    "GET /api/dynamic-stiffness": {"article": "beam 3"},
    "GET /api/comparisons": {"article": "beam 3"},
    "GET /api/overlay": {"run": [77, 78]},
    "GET /api/runs/{run_id}/dynamic-stiffness/at": {"amplitude_pp_mm": 0.03, "frequency": 80},
}
BODIES: dict[str, dict[str, Any]] = {
    "POST /api/instruments/{instrument_id}/calibrations": {
        "calibrated_on": "2026-03-02", "sensitivity": 1.0, "sensitivity_unit": "V/N"
    },
    "PUT /api/rig/limits": LIMITS,
    "POST /api/rig/lease": {"holder": "test"},
    "POST /api/examinations": {"place": "bench"},
    "POST /api/runs": {"sequence": "paper"},
    "POST /api/runs/{run_id}/answer": {"prompt": 1},
    "POST /api/runs/{run_id}/acknowledge-interlock": {"reason": "removed"},
    "POST /api/blows/{blow_id}/withdraw": {"reason": "struck beside"},
    "POST /api/runs/{run_id}/amendments": {"article": {"beam": {"length": 0.914}}, "reason": "mistyped"},
    "POST /api/alarms/{alarm_id}/acknowledge": {"note": "seen"},
    "POST /api/diagnoses": {"run": 77},
    "POST /api/master-curves": {"article": "beam 77", "specimen": "I"},
    "POST /api/investigations": {"run": 77},
    "POST /api/investigations/{investigation_id}/answer": {"refusal": "no scales"},
    "POST /api/investigations/{investigation_id}/continue": {},
    "POST /api/identifications": {"run": 77},
    "POST /api/trials": {"cases": 1},
    "POST /api/exports": {"run": 77, "form": "hdf5"},
    "POST /api/keys": {"name": "made by a test", "scopes": ["read:data"]},
}  # fmt: skip


@dataclass(frozen=True)
class Everybody:
    """A service, and a secret for each kind of caller."""

    client: httpx.Client
    secrets: dict[str, str | None]


@pytest.fixture(scope="module")
def everybody(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Everybody]:
    folder = tmp_path_factory.mktemp("access")
    nowhere = Settings.model_construct(
        # an address of its own, as one drive process has a tester, and other tests run beside these
        channels=CHANNELS, daq_address="grpc://127.0.0.1:9", tester_url=f"tcp://127.0.0.1:{free_port()}",
        thermometer_url="socket://127.0.0.1:9", drive=DriveSettings(folder=folder / "drive", stop_port=0),
    )  # fmt: skip
    with Catalogue.open(f"sqlite:///{folder / 'jointlab.db'}") as catalogue:
        make_key: MakeKey = make_key_in(catalogue)
        secrets: dict[str, str | None] = {scope.value: make_key(scope) for scope in Scope}
        secrets |= {
            "anonymous": None,
            "a key that has ended": make_key(*Scope, ended=True),
            "a revoked key": make_key(*Scope, revoked=True),
            "a key of another laboratory": "jl_" + 43 * "x",
            "another who controls": make_key(Scope.CONTROL),
            "an engineer who controls": make_key(Scope.CONTROL, Scope.ENGINEER),
        }
        with managing(catalogue, nowhere) as rig, served(create_app(Services(catalogue, rig))) as client:
            yield Everybody(client, secrets)


def ask(everybody: Everybody, route: str, caller: str) -> httpx.Response:
    """Ask as somebody, with everything that the route needs but the right to it."""
    method, path = route.split(" ")
    names = {"name": "other", "set_number": "1", "point": "3y", "form": "csv"}
    for name in (
        "run_id",
        "blow_id",
        "record_id",
        "job_id",
        "key_id",
        "alarm_id",
        "instrument_id",
        "specimen_id",
        "diagnosis_id",
        "curve_id",
        "investigation_id",
        "examination_id",
    ):
        path = path.replace(f"{{{name}}}", "77")
    path = path.format(**names)
    secret = everybody.secrets[caller]
    headers = {} if secret is None else {"Authorization": f"Bearer {secret}"}
    if method != "GET":
        headers["Idempotency-Key"] = f"{caller} {route}".replace(" ", "-").replace("{", "").replace("}", "")
    body = SEQUENCE if route == "PUT /api/sequences/{name}" else BODIES.get(route)
    with everybody.client.stream(method, path, headers=headers, json=body, params=QUERIES.get(route)) as answer:
        if not answer.headers.get("content-type", "").startswith("text/event-stream"):
            answer.read()
        return answer


def test_the_table_has_every_route(everybody: Everybody) -> None:
    document = everybody.client.get("/openapi.json").json()
    found = {f"{method.upper()} {path}" for path, methods in document["paths"].items() for method in methods}
    assert found == set(ROUTES) | OPEN


@pytest.mark.parametrize(
    "caller", ["anonymous", "a key that has ended", "a revoked key", "a key of another laboratory"]
)
def test_every_route_is_closed_without_a_valid_key(everybody: Everybody, caller: str) -> None:
    for route in ROUTES:
        answer = ask(everybody, route, caller)
        assert (answer.status_code, answer.headers["content-type"]) == (401, PROBLEM), route
        assert answer.headers["www-authenticate"] == "Bearer", route


@pytest.mark.parametrize("scope", Scope, ids=str)
def test_every_route_opens_for_its_scope_and_for_no_other(everybody: Everybody, scope: Scope) -> None:
    for route, needed in ROUTES.items():
        answer = ask(everybody, route, scope.value)
        if scope is needed:
            assert answer.status_code in (200, 201, 202, 204, 404, 409), (route, answer.text)
        else:
            assert (answer.status_code, answer.headers["content-type"]) == (403, PROBLEM), route
            assert needed.value in answer.json()["detail"], route


@pytest.mark.parametrize("caller", ["anonymous", "a key that has ended", "a revoked key", "read:data"])
@pytest.mark.parametrize("route", sorted(OPEN))
def test_health_and_stop_are_open_to_everybody(everybody: Everybody, route: str, caller: str) -> None:
    answer = ask(everybody, route, caller)
    if route == "POST /api/rig/stop":  # it is tried, on a tester that does not answer
        assert answer.status_code == 502
        assert "127.0.0.1" in answer.json()["detail"], answer.text
    elif route == "POST /api/rigs/{name}/stop":  # there is no such rig
        assert answer.status_code == 404
    elif route == "GET /api/health/ready":
        assert answer.status_code in (200, 503)
    else:
        assert answer.status_code == 200


def test_the_lease_of_another_key_is_taken_by_force_by_an_engineer_only(everybody: Everybody) -> None:
    def take(caller: str, key: str, by_force: bool) -> int:
        headers = {"Authorization": f"Bearer {everybody.secrets[caller]}", "Idempotency-Key": key}
        body = {"holder": "x", "by_force": by_force}
        return everybody.client.post("/api/rig/lease", json=body, headers=headers).status_code

    take(CONTROL.value, "first", True)
    assert take(CONTROL.value, "second", False) == 409
    assert take(CONTROL.value, "third", True) == 201
    assert take("another who controls", "fourth", True) == 403
    assert take("an engineer who controls", "fifth", True) == 201
    assert take(CONTROL.value, "sixth", True) == 403
