"""Exports as jobs: every form is offered everywhere, and its file has the right end."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import get_args

import pytest

from api.page.markup import Link
from api.page.results.files import LABELS, _outcome
from jointlab.documents.jobs import NewExport
from jointlab.errors import JointlabError
from jointlab.jobs.kinds import SUFFIXES, exports_folder
from jointlab.jobs.tasks import export
from jointlab.report.printing import PROGRAMS
from store.catalogue import Catalogue
from store.exports.formats import FORMS
from store.progress import silent
from store.service.jobs import add_job
from tests.store.conftest import fill


def test_service_page_and_jobs_offer_every_form() -> None:
    asked = set(get_args(NewExport.model_fields["form"].annotation))
    assert asked == set(SUFFIXES) == set(LABELS) > set(FORMS)


def test_the_page_tells_how_many_points_a_bundle_lacks(catalogue: Catalogue) -> None:
    with catalogue.writing() as session:
        job = add_job(session, "export", {"run": 1, "form": "bundle"}, "test")
    done = replace(job, result={"file": "run-1.zip", "bytes": 7, "left_out": ["sine point 2", "sine point 5"]})
    shown = _outcome(done)
    assert isinstance(shown, Link)
    assert shown.text == "Open run-1.zip (2 sine points left out)"


def report_of(catalogue: Catalogue, form: str) -> Path:
    """The file that a job makes of the report of run 1."""
    with catalogue.writing() as session:
        job = add_job(session, "export", {"run": 1, "form": form}, "test")
    save = export(catalogue, job, silent)
    with catalogue.writing() as session:
        return exports_folder(catalogue) / str(save(session)["file"])


@pytest.mark.skipif(not any(map(shutil.which, PROGRAMS)), reason="no Chromium here")
def test_a_report_is_printed_as_pdf(catalogue: Catalogue) -> None:
    file = report_of(catalogue, "report-pdf")
    assert file.suffix == ".pdf"
    assert file.read_bytes().startswith(b"%PDF")


def test_without_chromium_a_report_as_pdf_says_what_to_install(
    catalogue: Catalogue, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(JointlabError, match=r"printing a PDF needs Chromium.*apt install chromium"):
        report_of(catalogue, "report-pdf")


@pytest.mark.parametrize("form", FORMS)
def test_a_job_writes_a_form_beside_the_waveforms(form: str, tmp_path: Path) -> None:
    with Catalogue.open(f"sqlite:///{tmp_path / 'lab.db'}") as catalogue:
        run, _ = fill(catalogue)
        with catalogue.writing() as session:
            job = add_job(session, "export", {"run": run, "form": form}, "test")
        save = export(catalogue, job, silent)
        with catalogue.writing() as session:
            result = save(session)
        file = exports_folder(catalogue) / result["file"]
        assert (file.suffix, file.stat().st_size) == (SUFFIXES[form], result["bytes"])
