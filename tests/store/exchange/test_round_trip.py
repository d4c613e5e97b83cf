"""Whatever bundle import takes comes out of export as it went in: names, sets, sine points and blows."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from store.catalogue import Catalogue
from store.dof import StoredDof
from store.exchange.accelerance_file import accelerance_functions
from store.exchange.blow_file import BundleBlow, write_blow
from store.exchange.bundle import read_bundle
from store.exchange.bundle_exchange import export_bundle, import_bundle
from store.exchange.direct_table import write_direct
from store.exchange.uff import write_uff
from tests.store.conftest import SETUP
from tests.store.exchange.test_bundle_exchange import assert_equal
from tests.store.exchange.test_direct_table import POINTS

ARTICLE: dict[str, Any] = dict(SETUP)
VALUES = st.floats(-1e12, 1e12)
NAMES = st.text(st.characters(exclude_categories=["Cs", "Cc"]), min_size=1, max_size=6)
FILES = st.from_regex(r"[A-Za-z0-9 äö_\-]{1,12}\.(unv|uff|UNV)", fullmatch=True)
SETS: st.SearchStrategy[dict[str, Any]] = st.fixed_dictionaries(
    {
        "file": FILES,
        "averages": st.integers(1, 1000),
        "peak_force": st.floats(1e-3, 1e5),
        "temperature_c": st.floats(-200, 900),
        "window": st.sampled_from(["none", "force 0.05 s", "exponential 5 %", "hann", ""]),
        "sample_rate": st.floats(100, 1e6),
        "block_seconds": st.floats(1e-3, 100),
        "excitation": st.sampled_from(["hammer", "sine"]),
    }
)
BLOWS = st.tuples(
    st.sampled_from([StoredDof(1, "y"), StoredDof(2, "x")]),
    st.lists(st.tuples(VALUES, VALUES), min_size=2, max_size=9),
    st.sampled_from([3000.0, 4096.0, 51200.0]) | st.floats(10, 1e6),
)


def write_set(path: Path, entry: dict[str, Any], draw: st.DataObject) -> None:
    """One set with one or two rows, in text or binary, with coherence or without."""
    response = StoredDof(3, "y") if entry["excitation"] == "hammer" else StoredDof(4, "x")
    inputs = (StoredDof(1, "y"), StoredDof(4, "y"))[: draw.draw(st.integers(1, 2))]
    start, step = draw.draw(st.sampled_from([(0.0, 0.5), (0.5, 0.1), (3.25, 1 / 3), (0.1, 0.3125)]))
    shape = (len(inputs), draw.draw(st.integers(2, 5)))
    count = 2 * shape[0] * shape[1]
    parts = draw.draw(st.lists(VALUES, min_size=count, max_size=count))
    real, imaginary = np.array(parts).reshape(2, *shape)
    imaginary[:, 0] = 1.0  # one that is zero throughout is no complex value
    coherence = np.full(shape, draw.draw(st.floats(0, 1))) if draw.draw(st.booleans()) else None
    frequency = np.asarray(start + np.arange(shape[1]) * step, dtype=np.float64)
    functions = accelerance_functions(
        response, inputs, frequency, real + 1j * imaginary, coherence, entry["excitation"]
    )
    write_uff(path, functions, binary=draw.draw(st.booleans()))


def write_bundle(folder: Path, draw: st.DataObject) -> None:
    (folder / "blows").mkdir(parents=True)
    names = draw.draw(st.lists(NAMES, min_size=2, max_size=2, unique=True))
    joints = [joint | {"name": name} for joint, name in zip(ARTICLE["joints"], names, strict=True)]
    sets = draw.draw(st.lists(SETS, min_size=1, max_size=2, unique_by=lambda each: each["file"].lower()))
    for entry in sets:
        write_set(folder / entry["file"], entry, draw)
    found = draw.draw(st.lists(POINTS, max_size=3, unique_by=lambda point: point.order))
    points = [replace(each, specimen=draw.draw(st.sampled_from(names))) for each in found]
    table = None
    if points:
        table = {"file": "Tester 1.csv", "preset_mm": draw.draw(st.floats(0, 10))}
        write_direct(folder / "Tester 1.csv", sorted(points, key=lambda point: point.order))
    for number, (point, record, rate) in enumerate(draw.draw(st.lists(BLOWS, max_size=2))):
        force, acceleration = np.array(record).T
        blow = BundleBlow(f"b{number}.unv", point, StoredDof(3, "y"), force, acceleration, rate, number)
        write_blow(folder / "blows", blow)
    title = draw.draw(st.text(st.characters(exclude_categories=["Cs"]), max_size=20))
    setup = ARTICLE | {"title": title, "joints": joints, "inverse": sets, "direct": table}
    (folder / "setup.json").write_text(json.dumps(setup), encoding="utf-8")


@given(draw=st.data())
@settings(max_examples=10)
def test_a_bundle_comes_out_as_it_went_in(sqlite_template: Path, draw: st.DataObject) -> None:
    with TemporaryDirectory() as scratch:
        folder = Path(scratch)
        write_bundle(folder / "in", draw)
        original = read_bundle(folder / "in")
        shutil.copy(sqlite_template, folder / "lab.db")
        with Catalogue.open(f"sqlite:///{folder / 'lab.db'}") as catalogue:
            export_bundle(catalogue, import_bundle(catalogue, original, "beam 3"), folder / "out")
        assert_equal(replace(read_bundle(folder / "out"), warnings=()), replace(original, warnings=()))
