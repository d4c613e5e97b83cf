"""Every answer has a number, which records of the log have too."""

import logging

import httpx
import pytest

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
