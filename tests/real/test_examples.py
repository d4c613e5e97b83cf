"""Every example bundle comes out of the store as it went in, and what is identified from it is stored."""

import json
from dataclasses import asdict, fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from jointlab.identification.document import identification_document
from jointlab.identification.load import measurement_of_bundle, measurement_of_run
from jointlab.identification.measurement import MeasuredArticle, responses_of
from jointlab.identification.pipeline import identify
from jointlab.identification.save import save_identification
from store.catalogue import Catalogue
from store.exchange.bundle import read_bundle
from store.exchange.bundle_exchange import export_bundle, import_bundle
from store.exchange.bundle_setup import Article
from tests.recordings import Recording

EXAMPLES = (
    "amplitude",
    "delay",
    "foundation",
    "frame",
    "none",
    "novel_1",
    "novel_2",
    "out_of_plane",
    "pair",
    "sensor_mass",
)
QUICK = ("none", "frame", "amplitude")  # a search that finds no fit takes up to a minute
MODES = ("frequency_hz", "loss_factor", "predicted_hz")
JOINT = {"k": (3, 3), "h": (3, 3), "gamma": (3, 3), "k_ci95": (3, 3, 2), "h_ci95": (3, 3, 2), "observable": (3, 3)}


def plain(value: Any) -> Any:
    """Plain values that can be compared; arrays by type, shape and every bit but the sign of a zero."""
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, (value + 0).tobytes()
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value


def check_form(document: dict[str, Any], joints: set[str]) -> None:
    """The form that other programs rely on."""
    assert json.loads(json.dumps(document, allow_nan=False)) == document
    assert document["format"] == "jointlab-identification/1"
    count = len(document["modes"]["frequency_hz"])
    assert count >= 3
    for name in MODES:
        assert len(document["modes"][name]) == count, name
    for name in ("frequency_ci95", "loss_factor_ci95"):
        assert np.shape(document["modes"][name]) == (count, 2)
    assert set(document["inverse"]) >= joints | {"weak_directions"}
    for joint in joints:
        for name, shape in JOINT.items():
            assert np.shape(document["inverse"][joint][name]) == shape, (joint, name)
        assert set(document["direct"][joint]) == {"compression", "shear", "angled"}
        for by_amplitude in document["direct"][joint].values():
            for points in by_amplitude.values():
                assert {len(values) for values in points.values()} == {len(points["frequency_hz"])}
                assert points["frequency_hz"] == sorted(points["frequency_hz"])
    assert {each["verdict"] for each in document["comparison"]} <= {"agree", "differ", "not comparable"}
    assert {each["joint"] for each in document["comparison"]} >= joints
    assert document["seconds"] >= 0


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_is_imported_and_exported_equal(recording: Recording, tmp_path: Path, name: str) -> None:
    original = read_bundle(recording(f"examples/{name}"))
    with Catalogue.open(f"sqlite:///{tmp_path / 'lab.db'}") as catalogue:
        run = import_bundle(catalogue, original)
        measurement = measurement_of_run(catalogue, run)
        export_bundle(catalogue, run, tmp_path / "out")
    assert plain(read_bundle(tmp_path / "out")) == plain(original)
    # what identification works on is the same from either
    from_bundle = measurement_of_bundle(original)
    assert plain(measurement.points) == plain(from_bundle.points)
    for ours, theirs in zip(measurement.sets, from_bundle.sets, strict=True):
        assert plain(responses_of(ours)) == plain(responses_of(theirs))
    assert article_of(measurement) == article_of(from_bundle)


@pytest.mark.parametrize("name", QUICK)
def test_what_is_identified_from_an_example_is_stored(recording: Recording, tmp_path: Path, name: str) -> None:
    original = read_bundle(recording(f"examples/{name}"))
    with Catalogue.open(f"sqlite:///{tmp_path / 'lab.db'}") as catalogue:
        run = import_bundle(catalogue, original)
        found = identify(measurement_of_run(catalogue, run))
        with catalogue.writing() as session:
            stored = save_identification(session, run, found)
    assert [name for name, number in asdict(stored).items() if number is None] == ["suspended_beam"]
    document = identification_document(found)
    check_form(document, {joint.name for joint in original.setup.joints})
    if name == "none":
        check_k22(document["inverse_paper"], recording("examples/truth/none.json"))


def check_k22(inverse: dict[str, Any], file: Path) -> None:
    """Where nothing but tolerances is put in, the paper's method finds k22 to 3 %."""
    truth = json.loads(file.read_text(encoding="utf-8"))["joints"]
    for joint in ("I", "II"):
        assert inverse[joint]["k"][1][1] == pytest.approx(truth[joint]["k"][1][1], rel=0.03), joint


def article_of(measurement: MeasuredArticle) -> dict[str, Any]:
    return {name: getattr(measurement.article, name) for name in Article.model_fields}
