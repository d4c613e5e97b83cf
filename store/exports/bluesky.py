"""A run as documents of Bluesky's event model, for tiled, databroker and what else reads them: JSON lines."""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any
from uuid import NAMESPACE_URL, uuid5

import numpy as np
from numpy.typing import NDArray

from store.catalogue import Catalogue
from store.exports.content import UNITS, Attributes, RunContent, Variable, content_of
from store.measurements.blows import Blow, list_blows
from store.measurements.runs import Run, get_run
from store.measurements.sine_records import SineRecord, list_sine_records
from store.new_file import new_file
from store.states import AnalysisKind, RunState

FORMAT = "jointlab-bluesky/1"
OBJECT = "jointlab"
"""The object of Bluesky that has all keys and their configuration."""
Document = tuple[str, dict[str, Any]]
"""Name and content."""

_EVENTS: Mapping[str, str] = {
    AnalysisKind.FREQUENCY_RESPONSES: "input",
    AnalysisKind.MODES: "mode",
    AnalysisKind.DYNAMIC_STIFFNESS: "point",
    AnalysisKind.COMPARISONS: "comparison",
}
"""The dimension along which results of a kind are events; another kind is one event."""
_EXITS = {RunState.FINISHED: "success", RunState.STOPPED: "abort", RunState.FAILED: "fail"}
_BLOW = ("point", "set_number", "number", "accepted", "reason", "peak_force", "temperature_c")
_SINE = (
    "order_number", "specimen", "configuration", "commanded_pp_mm", "reached_pp_mm", "frequency", "driven_frequency",
    "elapsed", "temperature_c",
)  # fmt: skip
_TEXTS = ("point", "reason", "specimen", "configuration")
_UNITS = {**UNITS, "peak_force": "N", "commanded_pp_mm": "mm", "driven_frequency": "Hz"}


@dataclass(frozen=True, eq=False)
class Stream:
    """Events of one kind.

    Attributes:
        name: of the stream.
        times: of the events, in seconds since 1970.
        events: a value of each event along the first dimension.
        constants: arrays that hold for all events.
        attributes: what else holds for all of them.
    """

    name: str
    times: Sequence[float]
    events: Mapping[str, Variable]
    constants: Mapping[str, Variable]
    attributes: Attributes


def export_bluesky(catalogue: Catalogue, run_id: int, path: Path) -> int:
    """Write blows and sine records of a run, without their waveforms, and its newest results; how many analyses.

    A line is the name of a document and the document. Blows, sine records and each part of the results are a stream:
    a descriptor with units, and a page of events. Accelerances have an event for each input, modes for each mode, a
    joint is one event. What is the same for all events, such as the frequencies and where a result comes from, is the
    configuration of the descriptor. Complex values are two keys, ``_real`` and ``_imaginary``; an unknown or
    infinite value is null. A run that has not ended has no stop document.

    Raises:
        NotFoundError: there is no such run.
        DamagedError: a result is damaged.
        StoreError: the file exists already or cannot be written.
    """
    with catalogue.reading(long=True) as session:
        run, content = get_run(session, run_id), content_of(session, run_id)
        blows, sines = list_blows(session, run_id), list_sine_records(session, run_id)
    streams = [*_measured(run, blows, sines), *_results(content)]
    with new_file(path) as unfinished, unfinished.open("w", encoding="utf-8") as file:
        for document in _documents(run, content, streams):
            file.write(json.dumps(document, allow_nan=False) + "\n")
    return content.analyses


def _documents(run: Run, content: RunContent, streams: Sequence[Stream]) -> Iterator[Document]:
    start = _uid(run, "start")
    began = run.started_at.timestamp()
    yield (
        "start",
        {
            "uid": start, "time": began, "scan_id": run.id, "format": FORMAT, **content.attributes,
            "setup": content.setup,
        },
    )  # fmt: skip
    for stream in streams:
        descriptor = _uid(run, stream.name)
        keys = {name: _data_key(each, each.dims[1:], stream.name) for name, each in stream.events.items()}
        yield (
            "descriptor",
            {
                "uid": descriptor, "run_start": start, "time": stream.times[0], "name": stream.name, "data_keys": keys,
                "object_keys": {OBJECT: list(keys)}, "configuration": {OBJECT: _configuration(stream)},
            },
        )  # fmt: skip
        times = list(stream.times)
        yield (
            "event_page",
            {
                "descriptor": descriptor,
                "uid": [_uid(run, f"{stream.name} {number}") for number in range(1, len(times) + 1)],
                "seq_num": list(range(1, len(times) + 1)),
                "time": times,
                "data": {name: _plain(each.values) for name, each in stream.events.items()},
                "timestamps": dict.fromkeys(stream.events, times),
                "filled": {},
            },
        )
    if run.state in _EXITS and run.finished_at is not None:
        ended = max(run.finished_at.timestamp(), *(time for stream in streams for time in stream.times), began)
        yield (
            "stop",
            {
                "uid": _uid(run, "stop"), "run_start": start, "time": ended, "exit_status": _EXITS[run.state],
                "reason": run.reason or "", "num_events": {stream.name: len(stream.times) for stream in streams},
            },
        )  # fmt: skip


def _measured(run: Run, blows: Sequence[Blow], sines: Sequence[SineRecord]) -> Iterator[Stream]:
    for name, records, names, times in (
        ("blows", blows, _BLOW, [each.struck_at for each in blows]),
        ("sine_records", sines, _SINE, [each.recorded_at for each in sines]),
    ):
        if records:
            events = {each: _column([getattr(record, each) for record in records], each) for each in names}
            yield Stream(name, [(time or run.started_at).timestamp() for time in times], events, {}, {})


def _column(values: Sequence[Any], name: str) -> Variable:
    if name in _TEXTS:
        return Variable(("record",), np.array(["" if each is None else str(each) for each in values], dtype=object), "")
    array = np.array([np.nan if each is None else each for each in values])
    return Variable(("record",), array, _UNITS.get(name, "1"))


def _results(content: RunContent) -> Iterator[Stream]:
    for part in content.parts:
        along = _EVENTS.get(part.kind)
        variables = _without_complex(part.variables)
        if along is None:
            variables = {
                name: replace(each, dims=("", *each.dims), values=each.values[np.newaxis])
                for name, each in variables.items()
            }
        events = {name: each for name, each in variables.items() if each.dims[0] == (along or "")}
        constants = {name: each for name, each in variables.items() if name not in events}
        time = datetime.fromisoformat(str(part.origin["created_at"])).timestamp()
        times = [time] * len(next(iter(events.values())).values)
        attributes = {**part.labels, **part.attributes, **part.origin}
        yield Stream("_".join(part.path), times, events, constants, attributes)


def _without_complex(variables: Mapping[str, Variable]) -> dict[str, Variable]:
    found = dict[str, Variable]()
    for name, each in variables.items():
        if np.iscomplexobj(each.values):
            found[f"{name}_real"] = replace(each, values=each.values.real)
            found[f"{name}_imaginary"] = replace(each, values=each.values.imag)
        else:
            found[name] = each
    return found


def _configuration(stream: Stream) -> dict[str, Any]:
    """Arrays and attributes that hold for all events of a stream."""
    given = dict(stream.constants)
    for name, value in stream.attributes.items():
        array = np.array(value, dtype=object if isinstance(value, str) else None)
        given[name] = Variable(("value",) * array.ndim, array, "")
    return {
        "data": {name: _plain(each.values) for name, each in given.items()},
        "timestamps": dict.fromkeys(given, stream.times[0]),
        "data_keys": {name: _data_key(each, each.dims, stream.name) for name, each in given.items()},
    }


def _data_key(variable: Variable, dims: tuple[str, ...], source: str) -> dict[str, Any]:
    """The description of a key of an event or a configuration; `dims` are those of one value."""
    values = variable.values
    kinds = {"O": "string", "U": "string", "b": "boolean", "i": "integer", "u": "integer", "f": "number"}
    key = {
        "source": f"{OBJECT}:{source}",
        "dtype": "array" if dims else kinds[values.dtype.kind],
        "shape": list(values.shape[values.ndim - len(dims) :]),
        "dims": list(dims),
        "units": variable.unit or None,
    }
    return key if values.dtype.kind in "OU" else key | {"dtype_numpy": values.dtype.newbyteorder("<").str}


def _plain(values: NDArray[Any]) -> Any:
    """The values for JSON, which has neither NaN nor infinity, such as the variance of what data do not determine."""
    if values.dtype.kind != "f":
        return values.tolist()
    found = values.astype(object)
    found[~np.isfinite(values)] = None
    return found.tolist()


def _uid(run: Run, name: str) -> str:
    """An id that is the same for one part of one run, wherever it is exported."""
    return str(uuid5(NAMESPACE_URL, f"{OBJECT}:{run.waveform_file}:{name}"))
