"""What of an identification is chosen by hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import TypeAdapter

from analysis.modal.estimator import Estimator
from store.blow_window import NO_WINDOW, BlowWindow

MOST_ELEMENTS = 32
TIGHTEST, LOOSEST = 0.01, 10.0  # of regularisation
SHORTEST_FORCE, SHORTEST_CONSTANT, LONGEST_WINDOW = 1e-4, 0.01, 100.0  # s; modes are seen through an exponential one


@dataclass(frozen=True)
class Averaging:
    """How the raw blows of a run become accelerances; those of a bundle are as their own laboratory made them.

    Attributes:
        estimator: H1, H2 or Hv.
        window: on force and acceleration; what it adds to the damping is taken out of modes and joints.
    """

    estimator: Estimator = Estimator.H1
    window: BlowWindow = NO_WINDOW


@dataclass(frozen=True)
class Options:
    """Choices; by default everything is as the measurement itself has it.

    Attributes:
        without: corrections of the sine points to switch off, by the names in `tester_corrections.SWITCHES`.
        elements: of the beam between neighbouring nodes; 1 is the paper's mesh, None as many as the data call for.
        joint_exponent: standard deviation of the power of frequency that each joint follows; zero for constant joints.
        regularise: share of its size within which maximum likelihood holds every term about where it started; None for
            not at all.
        averaging: of the raw blows. It acts where the measurement is read, in `source`.
    """

    without: tuple[str, ...] = ()
    elements: int | None = None
    joint_exponent: float = 0.0
    regularise: float | None = None
    averaging: Averaging = Averaging()


AS_MEASURED = Options()
"""Nothing chosen."""
_OPTIONS = TypeAdapter(Options)


def options_of(kept: Mapping[str, Any]) -> Options:
    """The choices that were kept as a document, by `asdict`; what is not in it was not chosen."""
    return _OPTIONS.validate_python(kept)
