"""The browser that prints a report ends with what asked for it, and nothing else ends."""

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from jointlab.errors import JointlabError
from jointlab.report.printing import printed
from tests.printers import ROOT, is_alive, others_browser, put_endless_printer
from tests.waiting import until

PRINT = "from jointlab.report.printing import printed\nprinted('<p>text</p>')"


@pytest.fixture
def started(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[], list[int]]:
    """The processes of the endless printer that a report is printed with."""
    started, environment = put_endless_printer(tmp_path)
    for name in ("PATH", "TMPDIR", "PYTHONPATH"):
        monkeypatch.setenv(name, environment[name])
    return started


@pytest.fixture
def another() -> Iterator[Callable[[], bool]]:
    """Whether a browser of somebody else still runs."""
    with others_browser() as runs:
        yield runs


def test_a_program_that_is_told_to_end_takes_its_browser_along(
    started: Callable[[], list[int]], another: Callable[[], bool]
) -> None:
    with subprocess.Popen([sys.executable, "-c", PRINT], cwd=ROOT) as program:
        until(lambda: len(started()) == 2)
        program.terminate()
    assert program.returncode == -signal.SIGTERM
    until(lambda: not any(map(is_alive, started())))
    assert not list(Path(os.environ["TMPDIR"]).iterdir())
    assert another()


@pytest.mark.skipif(os.name != "posix", reason="without groups of processes")
def test_a_program_that_is_killed_takes_its_browser_along(
    started: Callable[[], list[int]], another: Callable[[], bool]
) -> None:
    with subprocess.Popen([sys.executable, "-c", PRINT], cwd=ROOT) as program:
        until(lambda: len(started()) == 2)
        program.kill()
    assert program.returncode == -signal.SIGKILL
    until(lambda: not any(map(is_alive, started())))
    assert another()


def test_a_report_that_is_no_longer_wanted_is_not_printed_on(
    started: Callable[[], list[int]], another: Callable[[], bool]
) -> None:
    said = list[Exception]()

    def still_wanted() -> None:
        if len(started()) == 2:
            raise JointlabError("it was cancelled")

    def work() -> None:
        try:
            printed("<p>text</p>", still_wanted)
        except JointlabError as error:
            said.append(error)

    thread = threading.Thread(target=work)  # as a worker of a dask cluster works
    thread.start()
    thread.join()
    assert [str(each) for each in said] == ["it was cancelled"]
    until(lambda: not any(map(is_alive, started())))
    assert another()


def test_a_browser_that_does_not_print_is_ended_with_its_own(
    started: Callable[[], list[int]], monkeypatch: pytest.MonkeyPatch, another: Callable[[], bool]
) -> None:
    monkeypatch.setattr("jointlab.report.printing.LONGEST", 0.5)
    with pytest.raises(JointlabError, match=r"chromium has not printed the report within 0.5 s"):
        printed("<p>text</p>")
    until(lambda: not any(map(is_alive, started())))
    assert another()


def test_what_was_told_to_this_program_before_is_done_after_it(started: Callable[[], list[int]]) -> None:
    own = "import signal, sys\nsignal.signal(signal.SIGTERM, lambda *_: sys.exit(7))\n"
    with subprocess.Popen([sys.executable, "-c", own + PRINT], cwd=ROOT) as program:
        until(lambda: len(started()) == 2)
        os.kill(program.pid, signal.SIGTERM)
    assert program.returncode == 7
    until(lambda: not any(map(is_alive, started())))
