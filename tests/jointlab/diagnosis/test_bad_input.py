"""Bundles from which something is missing, or that contradict themselves: a clear answer or a clear refusal."""

import csv
import json
import shutil
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.gap.catalogue import effect_ids
from analysis.gap.diagnosis import diagnose
from analysis.gap.faults.removal import examine
from analysis.gap.findings.missing_evidence import missing_evidence
from jointlab.diagnosis.document import diagnosis_document
from jointlab.diagnosis.load import subject_of_bundle
from simlab.case.bundle import write_case
from simlab.case.draw import CaseKind, draw_case
from store.errors import StoreError
from store.exchange.accelerance_file import accelerance_functions, read_accelerances
from store.exchange.bundle import read_bundle
from store.exchange.uff import write_uff
from tests.rewriting import rewrite, with_fewer_lines

EVERY = 32
"""Lines, of which one is kept: few are quick, and enough here."""
Setup = dict[str, Any]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Both rigs, nothing wrong but few lines."""
    folder = tmp_path_factory.mktemp("case") / "bundle"
    write_case(draw_case(12, CaseKind.NONE), folder)
    return with_fewer_lines(folder, EVERY)


@pytest.fixture
def bundle(whole: Path, tmp_path: Path) -> Path:
    """A copy, to be spoilt."""
    return Path(shutil.copytree(whole, tmp_path / "bundle"))


def changed(bundle: Path, change: Callable[[Setup], None]) -> None:
    file = bundle / "setup.json"
    setup = json.loads(file.read_text(encoding="utf-8"))
    change(setup)
    file.write_text(json.dumps(setup), encoding="utf-8")


def said(bundle: Path) -> list[str]:
    """The first words of each sentence on missing evidence; nothing else is wrong with the measurement."""
    measurement = subject_of_bundle(read_bundle(bundle)).measurement
    found = examine(measurement)
    assert found.faults == ()
    return [sentence.partition(":")[0] for sentence in missing_evidence(found.measurement)]


def one_set(bundle: Path) -> None:
    changed(bundle, lambda setup: setup.update(inverse=setup["inverse"][:1]))


def one_row(bundle: Path) -> None:
    one_set(bundle)
    rewrite(bundle / "inverse_1.unv", rows=1)


def no_tester(bundle: Path) -> None:
    changed(bundle, lambda setup: setup.pop("direct"))


def twenty_sine_points(bundle: Path) -> None:
    changed(bundle, lambda setup: setup.pop("inverse"))
    file = bundle / "direct.csv"
    head, *rows = file.read_text(encoding="utf-8").splitlines()
    file.write_text("\n".join([head, *rows[:: len(rows) // 20][:20]]) + "\n", encoding="utf-8")


TRIED = {"frame_compliance", "conditioning_drift", "sensor_gain", "youngs_modulus"}
"""A part of the catalogue, which is quick."""


@pytest.mark.parametrize("spoil", [one_set, one_row, no_tester, twenty_sine_points])
def test_few_data_on_a_bench_with_nothing_wrong_get_an_honest_answer(
    bundle: Path, spoil: Callable[[Path], None]
) -> None:
    spoil(bundle)
    found = diagnose(subject_of_bundle(read_bundle(bundle)).measurement, frozenset(effect_ids()) - TRIED)
    document = diagnosis_document(found)
    assert document["verdict"]["status"] == "none"
    assert document["lost"]
    assert document["gap"]["after"] == document["gap"]["before"]
    assert sum(each["probability"] for each in document["ranking"]) == pytest.approx(1.0)
    tried = {effect for each in document["ranking"] for effect in each["effects"]} - {"unknown"}
    assert tried, "what is said of the catalogue was tried"


def test_no_evidence_is_missing_in_a_whole_bundle(bundle: Path) -> None:
    assert said(bundle) == []


def test_the_tester_alone_is_diagnosed_and_the_loss_is_in_the_document(bundle: Path) -> None:
    changed(bundle, lambda setup: setup.pop("inverse"))
    found = diagnose(subject_of_bundle(read_bundle(bundle)).measurement)
    document = diagnosis_document(found)
    assert document["gap"]["by_rig"].keys() == {"direct"}
    (sentence,) = document["lost"]
    assert sentence.startswith("no beam:")
    assert "accelerometer_mass" in sentence


def test_the_beam_alone_names_the_missing_evidence(bundle: Path) -> None:
    changed(bundle, lambda setup: setup.pop("direct"))
    assert said(bundle) == ["no tester"]


def test_no_coherence_is_said(bundle: Path) -> None:
    for file in bundle.glob("inverse_*.unv"):
        rewrite(file, coherence=False)
    (sentence,) = said(bundle)
    assert sentence.startswith("no coherence in hammer set 1, 2")


def test_one_row_is_said(bundle: Path) -> None:
    for file in bundle.glob("inverse_*.unv"):
        rewrite(file, rows=1)
    assert said(bundle) == ["one row, 1y"]


def test_one_level_is_said(bundle: Path) -> None:
    changed(bundle, lambda setup: setup.update(inverse=setup["inverse"][:1]))
    assert said(bundle) == ["one hammer level, 100 N"]


def test_one_amplitude_is_said(bundle: Path) -> None:
    with (bundle / "direct.csv").open(newline="", encoding="utf-8") as file:
        head, *rows = list(csv.reader(file))
    place = head.index("amplitude_pp_mm")
    with (bundle / "direct.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([head, *(row for row in rows if float(row[place]) == 0.05)])
    assert said(bundle) == ["one amplitude in the tester, 0.05 mm"]


def test_neither_rig_is_refused(bundle: Path) -> None:
    def empty(setup: Setup) -> None:
        del setup["direct"], setup["inverse"]

    changed(bundle, empty)
    with pytest.raises(StoreError, match="neither a hammer set in inverse nor a table of the tester in direct"):
        read_bundle(bundle)


def test_a_table_without_thermometer_is_refused_by_its_column(bundle: Path) -> None:
    file = bundle / "direct.csv"
    file.write_text(file.read_text(encoding="utf-8").replace("temperature_c", "room", 1), encoding="utf-8")
    with pytest.raises(StoreError, match=r"direct\.csv, line 1: missing column temperature_c"):
        read_bundle(bundle)


def node_outside(setup: Setup) -> None:
    setup["node_positions"][-1] = 2 * setup["beam"]["length"]


def negative_length(setup: Setup) -> None:
    setup["beam"]["length"] = -0.914


def accelerometer_nowhere(setup: Setup) -> None:
    setup["accelerometer"]["node"] = 12


def joint_twice(setup: Setup) -> None:
    setup["joints"][1]["name"] = setup["joints"][0]["name"]


def prediction_nowhere(setup: Setup) -> None:
    setup["predict"][0]["input"] = [14, "y"]


@pytest.mark.parametrize(
    ("contradiction", "message"),
    [
        (node_outside, "node_positions end at .* beyond the beam's length"),
        (negative_length, "beam.length: is -0.914; it has to be more than 0"),
        (accelerometer_nowhere, "the accelerometer is at node 12; node_positions has 11"),
        (joint_twice, "joints: a name comes twice among I, I"),
        (prediction_nowhere, "a predicted input is at node 14"),
    ],
)
def test_geometry_that_contradicts_itself_is_refused(
    bundle: Path, contradiction: Callable[[Setup], None], message: str
) -> None:
    changed(bundle, contradiction)
    with pytest.raises(StoreError, match=f"setup.json: .*{message}"):
        read_bundle(bundle)


def test_an_accelerance_that_is_no_number_is_refused(bundle: Path) -> None:
    file = bundle / "inverse_1.unv"
    read = read_accelerances(file)
    value, nothing = (struct.pack("<d", number) for number in (read.accelerance[2, 5].real, np.nan))
    content = file.read_bytes()
    assert content.count(value) == 1
    file.write_bytes(content.replace(value, nothing))
    with pytest.raises(StoreError, match=r"inverse_1\.unv"):
        read_bundle(bundle)


def test_frequencies_that_fall_are_refused(bundle: Path) -> None:
    file = bundle / "inverse_1.unv"
    read = read_accelerances(file)
    functions = accelerance_functions(read.response, read.inputs, read.frequency, read.accelerance)
    write_uff(file, [replace(each, start=1000.0, step=-each.step) for each in functions])
    with pytest.raises(StoreError, match=r"inverse_1\.unv"):
        read_bundle(bundle)


def test_an_accelerometer_without_signal_is_refused(bundle: Path) -> None:
    for file in bundle.glob("inverse_*.unv"):
        read = read_accelerances(file)
        silent = np.zeros_like(read.accelerance)
        write_uff(file, accelerance_functions(read.response, read.inputs, read.frequency, silent))
    measurement = subject_of_bundle(read_bundle(bundle)).measurement
    with pytest.raises(AnalysisError, match="check the accelerometer"):
        examine(measurement)
