"""Addresses that only programs on the same computer reach."""

import pytest

from jointlab.loopback import is_loopback


@pytest.mark.parametrize(
    ("host", "expected"),
    [("127.0.0.1", True), ("127.1.2.3", True), ("::1", True), ("localhost", True), ("0.0.0.0", False), ("lab", False)],
)
def test_only_the_loopback_address_is_this_computer_alone(host: str, expected: bool) -> None:
    assert is_loopback(host) is expected
