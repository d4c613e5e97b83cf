"""`jointlab report --signed-by`: a name on the report, and in the audit log with the checksum of the file."""

import hashlib
import json
import os
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from store.provenance import who_is_here
from tests.api.conftest import Command, Query

QUICK = ("--elements", 2, "--joint-law", "constant")


def test_a_report_is_signed_by_name_and_the_signature_is_in_the_audit_log(
    jointlab: Command, measured: int, query: Query, tmp_path: Path
) -> None:
    answer = jointlab("report", measured, "-o", "signed.html", "--signed-by", "Ann Miller", *QUICK)
    assert answer.returncode == 0, answer.stderr
    assert answer.stdout == "signed.html written\nsigned by Ann Miller\n"
    written = (tmp_path / "signed.html").read_bytes()
    ((who, target, outcome, details),) = query(
        "SELECT who, target, outcome, details FROM audit_entries WHERE action = 'sign report'"
    )
    assert (who.split(",")[0], target, outcome) == (who_is_here().split(",")[0], "run 1", "done")
    assert json.loads(details) == {"signed_by": "Ann Miller", "checksum": hashlib.sha256(written).hexdigest()}
    page = written.decode()
    assert "<td>signed by</td><td>Ann Miller, at " in page
    assert who.split(",")[0] in page
    ((analysis,),) = query(
        "SELECT max(id) FROM analyses WHERE kind = 'joint_matrices' AND method = 'maximum likelihood on accelerances'"
    )
    assert f"(it is that of analysis {analysis})" in page


def test_where_the_signature_cannot_be_noted_there_is_no_signed_report(
    jointlab: Command, measured: int, tmp_path: Path
) -> None:
    with closing(sqlite3.connect(tmp_path / "jointlab.db")) as connection:
        connection.execute("CREATE TRIGGER full BEFORE INSERT ON audit_entries BEGIN SELECT RAISE(ABORT, 'full'); END")
    answer = jointlab("report", measured, "-o", "signed.html", "--signed-by", "Ann Miller", *QUICK)
    assert answer.returncode != 0
    assert "full" in answer.stderr
    assert not (tmp_path / "signed.html").exists()


@pytest.mark.parametrize("name", ["", " Ann", "Ann\nMiller", "x" * 501])
def test_what_is_no_name_is_refused_before_anything_is_done(
    jointlab: Command, measured: int, query: Query, tmp_path: Path, name: str
) -> None:
    before = query("SELECT count(*) FROM analyses")
    answer = jointlab("report", measured, "-o", "signed.html", "--signed-by", name)
    assert answer.returncode == 3
    assert "--signed-by: " in answer.stderr
    assert "characters in one line" in " ".join(answer.stderr.split())
    assert not (tmp_path / "signed.html").exists()
    assert query("SELECT count(*) FROM analyses") == before


def test_what_is_no_file_is_not_signed(jointlab: Command, measured: int, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.html")  # its checksum could not be read again
    answer = jointlab("report", measured, "-o", "pipe.html", "--signed-by", "Ann Miller")
    assert answer.returncode == 3
    assert "pipe.html is no file" in answer.stderr


def test_a_bundle_is_not_signed(jointlab: Command, bundle: Path, tmp_path: Path) -> None:
    answer = jointlab("report", bundle, "-o", "signed.html", "--signed-by", "Ann Miller")
    assert answer.returncode == 3
    assert "jointlab import" in answer.stderr
    assert not (tmp_path / "signed.html").exists()
