"""Reports as PDF, printed by Chromium."""

import re
import shutil
from pathlib import Path

import pytest

from jointlab.errors import JointlabError
from jointlab.report.page import write_page
from jointlab.report.printing import PROGRAMS
from jointlab.report.section import Section

SECTIONS = (Section("Annex", ("A paragraph.",)),)


@pytest.mark.skipif(not any(map(shutil.which, PROGRAMS)), reason="no Chromium here")
def test_a_first_page_is_a_page_of_its_own(tmp_path: Path) -> None:
    write_page("title", "lead", SECTIONS, tmp_path / "report.pdf", front=(Section("Summary", ("All is well.",)),))
    made = (tmp_path / "report.pdf").read_bytes()
    assert made.startswith(b"%PDF")
    assert len(re.findall(rb"/Type\s*/Page\b", made)) == 2


def test_without_chromium_a_pdf_is_refused_with_the_way_round(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(JointlabError, match=r"install Chromium \(apt install chromium.*write HTML and print it"):
        write_page("title", "lead", SECTIONS, tmp_path / "report.pdf")
    assert not list(tmp_path.iterdir())
