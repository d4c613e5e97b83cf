"""Faults: a test sets them, and the simulated instrument shows them."""

import threading
from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from typing import Generic, TypeVar

_Answer = TypeVar("_Answer")


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


@dataclass
class _Scripted(Generic[_Answer]):
    answer: _Answer
    after: int
    times: float


class Script(Generic[_Answer]):
    """Answers that steps of a conversation get in place of the instrument's own; any thread may ask."""

    def __init__(self) -> None:
        self._scripted: dict[str, _Scripted[_Answer]] = {}
        self._lock = threading.Lock()

    def set(self, step: str, answer: _Answer, times: int | None = None, after: int = 0) -> None:
        """Give `answer` to the next `times` occasions of `step` (None: to all), once `after` of them have passed."""
        with self._lock:
            self._scripted[step] = _Scripted(answer, after, float("inf") if times is None else times)

    def clear(self) -> None:
        """Forget every scripted answer."""
        with self._lock:
            self._scripted.clear()

    def take(self, step: str) -> _Answer | None:
        """The answer scripted for this occasion of `step`; None where there is none."""
        with self._lock:
            scripted = self._scripted.get(step)
            if scripted is None:
                return None
            if scripted.after > 0:
                scripted.after -= 1
                return None
            scripted.times -= 1
            if scripted.times <= 0:
                del self._scripted[step]
            return scripted.answer
