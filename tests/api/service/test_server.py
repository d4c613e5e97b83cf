"""The web server: encrypted if wanted, and open to nobody whom a proxy brings."""

import logging
import ssl
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from ipaddress import ip_address
from pathlib import Path
from unittest.mock import Mock

import httpx
import pytest

from api.service.application import create_app
from api.service.context import Services
from api.service.server import tls_of
from jointlab.errors import JointlabError
from store.catalogue import Catalogue
from store.states import Scope
from tests.api.conftest import Command
from tests.api.service.conftest import Acting, MakeKey, served
from tests.api.service.wire import answer, connected
from tests.certificates import certificate_in

PASSED_ON = (
    {"X-Forwarded-For": "198.51.100.7"},
    {"X-Forwarded-Host": "127.0.0.1"},
    {"X-Forwarded-Proto": "https"},
    {"X-Real-IP": "198.51.100.7"},
    {"Forwarded": "for=198.51.100.7"},
    {"Via": "1.1 proxy"},
)


@pytest.fixture
def certificate(tmp_path: Path) -> tuple[Path, Path]:
    """A certificate of this computer, and its key."""
    return certificate_in(tmp_path, "IP:127.0.0.1")


@contextmanager
def behind(catalogue: Catalogue, *proxies: str) -> Iterator[httpx.Client]:
    with served(create_app(Services(catalogue)), trusted_proxies=[ip_address(each) for each in proxies]) as client:
        yield client


@pytest.mark.parametrize("header", PASSED_ON, ids=lambda header: next(iter(header)))
@pytest.mark.parametrize("proxies", [(), ("127.0.0.1",)])
def test_a_request_that_a_proxy_passed_on_needs_a_key(
    catalogue: Catalogue, acting: Acting, header: dict[str, str], proxies: tuple[str, ...]
) -> None:
    with behind(catalogue, *proxies) as client:
        body = {"name": "mine", "scopes": ["admin"]}
        assert client.post("/api/keys", json=body, headers=acting() | header).status_code == 401
        assert client.get("/api/runs", headers=header).status_code == 401
        assert client.get("/api/runs").status_code == 200  # at this computer


def test_a_key_opens_the_service_behind_a_proxy(catalogue: Catalogue, make_key: MakeKey) -> None:
    headers = {"Authorization": f"Bearer {make_key(Scope.READ)}", "X-Forwarded-For": "198.51.100.7"}
    with behind(catalogue) as client:
        assert client.get("/api/runs", headers=headers).status_code == 200


def test_bad_requests_do_not_fill_the_log(client: httpx.Client) -> None:
    written = list[str]()

    class Kept(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            written.append(record.getMessage())

    handler = Kept()
    logging.getLogger("uvicorn.error").addHandler(handler)
    try:
        for _ in range(100):
            with connected(client) as connection:
                connection.sendall(b"nonsense\r\n\r\n")
                assert answer(connection)[0] == 400
    finally:
        logging.getLogger("uvicorn.error").removeHandler(handler)
    assert len(written) <= 12


def test_an_encrypted_service_answers_over_tls_alone(catalogue: Catalogue, certificate: tuple[Path, Path]) -> None:
    with served(create_app(Services(catalogue)), tls=tls_of(*certificate)) as client:
        assert client.base_url.scheme == "https"
        known = ssl.create_default_context(cafile=certificate[0])
        assert httpx.get(str(client.base_url.join("/api/health")), verify=known).status_code == 200
        with pytest.raises(httpx.TransportError):
            httpx.get(f"http://{client.base_url.host}:{client.base_url.port}/api/health")


def test_a_certificate_without_its_key_is_refused_in_words(jointlab: Command, certificate: tuple[Path, Path]) -> None:
    own, key = certificate
    refused = jointlab("serve", "--port", 0, "--tls-certificate", own)
    assert (refused.returncode, "belong together" in refused.stderr) == (3, True)
    key.write_text("no key")
    with pytest.raises(JointlabError, match="make no TLS"):
        tls_of(own, key)


def test_the_run_is_ended_before_a_receiver_of_alarms_or_another_rig_is_waited_for(
    catalogue: Catalogue, tmp_path: Path
) -> None:
    closed = list[str]()
    runs, alarms, hall, jobs = (
        Mock(close=partial(closed.append, name), drive_folder=tmp_path) for name in ("runs", "alarms", "hall", "jobs")
    )
    with served(create_app(Services(catalogue, runs, jobs=jobs, alarms=alarms, hall=hall))):
        assert closed == []
    assert (closed[0], sorted(closed)) == ("runs", ["alarms", "hall", "jobs", "runs"])
