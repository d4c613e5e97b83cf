"""What programs that publish a rig read of a service."""

from contextlib import closing
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from typing import Any

import httpx
import pytest

from api.service.application import create_app
from api.service.context import Services
from jointlab.background import in_background
from jointlab.client import Client
from jointlab.client.connection import RigEvent
from jointlab.publishing.service import LISTED, Service, ServiceAwayError, number_of
from store.catalogue import Catalogue
from store.service.alarms import NewAlarm, add_alarm
from store.states import AlarmKind, Scope
from tests.api.service.conftest import MakeKey, served


class Enough(Exception):  # noqa: N818 - it is no error
    """All that a test wants was told."""


def test_events_are_followed_after_the_latest_one(lab: Client, rig_client: httpx.Client) -> None:
    with closing(Service(str(rig_client.base_url), None)) as service:
        with lab.driving("first"):
            pass
        after = service.latest_event()
        told: list[RigEvent] = []

        def tell(event: RigEvent) -> None:
            if "holder" in event.data:  # the tester may be read for the first time meanwhile
                told.append(event)
            if len(told) == 2:
                raise Enough

        ended = in_background(lambda: service.follow(after, tell))
        with lab.driving("second"):
            pass
        with pytest.raises(Enough):
            ended.result(60)
    assert [event.data for event in told] == [{"holder": "second"}, {"holder": None}]
    assert number_of(told[0]) > int(after.rsplit("-", 1)[1])


def test_a_key_that_does_not_fit_is_said(catalogue: Catalogue, make_key: MakeKey) -> None:
    make_key(Scope.READ)
    with (
        served(create_app(Services(catalogue))) as client,
        closing(Service(str(client.base_url), "jl_no")) as service,
        pytest.raises(ServiceAwayError, match="key"),
    ):
        service.rig()


def test_a_service_without_a_rig_is_said(catalogue: Catalogue) -> None:
    with (
        served(create_app(Services(catalogue))) as client,
        closing(Service(str(client.base_url), None)) as service,
        pytest.raises(ServiceAwayError, match="rig"),
    ):
        service.rig()


def test_alarms_of_a_rig_are_found_behind_many_of_another_one(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        for number in range(LISTED + 3):
            rig = "rig" if number < 2 else "another"
            add_alarm(session, NewAlarm(AlarmKind.TEST, rig, f"test {number}", f"cause {number}"))
    with (
        served(create_app(Services(catalogue))) as client,
        closing(Service(str(client.base_url), None)) as service,
    ):
        assert [alarm.text for alarm in service.standing_alarms("rig")] == ["test 1", "test 0"]
        assert len(service.standing_alarms("another")) == LISTED


@pytest.mark.parametrize("status", [200, 404])
def test_something_else_that_answers_is_said_in_one_line(status: int) -> None:
    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            body = b"<html>\n<p>Not\nhere</p>\n</html>"
            self.send_response(status)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_: Any) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        thread = Thread(target=server.serve_forever, kwargs={"poll_interval": 0.05})
        thread.start()
        with closing(Service(f"http://127.0.0.1:{server.server_port}", None)) as service:
            with pytest.raises(ServiceAwayError) as caught:
                service.rig()
            with pytest.raises(ServiceAwayError):
                service.standing_alarms("rig")
        server.shutdown()
        thread.join()
    assert str(caught.value)
    assert "\n" not in str(caught.value)
