"""`jointlab opcua`: what it needs is named in one line."""

import socket

import httpx
import pytest

from tests.api.conftest import Command
from tests.api.service.conftest import acting, catalogue, make_key, rig, rig_client, rig_settings

__all__ = ["acting", "catalogue", "make_key", "rig", "rig_client", "rig_settings"]


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (["http://127.0.0.1:4840"], "give opc.tcp://host:port"),
        (["opc.tcp://127.0.0.1"], "give opc.tcp://host:port"),
        (["--service", "http://127.0.0.1:9"], "correct the address of the service with --service"),
    ],
)
def test_what_cannot_be_used_is_one_line_that_says_what_to_do(jointlab: Command, words: list[str], why: str) -> None:
    answer = jointlab("opcua", *words)
    assert answer.returncode == 3
    (line,) = answer.stderr.splitlines()
    assert line.startswith("jointlab: ")
    assert why in line


def test_an_address_in_use_is_one_line(jointlab: Command, rig_client: httpx.Client) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"opc.tcp://127.0.0.1:{taken.getsockname()[1]}"
        answer = jointlab("opcua", address, "--service", rig_client.base_url)
    assert (answer.returncode, len(answer.stderr.splitlines())) == (3, 1)
    assert answer.stderr.startswith(f"jointlab: {address} cannot be used: Address already in use")
    assert "name another address" in answer.stderr
