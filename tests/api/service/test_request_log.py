"""Every answer has a number, which records of the log have too."""

import logging

import httpx
import pytest


def test_a_number_is_made_or_taken_and_in_the_answer(client: httpx.Client) -> None:
    first, second = (client.get("/api/health").headers["X-Request-ID"] for _ in range(2))
    assert first != second
    assert client.get("/api/health", headers={"X-Request-ID": "proxy-17"}).headers["X-Request-ID"] == "proxy-17"
    for unfit in ("two words", "x" * 65, "<script>"):
        assert client.get("/api/health", headers={"X-Request-ID": unfit}).headers["X-Request-ID"] != unfit


def test_an_answer_is_told_with_its_status_and_not_by_default(
    client: httpx.Client, caplog: pytest.LogCaptureFixture
) -> None:
    client.get("/api/runs/7")
    assert not caplog.records
    with caplog.at_level(logging.DEBUG, "api.service.request_log"):
        client.get("/api/runs/7")
    (message,) = (record.getMessage() for record in caplog.records if record.name == "api.service.request_log")
    assert message.startswith("GET '/api/runs/7' answered 404 in ")
