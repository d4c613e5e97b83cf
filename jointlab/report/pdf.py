"""HTML printed to PDF by a Chromium of this computer, which also numbers the pages."""

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from jointlab.errors import JointlabError

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
LONGEST = 120.0  # s; a report with all its pictures takes a few


def printed(html: str) -> bytes:
    """A page as PDF.

    Raises:
        JointlabError: there is no Chromium here, or it does not print.
    """
    program = next((found for name in PROGRAMS if (found := shutil.which(name))), None)
    if program is None:
        raise JointlabError(
            f"printing a PDF needs Chromium, and none of {', '.join(PROGRAMS)} is installed; install one, or write "
            "HTML and print it from a browser"
        )
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        page, made = Path(folder, "report.html"), Path(folder, "report.pdf")
        page.write_text(html, encoding="utf-8")
        command = [
            program, "--headless", "--disable-gpu", "--no-pdf-header-footer", "--generate-pdf-document-outline",
            f"--user-data-dir={folder}/profile", f"--print-to-pdf={made}", page.as_uri(),
        ]  # fmt: skip
        if os.name == "posix" and os.geteuid() == 0:
            command.insert(1, "--no-sandbox")  # as root it starts in no other way; the page has no scripts
        try:
            ended = subprocess.run(command, capture_output=True, timeout=LONGEST, check=False)
        except subprocess.TimeoutExpired as error:
            raise JointlabError(f"{program} has not printed the report within {LONGEST:g} s") from error
        if ended.returncode or not made.is_file():
            said = ended.stderr.decode(errors="replace").strip().splitlines()
            raise JointlabError(f"{program} does not print the report: {said[-1] if said else ended.returncode}")
        return made.read_bytes()
