"""Numbers by which requests name a prompt, a pause, a lease or a STOP."""

import secrets

LARGEST_FIRST = 2**52
"""Counting on from here stays below 2**53: JSON readers keep each number exactly."""


def first_number() -> int:
    """A random number to count on from, so that a restarted process repeats no number of the one before."""
    return secrets.randbelow(LARGEST_FIRST)
