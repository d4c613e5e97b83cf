"""`jointlab mqtt`: what it needs is named in one line."""

from pathlib import Path

import httpx
import pytest

from store.states import Scope
from tests.api.conftest import Command
from tests.api.service.conftest import MakeKey, acting, catalogue, make_key, rig, rig_client, rig_settings
from tests.ports import free_port

__all__ = ["acting", "catalogue", "make_key", "rig", "rig_client", "rig_settings"]


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ([], "name the broker: jointlab mqtt mqtt://host:1883, or `broker` in [publishing.mqtt]"),
        (["http://broker"], "give mqtt://host:port or mqtts://host:port"),
        (["mqtt://broker", "--user", "rig"], "a password is not sent without encryption; use mqtts://"),
        (["mqtt://broker", "--prefix", "a/#"], "prefix"),
        (["mqtt://broker", "--rig", "a/b"], "--rig: 'a/b' is no name of a rig"),
        (["mqtt://broker", "--service", "rig:8000"], "give an address such as http://127.0.0.1:8000"),
        (["mqtt://broker", "--service", "http://127.0.0.1:9"], "correct the address of the service with --service"),
    ],
)
def test_what_cannot_be_used_is_one_line_that_says_what_to_do(jointlab: Command, words: list[str], why: str) -> None:
    answer = jointlab("mqtt", *words)
    assert answer.returncode == 3
    (line,) = answer.stderr.splitlines()
    assert line.startswith("jointlab: ")
    assert why in line


def test_a_broker_that_is_not_there_is_one_line(jointlab: Command, rig_client: httpx.Client, tmp_path: Path) -> None:
    address = f"mqtt://127.0.0.1:{free_port()}"
    (tmp_path / "jointlab.toml").write_text(f'[publishing.mqtt]\nbroker = "{address}"\n', encoding="utf-8")
    answer = jointlab("mqtt", "--service", rig_client.base_url)
    assert (answer.returncode, len(answer.stderr.splitlines())) == (3, 1)
    assert f"no MQTT broker answers at {address}" in answer.stderr


def test_the_key_of_the_service_is_in_the_environment(
    jointlab: Command, rig_client: httpx.Client, make_key: MakeKey, monkeypatch: pytest.MonkeyPatch
) -> None:
    key = make_key(Scope.READ)
    words = ("mqtt", f"mqtt://127.0.0.1:{free_port()}", "--service", rig_client.base_url)
    assert "its key in JOINTLAB_SERVICE_KEY" in jointlab(*words).stderr
    monkeypatch.setenv("JOINTLAB_SERVICE_KEY", key)
    assert "no MQTT broker answers" in jointlab(*words).stderr
