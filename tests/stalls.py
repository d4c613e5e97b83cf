"""A test that fails while the computer stood still is repeated; the summary names it.

A simulated tester answers a stop in time as long as its threads run: where they do not for 0.3 s, tripping the
emergency stop is right, and a test that expects an ordinary stop has lost its premise. A failure without such a pause
counts at once, and so does one that comes back.
"""

import threading
import time
from typing import Final

import pytest
from _pytest.runner import runtestprotocol

TICK: Final = 0.01
"""Time in s between two looks at the clock."""
STALL: Final = 0.05
"""Time in s without a look that is a stall: what a reply may take while a stop waits (`rig.tester.modbus.HURRY`)."""
REPETITIONS: Final = 3
"""How often one test is repeated at most."""
REPEATED: Final = "repeated"
"""Outcome of a failed attempt that does not count."""


class StallMeter:
    """Measures how long the threads of this process stood still."""

    def __init__(self) -> None:
        self._longest = 0.0
        threading.Thread(target=self._look, name="stall meter", daemon=True).start()

    def longest(self) -> float:
        """The longest time in s without a look, beyond `TICK`, since this was asked last."""
        longest, self._longest = self._longest, 0.0
        return longest

    def _look(self) -> None:
        before = time.monotonic()
        while True:
            time.sleep(TICK)
            now = time.monotonic()
            self._longest = max(self._longest, now - before - TICK)
            before = now


class Repetition:
    """The plugin of pytest that repeats tests."""

    def __init__(self) -> None:
        self._meter = StallMeter()

    def pytest_runtest_protocol(self, item: pytest.Item, nextitem: pytest.Item | None) -> bool:
        """Run `item`, again with fresh fixtures of every scope where it failed during a stall; True: it was run."""
        item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
        for left in reversed(range(REPETITIONS + 1)):
            self._meter.longest()
            reports = runtestprotocol(item, nextitem=nextitem, log=False)
            failed = [report for report in reports if report.failed]
            stall = self._meter.longest()
            if not left or not failed or stall < STALL:
                break
            try:
                item.session._setupstate.teardown_exact(None)
            # a fixture may raise any exception; the test is then not repeated, and its failure counts
            except Exception as error:  # noqa: BLE001 - reported with the failed test
                failed[-1].sections.append(("its fixtures could not be torn down", repr(error)))
                break
            for report in failed:
                # pytest's type has its own three outcomes alone; a plugin may have more (`pytest_report_teststatus`)
                report.outcome = REPEATED  # type: ignore[assignment]
                report.sections.append((REPEATED, f"this process stood still for {stall:.2f} s"))
                item.ihook.pytest_runtest_logreport(report=report)
        for report in reports:
            item.ihook.pytest_runtest_logreport(report=report)
        item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
        return True

    def pytest_report_teststatus(self, report: pytest.TestReport) -> tuple[str, str, str] | None:
        """How an attempt that does not count is shown; None for every other."""
        return (REPEATED, "R", REPEATED.upper()) if str(report.outcome) == REPEATED else None

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter) -> None:
        """Name the tests that were repeated, and why."""
        for report in terminalreporter.stats.get(REPEATED, []):
            stall = next(text for name, text in report.sections if name == REPEATED)
            last = report.longreprtext.strip().splitlines()[-1]
            terminalreporter.write_line(f"REPEATED {report.nodeid}: {stall} while it failed ({last})")
