"""Addresses that only programs on the same computer reach."""

import ipaddress


def is_loopback(host: str) -> bool:
    """Whether only this computer reaches `host`, a name or an address."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
