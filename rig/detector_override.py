"""Detectors of the tester in force for as long as a sweep lasts, and put back afterwards."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager

from rig.detectors import TighterDetector, check_tighter
from rig.errors import RigError
from rig.registers import Interlock
from rig.tester import Tester
from rig.tester_status import Detector


@contextmanager
def tightened(tester: Tester, wanted: Mapping[Interlock, TighterDetector]) -> Iterator[None]:
    """Put `wanted` in force, each read back, and when the context is left what was in force before.

    To be left with the actuator at rest, as nothing may move under a detector that is being loosened. Detectors that
    cannot be put back stay tight.

    Raises:
        DetectorError: one is looser than what is in force; nothing was sent.
        RigError: the tester refused or does not answer; an error inside is what comes out.
    """
    if not wanted:
        yield
        return
    before = tester.detectors()
    check_tighter(wanted, before)
    try:
        for interlock, tighter in wanted.items():
            _put(tester, interlock, tighter.beside(before[interlock]))
        yield
    except BaseException as error:
        try:
            _put_back(tester, wanted, before)
        except RigError as failure:
            error.add_note(str(failure))
        raise
    _put_back(tester, wanted, before)


def _put_back(tester: Tester, wanted: Iterable[Interlock], before: Mapping[Interlock, Detector]) -> None:
    try:
        for interlock in wanted:
            _put(tester, interlock, before[interlock])
    except RigError as error:
        raise RigError(
            f"the tester's detectors stay as tight as the step had them ({error}); set them at the instrument"
        ) from error


def _put(tester: Tester, interlock: Interlock, detector: Detector) -> None:
    tester.set_detector(interlock, detector.limit, detector.action)
