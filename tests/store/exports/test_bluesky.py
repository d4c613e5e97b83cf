"""A run as documents of Bluesky: valid by the schemas of event-model, and with the same values as HDF5."""

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import h5py
import numpy as np
import pytest
from event_model import DocumentNames, EventPage, SingleRunDocumentRouter, schema_validators, unpack_event_page

from store.catalogue import Catalogue
from store.exports.bluesky import export_bluesky
from store.exports.hdf5 import export_hdf5
from store.measurements.blows import list_blows
from store.measurements.runs import list_runs, start_run
from store.measurements.sine_records import list_sine_records
from store.results.analyses import add_analysis
from store.results.joint_matrices import add_joint_matrix
from store.states import AnalysisKind

Documents = list[tuple[str, dict[str, Any]]]


def exported(catalogue: Catalogue, run: int, path: Path) -> Documents:
    """What a program reads that knows JSON without NaN; every document is valid, and belongs to those before it."""
    export_bluesky(catalogue, run, path)
    lines = path.read_text(encoding="utf-8").splitlines()
    documents: Documents = [tuple(json.loads(line, parse_constant=pytest.fail)) for line in lines]
    router = SingleRunDocumentRouter()
    for name, document in documents:
        schema_validators[DocumentNames[name]].validate(document)
        router(name, document)
    return documents


def numbers(catalogue: Catalogue) -> tuple[int, int]:
    """The hammer run and the sweep."""
    with catalogue.reading() as session:
        return list_runs(session, kind="hammer")[0].id, list_runs(session, kind="sweep")[0].id


def streams(documents: Documents) -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:
    """Each descriptor with its page of events."""
    descriptors, pages = ([each for name, each in documents if name == kind] for kind in ("descriptor", "event_page"))
    yield from zip(descriptors, pages, strict=True)


def value_of(descriptor: dict[str, Any], page: dict[str, Any], name: str) -> tuple[Any, dict[str, Any]]:
    """The values under a key with what describes them, whether they are of events or hold for all of them."""
    configuration = descriptor["configuration"]["jointlab"]
    if name in configuration["data"]:
        return configuration["data"][name], configuration["data_keys"][name]
    return page["data"][name], descriptor["data_keys"][name]


@pytest.mark.parametrize("which", [0, 1])
def test_every_result_has_the_values_units_and_uncertainties_of_hdf5(
    which: int, catalogue: Catalogue, filled: int, tmp_path: Path
) -> None:
    run = numbers(catalogue)[which]
    found = {each["name"]: (each, page) for each, page in streams(exported(catalogue, run, tmp_path / "run.jsonl"))}
    export_hdf5(catalogue, run, tmp_path / "run.h5")
    datasets: dict[str, Any] = {}
    with h5py.File(tmp_path / "run.h5") as file:
        file["results"].visititems(
            lambda name, node: (
                datasets.update({name: (node, node[()], dict(node.attrs))}) if isinstance(node, h5py.Dataset) else None
            )
        )
        for path, (node, values, attributes) in datasets.items():
            *place, name = path.split("/")
            stream = found["_".join(place)]
            parts = {"": values}
            if np.iscomplexobj(values):
                parts = {"_real": values.real, "_imaginary": values.imag}
            for ending, expected in parts.items():
                given, key = value_of(*stream, name + ending)
                if expected.dtype == object:
                    expected = node.asstr()[()]
                    assert np.array(given).reshape(expected.shape).tolist() == expected.tolist(), path
                else:
                    read = np.array(given, dtype=float).reshape(expected.shape)  # null becomes NaN
                    np.testing.assert_array_equal(read, expected.astype(float), err_msg=path)
                assert key["units"] == (attributes["units"] or None), path
                assert key["dims"] == list(attributes["dims"])[-len(key["dims"]) :][: len(key["dims"])], path
    assert len(datasets) > 20


def test_events_are_those_of_the_measurement_at_their_times(catalogue: Catalogue, filled: int, tmp_path: Path) -> None:
    hammer, sweep = numbers(catalogue)
    with catalogue.reading() as session:
        blows, sines = list_blows(session, hammer), list_sine_records(session, sweep)
    events = {
        descriptor["name"]: list(unpack_event_page(cast(EventPage, page)))
        for run in (hammer, sweep)
        for descriptor, page in streams(exported(catalogue, run, tmp_path / f"{run}.jsonl"))
    }
    assert [each["data"]["accepted"] for each in events["blows"]] == [blow.accepted for blow in blows]
    assert [each["data"]["reason"] for each in events["blows"]] == [blow.reason or "" for blow in blows]
    assert [each["data"]["peak_force"] for each in events["blows"]] == [blow.peak_force for blow in blows]
    assert [each["time"] for each in events["blows"]] == [
        blow.struck_at and blow.struck_at.timestamp() for blow in blows
    ]
    assert [each["data"]["frequency"] for each in events["sine_records"]] == [sine.frequency for sine in sines]
    assert [each["seq_num"] for each in events["sine_records"]] == list(range(1, len(sines) + 1))


def test_a_run_that_has_not_ended_has_no_stop(catalogue: Catalogue, filled: int, tmp_path: Path) -> None:
    documents = exported(catalogue, numbers(catalogue)[0], tmp_path / "ended.jsonl")
    (name, stop) = documents[-1]
    assert (name, stop["exit_status"]) == ("stop", "success")
    assert stop["num_events"] == {each["name"]: len(page["seq_num"]) for each, page in streams(documents)}
    assert stop["time"] >= max(time for _, page in streams(documents) for time in page["time"])
    with catalogue.writing() as session:
        run = start_run(session, kind="hammer", title="t", article="a", setup={}).id
    assert [name for name, _ in exported(catalogue, run, tmp_path / "running.jsonl")] == ["start"]


def test_the_same_run_has_the_same_documents_each_time(catalogue: Catalogue, filled: int, tmp_path: Path) -> None:
    first, second = (exported(catalogue, filled, tmp_path / f"{number}.jsonl") for number in (1, 2))
    assert first == second
    uids = [each["uid"] for name, each in first if name != "event_page"]
    uids += [uid for _, page in streams(first) for uid in page["uid"]]
    assert len(uids) == len(set(uids))


def test_a_variance_without_bounds_is_null_as_what_is_unknown(
    catalogue: Catalogue, filled: int, samples: SimpleNamespace, tmp_path: Path
) -> None:
    """A term that the data do not determine has an infinite variance, for which JSON has no number."""
    undetermined = replace(samples.joint_matrix("I", 2), covariance=np.diag([np.inf, *np.ones(11)]))
    with catalogue.writing() as session:
        kind = AnalysisKind.JOINT_MATRICES
        analysis = add_analysis(session, kind=kind, method="one set", settings={}, runs=[filled])
        add_joint_matrix(session, analysis, undetermined)
    documents = exported(catalogue, filled, tmp_path / "run.jsonl")
    (pages,) = (pages for pages in streams(documents) if f"analysis_{analysis}_" in pages[0]["name"])
    (covariance,) = value_of(*pages, "covariance")[0]
    assert [covariance[index][index] for index in range(12)] == [None, *[1.0] * 11]
