"""Traces by OpenTelemetry: spans of requests, jobs and statements of the database, sent where ``[log] traces`` says.

They are sent in the background, and dropped where nobody takes them: a collector that is away delays nothing. The drive
process has none, so that nothing there can delay STOP.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

from pydantic import AnyHttpUrl
from sqlalchemy import event
from sqlalchemy.engine import Engine

from store.extras import explained_imports

DEADLINE = 2.0
"""s that sending may take at most, also at the end of a process."""
STATEMENT = 500
"""Characters of an SQL statement that its span has."""
FAILED = "error.type"
"""Attribute of what failed, by the semantic conventions of OpenTelemetry."""


@dataclass
class OpenSpan:
    """A span that has not ended: what it will be recorded with.

    Attributes:
        name: of the span.
        attributes: by name.
    """

    name: str
    attributes: dict[str, str | int] = field(default_factory=dict)


class _Sender:
    """Sends the spans of this process, and makes one of every statement of the database that belongs to another."""

    def __init__(self, url: AnyHttpUrl, service: str) -> None:
        with explained_imports():
            sdk, exporter, resources = (
                import_module(f"opentelemetry.{name}")
                for name in ("sdk.trace", "exporter.otlp.proto.http.trace_exporter", "sdk.resources")
            )
            batches = import_module("opentelemetry.sdk.trace.export").BatchSpanProcessor
            self.trace: Any = import_module("opentelemetry.trace")
            self.propagate: Any = import_module("opentelemetry.propagate")
        self._provider = sdk.TracerProvider(resource=resources.Resource.create({"service.name": service}))
        self._provider.add_span_processor(batches(exporter.OTLPSpanExporter(endpoint=str(url), timeout=DEADLINE)))
        self.tracer: Any = self._provider.get_tracer("jointlab")
        self._hooks = (
            ("before_cursor_execute", self._begin),
            ("after_cursor_execute", self._end),
            ("handle_error", self._fail),
        )
        for name, hook in self._hooks:
            event.listen(Engine, name, hook)

    def flush(self) -> None:
        self._provider.force_flush(int(1000 * DEADLINE))

    def close(self) -> None:
        for name, hook in self._hooks:
            event.remove(Engine, name, hook)
        self._provider.shutdown()

    def _begin(self, _connection: Any, _cursor: Any, statement: str, _values: Any, context: Any, _many: bool) -> None:
        if context is not None and self.trace.get_current_span().is_recording():
            about = {"db.query.text": statement[:STATEMENT]}
            context.span_of_jointlab = self.tracer.start_span(
                f"database {statement.split(maxsplit=1)[0]}", kind=self.trace.SpanKind.CLIENT, attributes=about
            )

    def _end(self, _connection: Any, _cursor: Any, _statement: str, _values: Any, context: Any, _many: bool) -> None:
        if (span := getattr(context, "span_of_jointlab", None)) is not None:
            span.end()

    def _fail(self, failed: Any) -> None:
        if (span := getattr(failed.execution_context, "span_of_jointlab", None)) is not None:
            span.record_exception(failed.original_exception)
            span.set_status(self.trace.StatusCode.ERROR)
            span.end()


_sender: _Sender | None = None


def send_traces(url: AnyHttpUrl | None, service: str = "jointlab") -> None:
    """Send the spans of this process to `url` from now on, by OTLP over HTTP; None sends none.

    Args:
        url: of the collector, with its path, as ``http://127.0.0.1:4318/v1/traces``.
        service: name of this process in traces.

    Raises:
        MissingExtraError: the extra `traces` is not installed.
    """
    global _sender
    if _sender is not None:
        _sender.close()
        _sender = None
    if url is not None:
        _sender = _Sender(url, service)


def flush_traces() -> None:
    """Send what waits, for `DEADLINE` at most."""
    if _sender is not None:
        _sender.flush()


@contextmanager
def span(name: str, asked: Mapping[str, str] | None = None, /, **ids: str | int) -> Iterator[OpenSpan]:
    """Record how long the context takes, with attributes that are added meanwhile; an exception marks it as an error.

    Args:
        name: of the span.
        asked: headers of the request that it answers, which may name the span of the client; None: no request.
        ids: attributes such as ``job``.
    """
    opened = OpenSpan(name, {f"jointlab.{each}": value for each, value in ids.items()})
    with nullcontext() if _sender is None else _recorded(_sender, opened, asked):
        yield opened


@contextmanager
def _recorded(sender: _Sender, opened: OpenSpan, asked: Mapping[str, str] | None) -> Iterator[None]:
    kinds = sender.trace.SpanKind
    above, kind = (None, kinds.INTERNAL) if asked is None else (sender.propagate.extract(asked), kinds.SERVER)
    with sender.tracer.start_as_current_span(opened.name, context=above, kind=kind) as current:
        try:
            yield
        finally:
            current.update_name(opened.name)
            current.set_attributes(opened.attributes)
            if FAILED in opened.attributes:
                current.set_status(sender.trace.StatusCode.ERROR)


def happened(what: str) -> None:
    """Note in the present span that something began."""
    if _sender is not None:
        _sender.trace.get_current_span().add_event(what)
