"""Results as documents for other people's programs."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.inverse.frequency_law import FrequencyLaw
from api.commands.terminal import check_writable, write_json
from jointlab.errors import JointlabError
from jointlab.identification.document import identification_document, plain
from jointlab.identification.options import Options
from jointlab.identification.pipeline import identify
from tests.jointlab.identification.layouts import LAYOUTS, measured

numbers = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5)
values = st.recursive(
    numbers
    | st.floats(width=32).map(np.float32)
    | st.integers(-(2**31), 2**31).map(np.int64)
    | st.lists(st.floats(), max_size=4).map(np.array),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.lists(inner, max_size=3).map(tuple)
        | st.dictionaries(st.text(max_size=3), inner, max_size=3)
    ),
)


@given(values)
def test_every_value_has_a_json_form(value: object) -> None:
    text = json.dumps(plain(value), allow_nan=False)
    assert json.loads(text) == plain(value)


def test_what_is_not_known_is_null() -> None:
    found = {"gamma": np.array([[0.1, np.nan], [np.inf, 2.0]]), "flags": np.array([True, False]), 0.1: np.float64(3)}
    assert plain(found) == {"gamma": [[0.1, None], [None, 2.0]], "flags": [True, False], "0.1": 3.0}
    assert type(plain(np.bool_(True))) is bool


def test_intervals_of_cylinders_are_those_of_the_blows_behind_them() -> None:
    """Three degrees of freedom, as of four blows at each point, make them 1.6 times as wide as a normal one."""
    found = identify(measured(LAYOUTS["nine nodes"]), Options(joint_law=FrequencyLaw.CONSTANT))
    assert found.inverse is not None
    fit = found.inverse.cylinders
    assert fit is not None
    of_few = replace(fit, degrees_of_freedom=np.full(len(fit.labels), 3.0))
    many, few = (
        identification_document(replace(found, inverse=replace(found.inverse, cylinders=each)))["inverse_cylinders"]
        for each in (fit, of_few)
    )
    for name, told in many["parameters"].items():
        widths = [np.ptp(each["parameters"][name]["ci95"]) for each in (many, few)]
        assert few["parameters"][name]["value"] == told["value"]
        assert widths[1] / widths[0] == pytest.approx(3.182 / 1.960, rel=1e-3)


def test_a_document_is_whole_or_not_there(tmp_path: Path) -> None:
    file = tmp_path / "found.json"
    write_json({"k": 1.0}, file)
    with pytest.raises(ValueError, match="not JSON compliant"):
        write_json({"k": float("nan")}, file)
    assert json.loads(file.read_text(encoding="utf-8")) == {"k": 1.0}
    assert [path.name for path in tmp_path.iterdir()] == ["found.json"]


def test_a_document_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(JointlabError, match=r"found\.json cannot be written: No such file"):
        write_json({}, tmp_path / "no" / "found.json")


def test_a_file_that_was_there_stays_where_another_is_written(tmp_path: Path) -> None:
    (beside := tmp_path / "found.json.part").write_text("notes")
    check_writable(tmp_path / "found.json")
    write_json({"k": 1.0}, tmp_path / "found.json")
    assert beside.read_text() == "notes"
    assert sorted(each.name for each in tmp_path.iterdir()) == ["found.json", "found.json.part"]
