"""Logs: one JSON object or one line a record, with the request, job and run that it belongs to."""

import json
import logging
from collections.abc import Callable, Iterator
from contextlib import suppress
from io import StringIO
from pathlib import Path
from threading import Event, Thread

import pytest

from jointlab.logs import (
    WAITING,
    BackgroundHandler,
    LogFile,
    LogForm,
    LogSettings,
    belonging_to,
    everything_belongs_to,
    write_logs,
)
from tests.logs import restored_logging
from tests.waiting import LONG, until

log = logging.getLogger("rig.somewhere")
Written = Callable[[LogSettings], StringIO]


@pytest.fixture
def written() -> Iterator[Written]:
    """What is written from now on."""

    def begin(settings: LogSettings) -> StringIO:
        stream = StringIO()
        write_logs(settings, logging.StreamHandler(stream))
        return stream

    with restored_logging():
        yield begin


def test_a_json_record_has_its_ids_and_its_error(written: Written) -> None:
    stream = written(LogSettings(form=LogForm.JSON))
    with belonging_to(request="abc"), belonging_to(run=7):
        try:
            raise ValueError("two\nlines")
        except ValueError:
            log.exception("the run %s failed", 7)
    log.info("later")
    first, second = (json.loads(line) for line in stream.getvalue().splitlines())
    assert (first["level"], first["logger"], first["message"]) == ("error", "rig.somewhere", "the run 7 failed")
    assert (first["request"], first["run"]) == ("abc", 7)
    assert "ValueError: two\nlines" in first["error"]
    assert first["time"].endswith("+00:00")
    assert not {"request", "run", "error"} & set(second)


def test_a_text_record_is_a_line_with_its_ids(written: Written) -> None:
    stream = written(LogSettings())
    with belonging_to(job=3):
        log.warning("slow")
    assert stream.getvalue().rstrip().endswith("Z WARNING MainThread: slow [job=3]")


def test_only_what_the_level_asks_for_is_told_and_warnings_of_others(written: Written) -> None:
    stream = written(LogSettings(level="debug"))
    log.debug("ours")
    logging.getLogger("library").info("chatter")
    logging.getLogger("library").warning("trouble")
    assert [line.split(": ")[1] for line in stream.getvalue().splitlines()] == ["ours", "trouble"]
    stream = written(LogSettings(level="error"))
    log.warning("ours")
    assert stream.getvalue() == ""


def test_every_thread_tells_the_run_of_its_process(written: Written) -> None:
    stream = written(LogSettings(form=LogForm.JSON))
    with everything_belongs_to(run=5):
        thread = Thread(target=log.info, args=("beside",))
        thread.start()
        thread.join()
    log.info("after")
    beside, after = (json.loads(line) for line in stream.getvalue().splitlines())
    assert beside["run"] == 5
    assert "run" not in after


def test_a_disk_that_hangs_delays_nobody_who_logs_and_what_was_dropped_is_counted(written: Written) -> None:
    seen, may_go_on, began = list[str](), Event(), Event()

    class Hanging(logging.Handler):
        def emit(self, record: logging.LogRecord) -> None:
            began.set()
            assert may_go_on.wait(LONG)
            seen.append(self.format(record))

    write_logs(LogSettings(form=LogForm.JSON), BackgroundHandler(Hanging()))
    log.warning("first")
    assert began.wait(LONG)
    for number in range(WAITING + 5):  # more than may wait
        log.warning("record %s", number)
    assert seen == []
    may_go_on.set()
    until(lambda: len(seen) == 1 + WAITING)
    log.warning("last")
    until(lambda: len(seen) == 2 + WAITING)
    assert json.loads(seen[-1])["message"] == "last (5 records before this one were dropped)"
    write_logs(LogSettings())  # ends the thread


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_record_that_a_full_disk_refuses_is_one_line_of_standard_error(capsys: pytest.CaptureFixture[str]) -> None:
    file = LogFile("/dev/full", maxBytes=1000, backupCount=1)
    with restored_logging():
        write_logs(LogSettings(), BackgroundHandler(file))
        log.warning("the tester was stopped")
        write_logs(LogSettings())  # ends the thread
    with suppress(OSError):
        file.close()
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("20")
    assert "the tester was stopped" in line
    assert "(not in the log: [Errno 28] No space left on device)" in line
