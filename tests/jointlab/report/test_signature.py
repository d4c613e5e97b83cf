"""Who signed a report, and what the signature covers; without one, a line to sign by hand."""

import hashlib
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from jointlab.identification.pipeline import Identification
from jointlab.report.identification import write_report, write_run_report
from jointlab.report.signature import Signature, note_signature
from store.catalogue import Catalogue
from store.service.audit import list_audit_entries
from store.version import software_version
from tests.api.page.diagnosis import add_example_diagnosis

SIGNATURE = Signature("Ann <Miller>", "key 3 (hall)", datetime(2026, 11, 29, 12, 34, tzinfo=UTC))


def summary(file: Path) -> str:
    """The first page of a report, with hyphens and spaces that break."""
    page = file.read_text(encoding="utf-8").replace("\u2011", "-").replace("\u00a0", " ")
    front, contents, _ = page.partition('<nav aria-label="Contents">')
    assert contents
    return front


def test_the_summary_says_who_signed_when_and_what(
    measured_catalogue: Catalogue, identified: Identification, tmp_path: Path
) -> None:
    number = add_example_diagnosis(measured_catalogue, run_id=1)
    found = replace(identified, measurement=replace(identified.measurement, setup_version=2))
    file = tmp_path / "report.html"
    standing = "It is that of analysis 7"
    write_run_report(measured_catalogue, 1, found, file, standing=standing, signature=SIGNATURE)
    front = summary(file)
    signed = "Ann &lt;Miller&gt;, at 2026-11-29 12:34 UTC; command given by key 3 (hall)"
    assert f"<td>signed by</td><td>{signed}</td>" in front
    assert (
        f"<td>covers</td><td>this whole report of run 1: its identification (it is that of analysis 7), version 2 of "
        f"the set-up, diagnosis {number}, computed by Jointlab {software_version()}; "
        "the audit log has the SHA-256 checksum of this file</td>"
    ) in front
    assert '<th scope="col">signature</th>' not in front


def test_a_signature_names_no_diagnosis_where_there_is_none(
    measured_catalogue: Catalogue, identified: Identification, tmp_path: Path
) -> None:
    write_run_report(measured_catalogue, 1, identified, tmp_path / "report.html", signature=SIGNATURE)
    front = summary(tmp_path / "report.html")
    assert "this whole report of run 1: its identification, version 1 of the set-up, no diagnosis, computed" in front


def test_a_report_that_nobody_signed_has_an_empty_line_for_name_date_and_signature(
    measured_catalogue: Catalogue, identified: Identification, tmp_path: Path
) -> None:
    write_run_report(measured_catalogue, 1, identified, tmp_path / "run.html")
    write_report(identified, tmp_path / "bundle.html")
    for name in ("run.html", "bundle.html"):
        front = summary(tmp_path / name)
        heads = "".join(f'<th scope="col">{head}</th>' for head in ("name", "date", "signature"))
        assert f"<thead><tr>{heads}</tr></thead><tbody>\n<tr><td></td><td></td><td></td></tr>" in front
        assert "signed by" not in front


def test_the_audit_log_has_the_signature_with_the_checksum_of_the_file(
    measured_catalogue: Catalogue, tmp_path: Path
) -> None:
    file = tmp_path / "report.pdf"
    file.write_bytes(b"%PDF of a report")
    with measured_catalogue.writing() as session:
        note_signature(session, 1, SIGNATURE, file)
    with measured_catalogue.reading() as session:
        (entry,) = list_audit_entries(session, action="sign report")
    assert (entry.who, entry.target, entry.outcome) == ("key 3 (hall)", "run 1", "done")
    checksum = hashlib.sha256(b"%PDF of a report").hexdigest()
    assert entry.details == {"signed_by": "Ann <Miller>", "checksum": checksum}
