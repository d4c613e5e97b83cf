"""Every answer has a number, which records of the log have too."""

import logging

import httpx
import pytest
from pydantic import AnyHttpUrl

from jointlab.traces import send_traces
from tests.collector import collecting
from tests.waiting import until


def test_a_number_is_made_or_taken_and_in_the_answer(client: httpx.Client) -> None:
    first, second = (client.get("/api/health").headers["X-Request-ID"] for _ in range(2))
    assert first != second
    assert client.get("/api/health", headers={"X-Request-ID": "proxy-17"}).headers["X-Request-ID"] == "proxy-17"
    for unfit in ("two words", "x" * 65, "<script>"):
        assert client.get("/api/health", headers={"X-Request-ID": unfit}).headers["X-Request-ID"] != unfit


def test_an_answer_is_told_with_its_status_at_the_level_debug(
    client: httpx.Client, caplog: pytest.LogCaptureFixture
) -> None:
    def told() -> list[str]:
        return [record.getMessage() for record in caplog.records if record.name == "api.service.request_log"]

    with caplog.at_level(logging.DEBUG, "api.service.request_log"):
        client.get("/api/runs/7")
        until(lambda: bool(told()))  # the answer may arrive before its record
    (message,) = told()
    assert message.startswith("GET '/api/runs/7' answered 404 in ")


def test_a_request_is_a_span_below_that_of_who_asks(client: httpx.Client) -> None:
    above = "00f067aa0ba902b7"
    asked = {"traceparent": f"00-4bf92f3577b34da6a3ce929d0e0e4736-{above}-01", "X-Request-ID": "proxy-17"}
    with collecting() as collector:
        send_traces(AnyHttpUrl(collector.url))
        assert client.get("/api/runs/7", headers=asked).status_code == 404
        send_traces(None)
    found = collector.named("GET /runs/{run_id}")
    assert found.above == above
    assert found.about == {
        "http.request.method": "GET", "http.route": "/runs/{run_id}", "http.response.status_code": 404,
        "jointlab.request": "proxy-17", "jointlab.run": 7,
    }  # fmt: skip
    assert any(each.above == found.id for each in collector.spans)
