"""Pages as PDF, printed by a Chromium that ends with the work that started it."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from jointlab.errors import JointlabError

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
INSTALL = "apt install chromium, or dnf install chromium"
LONGEST = 120.0  # s; a report with all its pictures takes a few
LOOK = 0.1  # s between two looks whether the page is still wanted
BOUND = (sys.executable, "-I", "-S", str(Path(__file__).with_name("bound_program.py")))
"""Before a command: the program ends with this process, on POSIX."""


def wanted() -> None:
    """Default of `still_wanted`: it never raises an error, so that printing is not ended."""


def printed(html: str, still_wanted: Callable[[], object] = wanted) -> bytes:
    """A page as PDF.

    The browser ends with this process, however that ends (on POSIX SIGKILL, too). Where it is asked to end (SIGTERM,
    in its main thread), the files are tidied up, too.

    Args:
        still_wanted: called again and again while the browser prints; where it raises an error, the browser is ended,
            and the error is passed on.

    Raises:
        JointlabError: there is no Chromium here, or it does not print.
    """
    program = next((found for name in PROGRAMS if (found := shutil.which(name))), None)
    if program is None:
        raise JointlabError(
            f"printing a PDF needs Chromium, and none of {', '.join(PROGRAMS)} is on the path of this computer; "
            f"install Chromium ({INSTALL}) or Google Chrome, or write HTML and print it from a browser"
        )
    with _end_put_off() as told, tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        page, made, said = Path(folder, "report.html"), Path(folder, "report.pdf"), Path(folder, "said.txt")
        page.write_text(html, encoding="utf-8")
        command = [
            program, "--headless", "--disable-gpu", "--no-pdf-header-footer", "--generate-pdf-document-outline",
            f"--user-data-dir={folder}/profile", f"--print-to-pdf={made}", page.as_uri(),
        ]  # fmt: skip
        if os.name == "posix" and os.geteuid() == 0:
            command.insert(1, "--no-sandbox")  # as root it starts in no other way; the page has no scripts

        def look() -> None:
            still_wanted()
            if told():
                raise JointlabError("the report is not printed: this program was asked to end")

        code = _carried_out(command, said, look)
        if code or not made.is_file():
            lines = said.read_text(errors="replace").strip().splitlines()
            raise JointlabError(f"{program} does not print the report: {lines[-1] if lines else code}")
        return made.read_bytes()


def _carried_out(command: list[str], said: Path, look: Callable[[], None]) -> int:
    """Wait for a program whose output goes into a file; an error of `look`, or `LONGEST`, ends it."""
    end = time.monotonic() + LONGEST
    with said.open("wb") as output:
        # a group of its own: the launchers of some distributions start Chromium as a process of theirs
        bound = [*BOUND, *command] if os.name == "posix" else command
        browser = subprocess.Popen(bound, stdin=subprocess.PIPE, stdout=output, stderr=output, start_new_session=True)
        try:
            while True:
                look()
                try:
                    return browser.wait(LOOK)
                except subprocess.TimeoutExpired:
                    if time.monotonic() > end:
                        raise JointlabError(f"{command[0]} has not printed the report within {LONGEST:g} s") from None
        finally:
            _end(browser)


def _end(browser: subprocess.Popen[bytes]) -> None:
    """End a browser that still runs, with the processes that it started; it has nothing to save."""
    with browser:  # which closes the pipe to it, and waits
        if browser.poll() is not None:
            return
        if os.name == "posix":
            os.killpg(browser.pid, signal.SIGKILL)  # not waited for yet, so that the number is still its own
        else:
            browser.kill()


@contextmanager
def _end_put_off() -> Iterator[Callable[[], bool]]:
    """Whether this process was asked to end, which takes effect after the block, when what it leaves is tidied up.

    Only the main thread can learn this; other threads end with the process, or are told otherwise.
    """
    if threading.current_thread() is not threading.main_thread():
        yield lambda: False
        return
    told = threading.Event()
    before = signal.signal(signal.SIGTERM, lambda *_: told.set())
    try:
        yield told.is_set
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL if before is None else before)
        if told.is_set():
            signal.raise_signal(signal.SIGTERM)
