"""Nothing is known of the rest of a machine that is not driven from here, and no text says that it rests."""

import json
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from api.cli import COMMANDS
from api.page.login import stop_button
from api.page.views.dashboard import interlocks_text
from api.service.context import Services
from jointlab.drive.state import RigState
from jointlab.settings import Settings
from rig.instruments import EXTERNAL

SNAPSHOT = Path(__file__).parent / "service" / "openapi.json"


def texts(value: Any) -> Iterator[str]:
    """Every text in a document."""
    match value:
        case dict():
            for each in value.values():
                yield from texts(each)
        case list():
            for each in value:
                yield from texts(each)
        case str():
            yield value


def helps() -> Iterator[str]:
    yield from (what for _, what in COMMANDS.values())
    for name, (module, _) in COMMANDS.items():
        if module in ("drive", "sequences"):
            yield getattr(import_module(f"api.commands.{module}"), name).__doc__


def test_whatever_help_says_of_an_actuator_at_rest_is_of_one_that_is_driven() -> None:
    told = [*texts(json.loads(SNAPSHOT.read_text("utf-8"))), *texts(Settings.model_json_schema()), *helps()]
    sentences = [each for text in told for each in re.split(r"(?<=[.;])\s", " ".join(text.split()))]
    of_rest = [each for each in sentences if "actuator" in each and re.search(r"\bat rest|to rest\b", each)]
    assert len(of_rest) > 5
    assert [each for each in of_rest if "driv" not in each] == []


@pytest.mark.parametrize("tester_url", [None, EXTERNAL])
def test_stop_of_the_page_claims_no_rest_of_what_it_does_not_drive(tester_url: str | None) -> None:
    services = SimpleNamespace(runs=SimpleNamespace(drive=SimpleNamespace(tester_url=tester_url, stop_port=1)))
    button = stop_button(cast(Services, services))
    assert "bring the actuator to rest" not in button
    assert ("Press its own stop." in button) is (tester_url == EXTERNAL)


def test_the_page_knows_of_no_interlock_of_a_machine_that_is_not_driven() -> None:
    assert "No interlock has stopped the actuator" in interlocks_text(RigState())
    for not_driven in (RigState(is_driven=False), None):
        assert "Nothing is known of a machine" in interlocks_text(not_driven)
        assert "No interlock has stopped the actuator" not in interlocks_text(not_driven)
