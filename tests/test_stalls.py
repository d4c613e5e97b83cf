"""Tests that fail while the computer stands still are repeated, and no others."""

from pathlib import Path
from textwrap import dedent

import pytest

pytest_plugins = ("pytester",)

CONFTEST = """
import ctypes
import pytest
from tests.stalls import Repetition


def pytest_configure(config):
    config.pluginmanager.register(Repetition())


def stand_still():
    ctypes.PyDLL(None).usleep(200_000)  # no other thread runs meanwhile


@pytest.fixture(scope="module")
def attempts():
    return []

"""


def outcomes(pytester: pytest.Pytester, test: str, *arguments: str) -> pytest.RunResult:
    pytester.makeconftest(CONFTEST)
    pytester.makepyfile("from pathlib import Path\nimport pytest\nfrom conftest import stand_still\n" + dedent(test))
    return pytester.runpytest_subprocess("-p", "no:cacheprovider", *arguments)


@pytest.fixture(autouse=True)
def this_project(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tests in other processes find the plugin."""
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[1]))


@pytest.mark.parametrize("processes", [(), ("-n", "1")], ids=["one process", "xdist"])
def test_a_test_that_fails_during_a_stall_is_repeated_with_new_fixtures_and_named(
    pytester: pytest.Pytester, processes: tuple[str, ...]
) -> None:
    result = outcomes(
        pytester,
        """
        def test_first(attempts, tmp_path_factory):
            attempts.append(1)
            marker = Path("was here")
            if not marker.exists():
                marker.touch()
                stand_still()
                assert False, "too late"
            assert attempts == [1]

        def test_next(attempts):
            assert attempts == [1]
        """,
        *processes,
    )
    result.assert_outcomes(passed=2)
    result.stdout.fnmatch_lines(["REPEATED *::test_first: this process stood still for 0.* s while it failed*"])
    assert result.ret == 0


@pytest.mark.parametrize(("before", "attempts"), [("pass", 1), ("stand_still()", 4)])
def test_a_failure_counts_at_once_without_a_stall_and_with_stalls_when_it_comes_back(
    pytester: pytest.Pytester, before: str, attempts: int
) -> None:
    result = outcomes(
        pytester,
        f"""
        def test_it():
            with open("runs", "a") as runs:
                runs.write("x")
            {before}
            assert False
        """,
    )
    result.assert_outcomes(failed=1)
    assert (pytester.path / "runs").read_text() == attempts * "x"


def test_an_error_of_a_fixture_during_a_stall_is_repeated(pytester: pytest.Pytester) -> None:
    result = outcomes(
        pytester,
        """
        @pytest.fixture(scope="module")
        def instrument():
            marker = Path("was here")
            if not marker.exists():
                marker.touch()
                stand_still()
                raise TimeoutError
            yield
            if not Path("was left").exists():
                Path("was left").touch()
                stand_still()
                raise TimeoutError

        def test_it(instrument):
            pass
        """,
    )
    result.assert_outcomes(passed=1)
    assert (pytester.path / "was left").exists()
