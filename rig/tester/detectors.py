"""Limit detectors of the tester that a step tightens: as a document, in SI units, checked, and in force for a sweep."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import Field

from daq.errors import afterwards
from rig.document import Document
from rig.errors import RigError
from rig.registers import DETECTED, Action, Interlock, float32, name_of
from rig.tester.status import Detector
from store.quantity import quantity

if TYPE_CHECKING:
    from rig.tester.driver import Tester  # for types alone: a client reads sequences without the tester's driver

TIGHTER_IS_HIGHER = Interlock.LOWER_DISPLACEMENT | Interlock.UNDERPEAK
"""Detectors that are tighter with a higher limit; the others are tighter with a lower one."""

ActionName = Literal["indicate", "hold", "stop", "program_interlock", "hydraulic_interlock"]


class DetectorError(RigError):
    """A step asks for a looser detector than is in force at the tester; nothing was sent."""


@dataclass(frozen=True)
class TighterDetector:
    """A limit in the unit of its quantity, and the action beyond it; None: the action stays as it is."""

    limit: float
    action: Action | None = None

    def replacing(self, in_force: Detector) -> Detector:
        """The detector that replaces `in_force`."""
        return Detector(self.limit, in_force.action if self.action is None else self.action)


class _DetectorDocument(Document):
    action: ActionName | None = Field(
        default=None,
        description="what it does beyond its limit, as hard as at the instrument or harder; as there if not given",
    )


class PositionDetector(_DetectorDocument):
    """Fires where the actuator goes beyond a position."""

    limit_mm: Annotated[float, quantity("mm", ge=-10.0, le=10.0)]


class OvershootDetector(_DetectorDocument):
    """Fires where the peak-to-peak amplitude exceeds what was commanded."""

    limit_mm: Annotated[float, quantity("mm", "peak to peak, beyond the command", ge=0.001, le=10.0)]


class ForceDetector(_DetectorDocument):
    """Fires where the absolute force is larger."""

    limit: Annotated[float, quantity("N", ge=1.0, le=25e3)]


class UnderpeakDetector(_DetectorDocument):
    """Fires where the settled amplitude is smaller."""

    limit: Annotated[float, quantity("1", "as a fraction of the command", gt=0.0, le=1.0)]


class StepDetectors(Document):
    """Detectors that are tighter while a step lasts than at the instrument; those not named stay as they are."""

    upper_displacement: PositionDetector | None = None
    lower_displacement: PositionDetector | None = None
    force: ForceDetector | None = None
    error: OvershootDetector | None = None
    underpeak: UnderpeakDetector | None = None

    def check_room(self, lowest_mm: float, highest_mm: float) -> None:
        """Check that displacement detectors leave room for a cycle between these positions, and for the way there.

        Raises ValueError where one would fire in a normal cycle.
        """
        if self.upper_displacement and self.upper_displacement.limit_mm <= highest_mm:
            raise ValueError(
                f"detectors.upper_displacement at {self.upper_displacement.limit_mm:g} mm would fire in every cycle, "
                f"which goes up to {highest_mm:g} mm"
            )
        lowest_mm = min(lowest_mm, 0.0)  # where the actuator starts
        if self.lower_displacement and self.lower_displacement.limit_mm >= lowest_mm:
            raise ValueError(
                f"detectors.lower_displacement at {self.lower_displacement.limit_mm:g} mm would fire as the actuator "
                f"comes from or goes down to {lowest_mm:g} mm"
            )

    def in_si(self) -> dict[Interlock, TighterDetector]:
        """The detectors that are given, with limits in m, N or as a fraction."""
        wanted = dict[Interlock, TighterDetector]()
        for interlock in DETECTED:
            document: PositionDetector | OvershootDetector | ForceDetector | UnderpeakDetector | None
            document = getattr(self, name_of(interlock))
            if document is None:
                continue
            if isinstance(document, PositionDetector | OvershootDetector):
                limit = 1e-3 * document.limit_mm
            else:
                limit = document.limit
            action = None if document.action is None else Action[document.action.upper()]
            wanted[interlock] = TighterDetector(limit, action)
        return wanted


def check_tighter(wanted: Mapping[Interlock, TighterDetector], in_force: Mapping[Interlock, Detector]) -> None:
    """Check that detectors are as tight as those in force at the tester, or tighter.

    Raises DetectorError where a limit lies farther out, or an action is milder, or those in force are not known.
    """
    for interlock, tighter in wanted.items():
        if interlock not in in_force:
            raise DetectorError(
                f"detector {name_of(interlock)}: the tester's map does not have it, and no step tightens it; nothing "
                "was sent. Set it at the instrument, and leave it out of the sequence"
            )
        found = in_force[interlock]
        limit = float32(tighter.limit)  # as the instrument holds it
        if limit < found.limit if interlock & TIGHTER_IS_HIGHER else limit > found.limit:
            raise _looser(interlock, f"{tighter.limit:g}", f"{found.limit:g}")
        if tighter.action is not None and tighter.action < found.action:
            raise _looser(interlock, tighter.action.name.lower(), found.action.name.lower())


def _looser(interlock: Interlock, wanted: str, in_force: str) -> DetectorError:
    return DetectorError(
        f"detector {name_of(interlock)}: {wanted} is asked for, looser than {in_force}, which is in force at the "
        "tester; nothing was sent. A sequence may tighten detectors; set them looser at the instrument"
    )


@contextmanager
def tightened_detectors(tester: Tester, wanted: Mapping[Interlock, TighterDetector]) -> Iterator[None]:
    """Put `wanted` in force, each read back, and restore the former detectors when the context is left.

    The actuator has to be at rest on leaving: nothing may move while a detector is loosened. Where rest was not
    confirmed, and where detectors cannot be restored, they stay tight.

    Raises:
        DetectorError: one is looser than that in force; nothing was sent.
        RigError: the tester refused or does not answer; an error raised inside the context has precedence.
    """
    if not wanted:
        yield
        return
    before = tester.detectors()
    check_tighter(wanted, before)
    restored = {interlock: before[interlock] for interlock in wanted}
    with afterwards(lambda: _restore(tester, restored), RigError):
        for interlock, tighter in wanted.items():
            detector = tighter.replacing(before[interlock])
            tester.set_detector(interlock, detector.limit, detector.action)
        yield


def _restore(tester: Tester, before: Mapping[Interlock, Detector]) -> None:
    try:
        tester.check_rest()
        for interlock, detector in before.items():
            tester.set_detector(interlock, detector.limit, detector.action)
    except RigError as error:
        raise RigError(
            f"the tester's detectors stay as tight as the step had them ({error}); set them at the instrument"
        ) from error
