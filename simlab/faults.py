"""Faults by name: a test switches them on, and the simulated instrument asks where they would show."""

from __future__ import annotations

import threading
from collections.abc import Iterable
from enum import StrEnum


class Faults:
    """Faults that are on now, each for a number of occasions or until it is cleared; any thread may ask."""

    def __init__(self, known: Iterable[StrEnum]) -> None:
        self._known = frozenset(known)
        self._on: dict[StrEnum, int | None] = {}
        self._lock = threading.Lock()

    def set(self, name: str, times: int | None = None) -> None:
        """Switch a fault on for the next `times` occasions, or until it is cleared.

        Raises:
            ValueError: this instrument has no such fault.
        """
        with self._lock:
            self._on[self._checked(name)] = times

    def clear(self, name: str | None = None) -> None:
        """Switch one fault off, or all.

        Raises:
            ValueError: this instrument has no such fault.
        """
        with self._lock:
            if name is None:
                self._on.clear()
            else:
                self._on.pop(self._checked(name), None)

    def take(self, fault: StrEnum) -> bool:
        """Whether `fault` shows on this occasion, which counts as one of its times."""
        with self._lock:
            if fault not in self._on:
                return False
            left = self._on[fault]
            if left is not None:
                if left <= 1:
                    del self._on[fault]
                else:
                    self._on[fault] = left - 1
            return True

    def _checked(self, name: str) -> StrEnum:
        for fault in self._known:
            if fault == name:
                return fault
        raise ValueError(f"no fault {name!r}; this instrument knows {', '.join(sorted(self._known))}")
