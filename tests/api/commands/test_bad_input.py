"""Bad input: one line that names what is wrong, the exit code for it, and nothing stored."""

import json
import os
import re
import shutil
import sqlite3
import zipfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import pytest

from store.catalogue import Catalogue
from store.measurements.runs import finish_run, get_run, start_run
from store.states import RunState
from tests.api.conftest import Command, Contents, paper
from tests.unfit_points import without_temperature

BAD_INPUT = 3


def refused(answer: CompletedProcess[str], *words: str, code: int = BAD_INPUT) -> None:
    """Check the manner of a refusal."""
    assert answer.returncode == code, answer.stderr
    lines = answer.stderr.splitlines()
    assert len(lines) == 1, answer.stderr
    assert lines[0].startswith("jointlab: ")
    for word in words:
        assert word in lines[0]


def setup_with(change: Callable[[dict[str, Any]], None]) -> Callable[[Path], None]:
    def apply(bundle: Path) -> None:
        setup = json.loads((bundle / "setup.json").read_text(encoding="utf-8"))
        change(setup)
        (bundle / "setup.json").write_text(json.dumps(setup), encoding="utf-8")

    return apply


def column(name: str, value: str) -> Callable[[Path], None]:
    """Another value in line 3 of the tester's table."""

    def apply(bundle: Path) -> None:
        lines = (bundle / "direct.csv").read_text(encoding="utf-8").splitlines()
        cells = lines[2].split(",")
        cells[lines[0].split(",").index(name)] = value
        lines[2] = ",".join(cells)
        (bundle / "direct.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")

    return apply


def truncated(name: str) -> Callable[[Path], None]:
    def apply(bundle: Path) -> None:
        content = (bundle / name).read_bytes()
        (bundle / name).write_bytes(content[: len(content) * 2 // 3])

    return apply


def replaced(name: str, content: bytes) -> Callable[[Path], None]:
    def apply(bundle: Path) -> None:
        (bundle / name).write_bytes(content)

    return apply


def without(name: str) -> Callable[[Path], None]:
    return lambda bundle: (bundle / name).unlink()


def header(old: bytes, new: bytes) -> Callable[[Path], None]:
    """Another text in the headers of the accelerances."""

    def apply(bundle: Path) -> None:
        content = (bundle / "inverse_1.unv").read_bytes()
        assert old in content
        (bundle / "inverse_1.unv").write_bytes(content.replace(old, new))

    return apply


@pytest.mark.parametrize(
    ("damage", "words"),
    [
        (truncated("inverse_1.unv"), ["inverse_1.unv"]),
        (truncated("direct.csv"), ["direct.csv", "line"]),
        (truncated("setup.json"), ["setup.json", "line"]),
        (replaced("inverse_1.unv", b"certainly no UFF\n" * 40), ["inverse_1.unv"]),
        (replaced("inverse_1.unv", b""), ["inverse_1.unv"]),
        (replaced("inverse_1.unv", bytes(range(256)) * 10), ["inverse_1.unv"]),
        (without("setup.json"), ["setup.json is missing"]),
        (without("inverse_1.unv"), ["inverse_1.unv is missing"]),
        (without("direct.csv"), ["direct.csv is missing"]),
        (setup_with(lambda setup: setup["beam"].pop("density")), ["setup.json", "beam.density"]),
        (setup_with(lambda setup: setup.pop("joints")), ["setup.json", "joints"]),
        (setup_with(lambda setup: setup["inverse"][0].update(averages=0)), ["setup.json", "inverse.0.averages"]),
        (setup_with(lambda setup: setup["inverse"][0].update(peak_force=float("nan"))), ["setup.json", "NaN"]),
        (setup_with(lambda setup: setup["beam"].update(youngs_modulus=207.0)), ["setup.json", "youngs_modulus"]),
        (setup_with(lambda setup: setup["beam"].update(length="0.914")), ["setup.json", "beam.length"]),
        (setup_with(lambda setup: setup["joints"][1].update(node=14)), ["setup.json", "14"]),
        (setup_with(lambda setup: setup["node_positions"].pop()), ["11"]),
        (setup_with(lambda setup: setup["accelerometer"].update(node=4)), ["inverse_1.unv", "3y", "4y"]),
        (setup_with(lambda setup: setup.update(format="jointlab-bundle/2")), ["setup.json", "format"]),
        (setup_with(lambda setup: setup["direct"].update(file="../direct.csv")), ["setup.json", "direct.file"]),
        (setup_with(lambda setup: setup.update(checksums={"direct.csv": "0" * 64})), ["direct.csv", "checksum"]),
        (column("stiffness_n_per_m", "nan"), ["direct.csv", "line 3", "stiffness_n_per_m"]),
        (column("frequency_hz", "-5"), ["direct.csv", "line 3", "frequency_hz"]),
        (column("specimen", "III"), ["direct.csv", "line 3", "III"]),
        (column("configuration", "tension"), ["direct.csv", "line 3", "tension"]),
        (column("phase_deg", "0,1"), ["direct.csv", "line 3"]),
        (header(b"m/s^2", b"furl "), ["inverse_1.unv", "furl"]),
    ],
)
def test_a_bundle_that_does_not_fit_is_refused_and_nothing_is_stored(
    damage: Callable[[Path], None], words: list[str], jointlab: Command, contents: Contents, bundle: Path
) -> None:
    before = contents()
    damage(bundle)
    refused(jointlab("import", bundle), *words)
    assert contents() == before
    refused(jointlab("identify", bundle, "--json", "found.json"), *words)
    assert not Path("found.json").exists()


def test_the_bundle_that_is_damaged_here_is_accepted_whole(jointlab: Command, contents: Contents, bundle: Path) -> None:
    answer = jointlab("import", bundle)
    assert (answer.returncode, answer.stderr) == (0, "")
    assert answer.stdout == "run 1: 1 sets with 11 accelerances, 36 sine points, 0 blows\n"
    assert contents()["runs"] == 1


def test_unknown_keys_are_said_and_ignored(jointlab: Command, bundle: Path) -> None:
    setup_with(lambda setup: setup.update(weather="[fine]"))(bundle)
    answer = jointlab("import", bundle)
    assert answer.returncode == 0
    assert "weather" in answer.stdout


@pytest.mark.parametrize("command", ["identify", "report", "stiffness --amplitude 0.05 --frequency 50"])
def test_unknown_keys_of_a_bundle_that_is_not_imported_are_said(command: str, jointlab: Command, bundle: Path) -> None:
    setup_with(lambda setup: setup.update(weather="[fine]", inverse=[]))(bundle)
    name, *options = command.split()
    answer = jointlab(name, bundle, *options)
    assert answer.returncode == 0, answer.stderr
    assert "note: setup.json: unknown key weather is ignored" in answer.stderr


@pytest.mark.parametrize("name", ["nowhere", "notes.txt", "half.zip", "[red]nowhere[/red]"])
def test_what_is_no_bundle_is_named(name: str, jointlab: Command, contents: Contents, bundle: Path) -> None:
    Path("notes.txt").write_text("a few words", encoding="utf-8")
    with zipfile.ZipFile("whole.zip", "w") as archive:
        for file in bundle.iterdir():
            archive.write(file, file.name)
    Path("half.zip").write_bytes(Path("whole.zip").read_bytes()[:5000])
    before = contents()
    for command in ("import", "identify", "report"):
        refused(jointlab(command, name), name)
    assert contents() == before
    assert jointlab("import", "whole.zip").returncode == 0


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("absent.unv", None, ["absent.unv cannot be read", "No such file"]),
        ("words.unv", b"not a universal file\n", ["words.unv"]),
        ("empty.unv", b"", ["empty.unv"]),
        ("folder.unv", "folder", ["folder.unv", "directory"]),
    ],
)
def test_modes_of_a_file_that_is_no_uff_are_refused(
    name: str, content: bytes | str | None, words: list[str], jointlab: Command, tmp_path: Path
) -> None:
    if isinstance(content, bytes):
        (tmp_path / name).write_bytes(content)
    elif content:
        (tmp_path / name).mkdir()
    refused(jointlab("modes", tmp_path / name, "--json"), *words)


@pytest.mark.parametrize("command", ["identify 7", "report 7", "export 7 out", "export 7 out --format hdf5"])
def test_a_run_that_is_not_there_is_named(command: str, jointlab: Command, contents: Contents, tmp_path: Path) -> None:
    before = contents()
    refused(jointlab(*command.split()), "there is no run 7")
    assert contents() == before
    assert not (tmp_path / "out").exists()
    assert not (tmp_path / "report.html").exists()


def test_a_number_longer_than_any_run_s_is_taken_for_a_bundle(jointlab: Command) -> None:
    refused(jointlab("identify", "9" * 20), "there is no bundle 9999")
    answer = jointlab("export", "9" * 20, "out")
    assert answer.returncode == 2
    assert "999999999" in answer.stderr


def test_a_run_without_accepted_blows_has_nothing_to_identify(
    jointlab: Command, measured: int, tmp_path: Path, query: Callable[[str], list[tuple[Any, ...]]]
) -> None:
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue, catalogue.writing() as session:
        old = get_run(session, measured)
        run = start_run(
            session, kind="sequence", title="nobody struck", article="a", setup=old.setup, sequence=old.sequence
        )
        finish_run(session, run.id, RunState.FAILED, "nobody struck")
    analyses = query("SELECT count(*) FROM analyses")
    refused(jointlab("identify", run.id), "run 2 (failed) has neither accepted blows nor sine records")
    refused(jointlab("report", run.id), "nothing to identify")
    refused(jointlab("export", run.id, "out"), "run 2")
    assert query("SELECT count(*) FROM analyses") == analyses
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("taken", ["folder", "file.zip"])
def test_an_export_writes_over_nothing(jointlab: Command, measured: int, tmp_path: Path, taken: str) -> None:
    if taken == "folder":
        (tmp_path / taken).mkdir()
        (tmp_path / taken / "mine.txt").write_text("mine", encoding="utf-8")
    else:
        (tmp_path / taken).write_text("mine", encoding="utf-8")
    refused(jointlab("export", measured, taken), f"{taken} exists already")
    kept = tmp_path / taken
    assert (kept / "mine.txt" if kept.is_dir() else kept).read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize(
    "command",
    [
        ("identify", "bundle.zip", "--json", "bundle.zip"),
        ("report", "bundle.zip", "-o", "bundle.zip"),
        ("gap", "diagnose", "bundle.zip", "--json", "bundle.zip"),
        ("gap", "diagnose", "bundle.zip", "--report", "bundle.zip"),
    ],
)
def test_a_bundle_is_not_written_over_by_what_is_computed_from_it(
    jointlab: Command, tmp_path: Path, command: tuple[str, ...]
) -> None:
    (tmp_path / "bundle.zip").write_bytes(b"measured")
    refused(jointlab(*command), "bundle.zip is what this command reads; name another file to write")
    assert (tmp_path / "bundle.zip").read_bytes() == b"measured"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("y.h5",), ["y.h5 is called like a file", "bundle is written into a folder", "or give --format hdf5"]),
        (("y.csv",), ["y.csv is called like a file"]),
        (("y.csv", "--format", "parquet"), ["parquet is written into a folder, or a file that ends in .zip"]),
        (("y.h5", "--format", "hdf5", "--no-blows"), ["belong to --format bundle; leave them out with hdf5"]),
        (("y.mat", "--format", "mat", "--blows"), ["belong to --format bundle; leave them out with mat"]),
        (
            ("y.h5", "--format", "hdf5", "--leave-out-unfit-points"),
            ["--leave-out-unfit-points belongs to --format bundle; leave it out with hdf5"],
        ),
        (("no/y.h5", "--format", "hdf5"), ["no/y.h5 cannot be written: there is no folder no"]),
        (("no/y.jsonl", "--format", "bluesky"), ["no/y.jsonl cannot be written: there is no folder no"]),
        (("no/y.zip",), ["no/y.zip cannot be written: there is no folder no"]),
    ],
)
def test_an_export_that_would_be_another_than_was_asked_for_is_refused(
    jointlab: Command, measured: int, tmp_path: Path, options: tuple[str, ...], words: list[str]
) -> None:
    before = set(tmp_path.iterdir())
    refused(jointlab("export", measured, *options), *words)
    assert set(tmp_path.iterdir()) == before


def test_a_sine_point_that_a_bundle_cannot_hold_is_left_out_on_request_and_told(
    jointlab: Command, measured: int, measured_catalogue: Catalogue, tmp_path: Path
) -> None:
    without_temperature(measured_catalogue, measured)
    answer = jointlab("export", measured, "out", "--no-blows")
    refused(answer, "sine point 2 cannot", "with --leave-out-unfit-points")
    assert "leave_out_unfit_points" not in answer.stderr
    assert not (tmp_path / "out").exists()
    answer = jointlab("export", measured, "out", "--no-blows", "--leave-out-unfit-points")
    assert answer.returncode == 0
    written, told = answer.stdout.splitlines()
    assert written == "out written"
    assert re.fullmatch(
        r"warning: sine point 2 \(.*\) was left out at the export: direct.csv needs its temperature", told
    )
    assert told in jointlab("import", "out").stdout.splitlines()


def test_a_folder_of_an_export_may_have_a_date_as_its_ending(jointlab: Command, measured: int, tmp_path: Path) -> None:
    assert jointlab("export", measured, "run-2026.03", "--no-blows").returncode == 0
    assert (tmp_path / "run-2026.03" / "setup.json").is_file()


def test_a_report_that_cannot_be_written_is_said(jointlab: Command, bundle: Path) -> None:
    refused(jointlab("report", bundle, "-o", "no/where.html"), "no/where.html cannot be written", "No such file")


@pytest.mark.parametrize(
    ("url", "words"),
    [
        ("nonsense", ["'nonsense' is not the address of a database", "sqlite:///lab.db"]),
        ("mysql://lab/results", ["'mysql' is not supported"]),
        ("sqlite://", ["memory"]),
        ("sqlite:////no/such/folder/lab.db", ["/no/such/folder", "make it first"]),
        ("postgresql://technician:secret@127.0.0.1:1/lab", ["waveform_folder"]),
    ],
)
def test_a_database_that_cannot_be_is_named_without_its_password(
    jointlab: Command, monkeypatch: pytest.MonkeyPatch, url: str, words: list[str]
) -> None:
    monkeypatch.setenv("JOINTLAB_DATABASE_URL", url)
    answer = jointlab("identify", 1)
    refused(answer, *words)
    assert "secret" not in answer.stderr + answer.stdout


def test_a_database_that_is_no_database_is_refused(jointlab: Command, tmp_path: Path) -> None:
    (tmp_path / "jointlab.db").write_bytes(b"these are not the tables you are looking for" * 50)
    refused(jointlab("identify", 1), "jointlab.db", "not a database")


def test_an_identification_is_not_stored_where_a_record_is_damaged(
    jointlab: Command, measured: int, contents: Contents, tmp_path: Path
) -> None:
    (file,) = (tmp_path / "jointlab-waveforms").glob("*.waveforms")
    with closing(sqlite3.connect(file)) as connection:  # every record, as blows that were refused are not read
        connection.executescript(
            "DROP TRIGGER records_are_never_changed; UPDATE records SET samples = zeroblob(length(samples))"
        )
    before = contents()
    refused(jointlab("identify", measured), file.name)
    assert contents() == before


def test_a_failed_import_leaves_no_folder_behind(jointlab: Command, bundle: Path, tmp_path: Path) -> None:
    shutil.rmtree(bundle)
    refused(jointlab("import", bundle), "there is no bundle")
    assert sorted(path.name for path in tmp_path.iterdir()) == []


def test_where_the_document_cannot_be_written_nothing_is_identified_or_stored(
    jointlab: Command, measured: int, contents: Contents
) -> None:
    before = contents()
    answer = jointlab("identify", measured, "--json", "no/found.json")
    refused(answer, "no/found.json cannot be written: No such file or directory")
    assert contents() == before


NOT_UTF_8 = os.fsdecode(b"bad\xff")


@pytest.mark.parametrize(
    "arguments",
    [
        ("key", "create", NOT_UTF_8, "--scope", "read:data"), ("history", NOT_UTF_8, "I"), ("history", "a", NOT_UTF_8),
        ("runs", "--article", NOT_UTF_8), ("runs", "--specimen", NOT_UTF_8),
        ("master", NOT_UTF_8, "I", "--frequency", 100, "--temperature", 20),
        ("amend", 1, f'beam.name="{NOT_UTF_8}"', "--reason", "r"),
        ("amend", 1, "beam.density=7810", "--reason", NOT_UTF_8),
    ],
)  # fmt: skip
def test_text_that_is_not_utf_8_is_refused_and_nothing_is_stored(
    arguments: tuple[object, ...], jointlab: Command, contents: Contents, tmp_path: Path
) -> None:
    contents()
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue, catalogue.writing() as session:
        run = start_run(session, kind="import", title="t", article="a", setup=paper()["article"])
        finish_run(session, run.id, RunState.FINISHED)
    before = contents()
    refused(jointlab(*arguments))
    assert contents() | {"audit_entries": 0, "audit_head": 0} == before | {"audit_entries": 0, "audit_head": 0}


def test_a_file_name_that_is_not_utf_8_is_allowed(jointlab: Command, contents: Contents, bundle: Path) -> None:
    named = bundle.rename(bundle.with_name(NOT_UTF_8))
    assert jointlab("import", named).returncode == 0
    assert jointlab("export", 1, f"{named}2").returncode == 0
    assert contents()["runs"] == 1


@pytest.mark.parametrize("name", ["", 501 * "a", "two\nlines", " a", NOT_UTF_8])
def test_an_article_that_no_request_can_name_is_refused_and_nothing_is_stored(
    name: str, jointlab: Command, contents: Contents, bundle: Path
) -> None:
    before = contents()
    refused(jointlab("import", bundle, "--article", name), "--article: ")
    assert contents() == before
