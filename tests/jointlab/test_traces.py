"""Spans of requests, jobs and statements reach a collector, and one that is away delays nothing."""

import sys
from collections.abc import Iterator

import pytest
from pydantic import AnyHttpUrl
from sqlalchemy import text

from jointlab.jobs.work import carry_out
from jointlab.logs import LogSettings
from jointlab.traces import FAILED, flush_traces, happened, send_traces, span
from store.catalogue import Catalogue
from store.errors import StoreError
from store.extras import MissingExtraError
from store.service.jobs import add_job, take_job
from tests.collector import Collector, collecting
from tests.ports import free_port
from tests.store.conftest import fill


@pytest.fixture
def collector() -> Iterator[Collector]:
    """A collector that this process sends its spans to."""
    with collecting() as found:
        send_traces(AnyHttpUrl(found.url), "test")
        yield found
        send_traces(None)


def test_a_span_has_its_ids_what_happened_in_it_and_the_statements_of_the_database(
    collector: Collector, catalogue: Catalogue
) -> None:
    with span("outer", run=7) as told:
        happened("the first step")
        told.name = "renamed"
        with catalogue.reading() as session:
            session.execute(text("SELECT 17"))
    flush_traces()
    outer = collector.named("renamed")
    assert (outer.service, outer.above, outer.failed) == ("test", "", False)
    assert (outer.about, outer.events) == ({"jointlab.run": 7}, ("the first step",))
    assert [each.about["db.query.text"] for each in collector.spans if each.above == outer.id][-1] == "SELECT 17"


def test_statements_of_no_span_and_of_the_time_before_and_after_are_not_sent(
    collector: Collector, catalogue: Catalogue
) -> None:
    with catalogue.reading() as session:
        session.execute(text("SELECT 17"))
    send_traces(None)
    with span("late"), catalogue.reading() as session:
        session.execute(text("SELECT 18"))
    assert collector.spans == []


def test_an_exception_and_a_statement_that_fails_are_errors(collector: Collector, catalogue: Catalogue) -> None:
    with pytest.raises(StoreError), span("outer"), catalogue.reading() as session:
        session.execute(text("SELECT * FROM nothing_of_this_name"))
    flush_traces()
    assert collector.named("outer").failed
    assert collector.named("database SELECT").failed


@pytest.mark.parametrize(
    ("kind", "asked", "events", "failed"),
    [("export", {"form": "uff"}, ("uff",), {}), ("diagnose", {}, (), {FAILED: "SequenceError"})],
)
def test_a_job_is_a_span_with_its_steps_and_says_what_it_failed_of(
    catalogue: Catalogue,
    collector: Collector,
    kind: str,
    asked: dict[str, str],
    events: tuple[str, ...],
    failed: dict[str, str],
) -> None:
    run, _ = fill(catalogue)
    with catalogue.writing() as session:
        add_job(session, kind, {"run": run, **asked}, "bench")
        taken = take_job(session, [kind])
    assert taken is not None
    job, token = taken
    carry_out(catalogue.place, job.id, token, LogSettings(traces=AnyHttpUrl(collector.url)))
    found = collector.named(f"job {kind}")
    assert (found.service, found.events, found.failed) == ("jointlab job", events, bool(failed))
    assert found.about == {"jointlab.job": job.id, "jointlab.run": run, "jointlab.attempt": 1, **failed}


def test_what_a_collector_that_is_away_misses_is_dropped_and_later_spans_reach_another(catalogue: Catalogue) -> None:
    send_traces(AnyHttpUrl(f"http://127.0.0.1:{free_port()}/v1/traces"))
    with span("lost"), catalogue.reading() as session:
        assert session.scalar(text("SELECT 17")) == 17
    flush_traces()
    with collecting() as found:
        send_traces(AnyHttpUrl(found.url))
        with span("kept"):
            pass
        send_traces(None)
    assert [each.name for each in found.spans] == ["kept"]


def test_without_the_extra_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "opentelemetry.sdk.trace", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'jointlab\[traces\]'"):
        send_traces(AnyHttpUrl("http://127.0.0.1:4318/v1/traces"))
