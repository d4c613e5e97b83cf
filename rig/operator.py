"""The operator: the person at the rig, or a program in their place, who strikes the beam and mounts specimens."""

from collections.abc import Callable, Sequence
from typing import Protocol

from analysis.dof import Dof
from store.states import BLANK

BEAM, SUSPENDED, SUPPORTED = "beam", "suspended", "supported"
"""The beam as a specimen to mount, and its two ways of mounting: in cords, and on its joints."""
SENSOR, CALIBRATOR, MASS = "accelerometer", "calibrator", "mass"
"""The accelerometer as what is mounted: on the beam, on a hand-held calibrator, or on a mass that hangs in cords."""
SENSOR_PLACES = {
    BEAM: "the accelerometer back on the beam",
    CALIBRATOR: "the accelerometer on the calibrator, and switch that on",
    MASS: "the accelerometer on the hanging mass, opposite to where the hammer strikes, its axis along the blow",
}


class Operator(Protocol):
    """Strikes and mounts: a technician who is prompted, or a simulated operator.

    Each method raises RigError where the operator cannot do it, and RunStoppedError where the run is to stop.
    """

    def go_to(self, point: Dof) -> None:  # noqa: ARG002 - overridden where the operator is waited for
        """Take the hammer to `point`; return when the trigger may be armed. By default at once."""
        return

    def strike(self, point: Dof, blow: int) -> None:
        """Strike `point` now: the trigger is armed and waits. `blow` counts from 1 and includes refused blows.

        May return before the blow has happened; the sequence waits for the trigger, not for this call.
        """

    def end_striking(self) -> None:
        """Put the hammer down: the last blow of a step was taken. By default nothing is done."""
        return

    def mount(self, specimen: str, configuration: str) -> None:
        """Put the cylinders of joint `specimen` ("I", "II") into the tester; return when they are mounted.

        `configuration` is "compression" (one cylinder), "shear" or "angled" (a pair); "blank" asks for the known piece
        `specimen` in their place. The specimen "beam" is hung in cords ("suspended") or put on its joints
        ("supported"); a run without a suspended beam does not ask for it. Checks ask for the "accelerometer" on a
        "calibrator", on a suspended "mass", and back on the "beam".
        """

    def run_points(self, preset: float, points: Sequence[tuple[float, float]]) -> None:  # noqa: ARG002 - as above
        """Let the machine's own software run `points`, in any order; return at once. By default nothing is done.

        Each has its peak-to-peak amplitude in m about the mean displacement `preset`, m, and its frequency in Hz. No
        points: nothing is left to run.
        """
        return

    def offer(self, text: str) -> Callable[[], bool]:  # noqa: ARG002 - as above
        """Offer `text` without waiting; returns a function that says whether it was accepted. By default: never."""
        return lambda: False

    def do_task(self, text: str) -> None:  # noqa: ARG002 - overridden where the operator is waited for
        """Do the task `text`; return when it is done. By default at once."""
        return


def loading_text(configuration: str) -> str:
    """How cylinders are loaded in a configuration of the tester, after the name of a joint."""
    return "in the angled configuration" if configuration == "angled" else f"in {configuration}"


def mounting_text(specimen: str, configuration: str) -> str:
    """The thing to mount, in words for the operator."""
    if specimen == BEAM:
        where = "in its cords, free of the joints" if configuration == SUSPENDED else "on its joints"
        return f"the beam {where}"
    if specimen == SENSOR:
        return SENSOR_PLACES[configuration]
    if configuration == BLANK:
        return f"the known piece {specimen!r} in place of a specimen"
    return f"the cylinders of joint {specimen} {loading_text(configuration)}"


def points_text(preset: float, points: Sequence[tuple[float, float]]) -> str:
    """The points that the machine's own software is to run, in words."""
    by_amplitude = dict[float, list[str]]()
    for amplitude_pp, frequency in points:
        by_amplitude.setdefault(amplitude_pp, []).append(f"{frequency:.6g}")
    series = "; ".join(f"{1e3 * pp:g} mm peak to peak at {', '.join(each)} Hz" for pp, each in by_amplitude.items())
    return f"about a mean of {1e3 * preset:g} mm, {series}"
