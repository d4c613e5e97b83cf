"""What of an identification is chosen by hand."""

from __future__ import annotations

from dataclasses import dataclass

MOST_ELEMENTS = 32


@dataclass(frozen=True)
class Options:
    """Choices; by default everything is as the measurement itself has it.

    Attributes:
        without: corrections of the sine points to switch off, by the names in `tester_corrections.SWITCHES`.
        elements: of the beam between neighbouring nodes; 1 is the paper's mesh, None as many as the data call for.
        joint_exponent: standard deviation of the power of frequency that each joint follows; zero for constant joints.
    """

    without: tuple[str, ...] = ()
    elements: int | None = None
    joint_exponent: float = 0.0


AS_MEASURED = Options()
"""Nothing chosen."""
