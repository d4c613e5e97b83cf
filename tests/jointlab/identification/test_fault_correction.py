"""Faults in rows of a hammer set are found, named and corrected before anything is identified from them."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from analysis.frequency_response import Complex, Real
from jointlab.errors import JointlabError
from jointlab.identification.fault_correction import correct_faults
from jointlab.identification.load import measurement_of_bundle
from jointlab.identification.measurement import MeasuredArticle
from simlab.case.bundle import write_case
from simlab.case.draw import CaseKind, draw_case
from store.exchange.accelerance_file import accelerance_functions, read_accelerances
from store.exchange.bundle import read_bundle
from store.exchange.uff import write_uff
from tests.api.conftest import Command

Change = Callable[[Complex, Real], Any]
QUICK = ("--elements", 1, "--joint-law", "constant")


@pytest.fixture(scope="module")
def case(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("case") / "bundle"
    write_case(draw_case(12, CaseKind.NONE), folder)
    return folder


@pytest.fixture(scope="module")
def clean(case: Path) -> MeasuredArticle:
    return measurement_of_bundle(read_bundle(case))


def spoilt(measurement: MeasuredArticle, change: Change) -> MeasuredArticle:
    stored = measurement.sets[0]
    accelerance = stored.accelerance.copy()
    change(accelerance, stored.frequency)
    sets = list(measurement.sets)
    sets[0] = replace(stored, accelerance=accelerance)
    return replace(measurement, sets=tuple(sets))


def turn(rows: Complex, _frequency: Real) -> None:
    rows[4] *= -1


def kill(rows: Complex, _frequency: Real) -> None:
    rows[4] *= 1e-5


def swap(rows: Complex, _frequency: Real) -> None:
    rows[[2, 5]] = rows[[5, 2]]


def in_g(rows: Complex, _frequency: Real) -> None:
    rows /= 9.80665


def as_receptance(rows: Complex, frequency: Real) -> None:
    rows /= (2j * np.pi * np.maximum(frequency, 1e-3)) ** 2


def as_mobility(rows: Complex, frequency: Real) -> None:
    rows /= 2j * np.pi * np.maximum(frequency, 1e-3)


def test_a_clean_measurement_is_left_as_it_is(clean: MeasuredArticle) -> None:
    assert correct_faults(clean) is clean


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        (turn, "hammer set 1: row 7y has the wrong polarity; corrected"),
        (swap, "hammer set 1: rows 4y and 9y are swapped; corrected"),
        (in_g, "hammer set 1: accelerances in g/N, not accelerances in (m/s^2)/N; corrected"),
        (as_receptance, "hammer set 1: receptances in m/N, not accelerances in (m/s^2)/N; corrected"),
        (as_mobility, "hammer set 1: mobilities in (m/s)/N, not accelerances in (m/s^2)/N; corrected"),
    ],
)
def test_a_fault_is_named_and_only_its_set_is_changed(clean: MeasuredArticle, change: Change, fault: str) -> None:
    found = correct_faults(spoilt(clean, change))
    assert found.faults == (fault,)
    assert found.sets[1:] == clean.sets[1:]
    above = clean.sets[0].frequency >= found.sets[0].frequency[0]
    np.testing.assert_allclose(found.sets[0].accelerance, clean.sets[0].accelerance[:, above], rtol=1e-6)


@pytest.mark.parametrize("change", [None, turn])
def test_a_window_that_cannot_be_corrected_for_is_named_and_taken_for_none(
    clean: MeasuredArticle, change: Change | None
) -> None:
    measured = clean if change is None else spoilt(clean, change)
    first = replace(measured.sets[0], window="hanning")
    found = correct_faults(replace(measured, sets=(first, *measured.sets[1:])))
    assert "'hanning' is not a window that can be corrected for" in found.faults[0]
    assert len(found.faults) == (1 if change is None else 2)
    assert found.responses(0).decay == 0.0


def test_a_dead_row_is_left_out(clean: MeasuredArticle) -> None:
    found = correct_faults(spoilt(clean, kill))
    (fault,) = found.faults
    assert fault.startswith("hammer set 1: row 7y is dead")
    assert [str(point) for point in found.sets[0].inputs] == [
        str(point) for point in clean.sets[0].inputs if str(point) != "7y"
    ]


def test_a_set_without_any_signal_is_refused(clean: MeasuredArticle) -> None:
    def silence(rows: Complex, _frequency: Real) -> None:
        rows *= 0.0

    with pytest.raises(JointlabError, match="remove the set without a signal"):
        correct_faults(spoilt(clean, silence))


@pytest.fixture
def one_set(case: Path, tmp_path: Path) -> Path:
    """A copy of the case with its first hammer set alone."""
    folder = tmp_path / "one_set"
    folder.mkdir()
    setup = json.loads((case / "setup.json").read_text(encoding="utf-8"))
    del setup["direct"], setup["inverse"][1:]
    (folder / "setup.json").write_text(json.dumps(setup), encoding="utf-8")
    shutil.copy(case / "inverse_1.unv", folder)
    return folder


def test_identify_says_what_was_wrong_and_finds_the_same_joints(
    jointlab: Command, one_set: Path, tmp_path: Path
) -> None:
    answer = jointlab("identify", one_set, *QUICK, "--json", "clean.json")
    assert answer.returncode == 0, answer.stderr
    file = one_set / "inverse_1.unv"
    read = read_accelerances(file)
    turn(read.accelerance, read.frequency)
    write_uff(file, accelerance_functions(read.response, read.inputs, read.frequency, read.accelerance, read.coherence))
    answer = jointlab("identify", one_set, *QUICK, "--json", "turned.json")
    assert answer.returncode == 0, answer.stderr
    said = "hammer set 1: row 7y has the wrong polarity; corrected"
    assert f"Found wrong: {said}" in answer.stdout
    files = (tmp_path / f"{name}.json" for name in ("clean", "turned"))
    clean, turned = (json.loads(file.read_text(encoding="utf-8")) for file in files)
    assert (clean["faults"], turned["faults"]) == ([], [said])
    for joint in ("I", "II"):
        np.testing.assert_allclose(
            np.array(turned["inverse"][joint]["k"])[:2, 1], np.array(clean["inverse"][joint]["k"])[:2, 1], rtol=2e-3
        )
