"""Metrics of the service for Prometheus: rig, jobs, database, stops. Only this module uses its client."""

from collections.abc import Iterator, Mapping

from prometheus_client import CollectorRegistry, Histogram, ProcessCollector, generate_latest
from prometheus_client.core import GaugeMetricFamily
from prometheus_client.registry import Collector

from api.service.context import Services
from jointlab.drive.phase import Phase
from rig.registers import Interlock
from store.errors import StoreError
from store.probe import DatabaseState
from store.service.jobs import count_jobs
from store.version import software_version

CONTENT_TYPE = "text/plain; version=0.0.4; charset=utf-8"
STOP_BUCKETS = (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)  # s
REQUEST_BUCKETS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 5.0)  # s


class Metrics:
    """Counters that run with the service, and values that are read at each request."""

    def __init__(self) -> None:
        self._registry = CollectorRegistry()
        ProcessCollector(namespace="jointlab", registry=self._registry)
        self.stop_seconds = Histogram(
            "jointlab_stop_seconds",
            "From a STOP over REST to its answer, with a driven actuator at rest",
            buckets=STOP_BUCKETS,
            registry=self._registry,
        )
        self._request_seconds = Histogram(
            "jointlab_request_seconds", "Of an answer over REST, by its route", ["method", "route"],
            buckets=REQUEST_BUCKETS, registry=self._registry,
        )  # fmt: skip

    def answered(self, method: str, route: str, seconds: float) -> None:
        """Count an answer; `route` is the path below /api with names for values, such as /runs/{run_id}."""
        self._request_seconds.labels(method, route).observe(seconds)

    def text(self, services: Services, database: DatabaseState) -> bytes:
        """All metrics, in the text format of Prometheus."""
        now = CollectorRegistry()
        now.register(_Now([*_service(), *_rig(services), *_database(database), *_jobs(services, database)]))
        return generate_latest(self._registry) + generate_latest(now)


class _Now(Collector):
    def __init__(self, families: list[GaugeMetricFamily]) -> None:
        self._families = families

    def collect(self) -> Iterator[GaugeMetricFamily]:
        """The metrics."""
        yield from self._families


def _gauge(name: str, what: str, value: float) -> GaugeMetricFamily:
    return GaugeMetricFamily(f"jointlab_{name}", what, value)


def _of_each(name: str, what: str, label: str, values: Mapping[str, float]) -> GaugeMetricFamily:
    family = GaugeMetricFamily(f"jointlab_{name}", what, labels=[label])
    for of, value in values.items():
        family.add_metric([of], value)
    return family


def _service() -> Iterator[GaugeMetricFamily]:
    yield _of_each("info", "1, with the version of the service", "version", {software_version(): 1.0})


def _rig(services: Services) -> Iterator[GaugeMetricFamily]:
    runs = services.runs
    if runs is None:
        return
    state = runs.state
    yield _of_each("rig_phase", "1 for what the rig does", "phase", {each.value: each is state.phase for each in Phase})
    yield _gauge("rig_answers", "1 where the rig answers", state.tester_silent is None)
    tripped = {each.name.lower(): each in state.interlocks for each in Interlock if each.name}
    yield _gauge("rig_tripped", "1 where something has stopped the tester and was not reset", state.is_tripped)
    yield _of_each("rig_interlock", "1 for an interlock that fired and was not reset", "interlock", tripped)
    yield _gauge("rig_lease_held", "1 where somebody has the control lease", runs.lease.holder is not None)
    yield _gauge("rig_accepted_blows", "accepted blows of the present or last run", state.blows)
    yield _gauge("rig_refused_blows", "blows refused since it was begun or resumed", state.refused_blows)
    yield _gauge("rig_sine_points", "sine points of the present or last run", state.sines)
    yield _gauge("rig_records_wait", "1 where records cannot be stored", runs.records_wait is not None)


def _database(database: DatabaseState) -> Iterator[GaugeMetricFamily]:
    yield _gauge("database_answers", "1 where the database answers", database.answers is True)
    yield _gauge("database_seconds", "time of its last answer, or since it is silent", database.seconds)


def _jobs(services: Services, database: DatabaseState) -> Iterator[GaugeMetricFamily]:
    if services.jobs is None:
        return
    yield _gauge("jobs_begin", "1 where jobs can be begun", services.jobs.trouble is None)
    if database.answers is False:
        return
    try:
        with services.catalogue.reading() as session:
            counted = count_jobs(session)
    except StoreError:  # it has gone since; the next answer tells by database_answers
        return
    yield _of_each("jobs", "jobs that are not over", "state", {"queued": counted.queued, "running": counted.running})
    yield _gauge("jobs_oldest_queued_seconds", "how long the oldest queued job waits", counted.longest_wait)
