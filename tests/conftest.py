"""Fixtures that every test folder may use."""

import os
import signal
from collections.abc import Iterator

import pytest
from hypothesis import settings

from tests.recordings import Recording, find_recording

# A shell that runs the tests in the background lets them ignore Ctrl-C, and every process they start inherits that.
signal.signal(signal.SIGINT, signal.default_int_handler)

# What decides whether a change lands draws the same examples every time; elsewhere new ones are searched.
settings.register_profile("same", derandomize=True)
if "CI" in os.environ:
    settings.load_profile("same")


@pytest.fixture(scope="session", autouse=True)
def state_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Drive processes of tests meet none of this computer."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield


@pytest.fixture(scope="session")
def recording() -> Recording:
    """Finds recorded data and examples; a test skips where those that it asks for are absent."""
    return find_recording
