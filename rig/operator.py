"""The person at the rig, and what a sequence tells whoever watches it.

A sequence asks an `Operator` to strike or to mount a specimen, and reports every step to an `Observer` as an
`Event`. The command line shows events as progress, a page shows them live, a test collects them.
"""

from __future__ import annotations

from typing import Protocol

from analysis.dof import Dof
from store.sine_records import BLANK


class Operator(Protocol):
    """Whoever strikes the beam and mounts specimens: a technician who is prompted, or a simulated hand."""

    def go_to(self, point: Dof) -> None:  # noqa: ARG002 - whoever waits for somebody overrides it
        """Take the hammer to `point`; return when the trigger may be armed. At once, unless somebody is waited for."""
        return

    def strike(self, point: Dof, blow: int) -> None:
        """Strike `point` now: the trigger is armed and waits. `blow` counts from 1 and includes refused blows.

        May return before the blow has happened; the sequence waits for the trigger, not for this call.
        """

    def mount(self, specimen: str, configuration: str) -> None:
        """Put the cylinders of joint `specimen` ("I", "II") into the tester; return when they are mounted.

        `configuration` is "compression" (one cylinder), "shear" or "angled" (a pair); "blank" asks for the known piece
        `specimen` in their place. The specimen "beam" is hung in cords ("suspended") or put on its joints
        ("supported"); nobody is asked where a run has no suspended beam.
        """

    def see_to(self, text: str) -> None:  # noqa: ARG002 - whoever waits for somebody overrides it
        """Do what `text` asks for; return when it is done. At once, unless somebody is waited for."""
        return


BEAM, SUSPENDED, SUPPORTED = "beam", "suspended", "supported"
"""How the beam is mounted."""


def mounting_text(specimen: str, configuration: str) -> str:
    """What an operator is asked to mount, in words."""
    if specimen == BEAM:
        where = "in its cords, free of the joints" if configuration == SUSPENDED else "on its joints"
        return f"the beam {where}"
    if configuration == BLANK:
        return f"the known piece {specimen!r} in place of a specimen"
    return f"the cylinders of joint {specimen} in {configuration}"
