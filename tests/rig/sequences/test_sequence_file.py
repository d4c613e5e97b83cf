"""YAML files that would fill the memory are refused before they do."""

import re
from importlib.resources import files
from pathlib import Path

import pytest
import yaml

from rig.sequences.sequence import SequenceError
from rig.sequences.sequence_file import LARGEST_FILE, MOST_VALUES, load_sequence, read_yaml

BOMB = "\n".join(["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"] + [
    f"a{level}: &a{level} [{', '.join(10 * [f'*a{level - 1}'])}]" for level in range(1, 30)
])  # fmt: skip


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "sequence.yaml"


@pytest.mark.parametrize("text", [BOMB, "a: &a [*a]", "&a {b: *a}", f"[{(MOST_VALUES + 1) * 'x, '}]"])
def test_a_document_of_too_many_values_is_refused_in_words(file: Path, text: str) -> None:
    file.write_text(text, encoding="utf-8")
    with pytest.raises(SequenceError, match=r"values with those of its aliases|holds itself"):
        load_sequence(file)


def test_a_file_that_is_too_large_is_refused_in_words(file: Path) -> None:
    file.write_bytes(b"#" * (LARGEST_FILE + 1))
    with pytest.raises(SequenceError, match="more than 1000000 bytes"):
        load_sequence(file)


@pytest.mark.parametrize("text", ["", "a: 1", "a: &a [1, 2]\nb: *a\nc: {<<: {d: 2026-01-02}}", "[~, 1.5, x]", "--- \n"])
def test_other_documents_are_read_as_ever(text: str) -> None:
    assert read_yaml(text)[0] == yaml.safe_load(text)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("70e9", 70e9),
        ("-3E-4", -3e-4),
        (".5e2", 50.0),
        ("7.0e+9", 7e9),
        ("2e9x", "2e9x"),
        ("1e", "1e"),
        ("1e3 m", "1e3 m"),
    ],
)
def test_a_number_may_have_an_exponent_as_in_json(text: str, value: object) -> None:
    assert read_yaml(f"E: {text}")[0] == {"E": value}


def test_a_second_document_is_refused(file: Path) -> None:
    file.write_text("a: 1\n---\nb: 2\n", encoding="utf-8")
    with pytest.raises(SequenceError, match="not valid YAML"):
        load_sequence(file)


def test_an_error_is_told_with_its_line(file: Path) -> None:
    lines = files("jointlab.sequences").joinpath("paper.yaml").read_text(encoding="utf-8").splitlines()
    blows = next(number for number, line in enumerate(lines, start=1) if line.strip().startswith("blows:"))
    length = next(number for number, line in enumerate(lines, start=1) if line.strip().startswith("length:"))
    lines[blows - 1] = lines[blows - 1].replace("blows: 10", "blows: 0")
    lines[length - 1] = lines[length - 1].replace("0.914", "-1")
    file.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(SequenceError) as refused:
        load_sequence(file)
    assert f"line {blows}, steps.0.hammer.blows: is 0; it has to be 2 or more" in str(refused.value)
    assert f"line {length}, article.beam.length: is -1; it has to be more than 0" in str(refused.value)
    assert [fault.split(", ")[0] for fault in refused.value.faults] == [f"line {length}", f"line {blows}"]
    lines[blows - 1] = lines[blows - 1].replace("blows: 0", "blows: 10")
    lines[length - 1] = lines[length - 1].replace("length: -1", "length: 0.914\n    lenght: 1")
    file.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(SequenceError, match=rf": line {length + 1}, article.beam.lenght: there is no such key"):
        load_sequence(file)


@pytest.mark.parametrize(
    ("written", "wrong", "place"),
    [
        ("11x", "12x", "steps.0.hammer.points.10: no node for 12x; the article has 11 nodes"),
        ("specimens: [I, II]", "specimens: [I, III]", "steps.1.sweep.specimens.1: no joint III in the article"),
        ("article:", "article:", "article: nodes run from 0.0 m to 0.914 m"),
    ],
)
def test_what_contradicts_another_part_is_told_with_its_line(file: Path, written: str, wrong: str, place: str) -> None:
    text = files("jointlab.sequences").joinpath("paper.yaml").read_text(encoding="utf-8")
    assert text.count(written) == 1
    text = text.replace(written, wrong)
    if wrong == written:
        text = text.replace("length: 0.914", "length: 0.95")
    file.write_text(text, encoding="utf-8")
    line = text[: text.index(wrong)].count("\n") + 1
    with pytest.raises(SequenceError, match=re.escape(f": line {line}, {place}")):
        load_sequence(file)
