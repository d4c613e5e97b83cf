"""What of an identification is chosen by hand, as the options that `identify` and `report` have in common."""

from __future__ import annotations

from typing import Annotated

import typer

from analysis.modal.estimator import Estimator
from api.commands.terminal import LARGEST_RUN
from jointlab.identification.options import (
    LONGEST_WINDOW,
    LOOSEST,
    MOST_ELEMENTS,
    SHORTEST_CONSTANT,
    SHORTEST_FORCE,
    TIGHTEST,
    Averaging,
    Options,
)
from jointlab.identification.tester_corrections import SWITCHES
from store.blow_window import BlowWindow

Without = Annotated[
    list[str] | None,
    typer.Option(help=f"Leave a correction of the sine points off; may be repeated: {', '.join(SWITCHES)}."),
]
FreeBeam = Annotated[
    int | None,
    typer.Option(
        metavar="RUN",
        min=1,
        max=LARGEST_RUN,
        help="A run on the suspended beam, whose damping, modulus and density the beam then has, with their errors.",
    ),
]
Elements = Annotated[
    int | None,
    typer.Option(
        min=1,
        max=MOST_ELEMENTS,
        help="Of the beam between neighbouring nodes, 8 by default; 1 is the paper's mesh.",
    ),
]
JointExponent = Annotated[
    float,
    typer.Option(
        min=0.0,
        max=1.0,
        help="Let every joint follow a power of frequency, its exponent nil within this standard deviation (rubber: "
        "0.1). By default joints are constant.",
    ),
]
Regularise = Annotated[
    float | None,
    typer.Option(
        metavar="SHARE",
        min=TIGHTEST,
        max=LOOSEST,
        help="Hold every term of the joints within this share of its size about the paper's method. By default not "
        "at all.",
    ),
]
AverageBy = Annotated[
    Estimator,
    typer.Option(
        "--estimator", help="How blows are averaged: H1 trusts the force, H2 the acceleration, Hv neither more."
    ),
]
ForceWindow = Annotated[
    float | None,
    typer.Option(
        metavar="SECONDS",
        min=SHORTEST_FORCE,
        max=LONGEST_WINDOW,
        help="Take force for nil so long after the trigger of a blow.",
    ),
]
ExponentialWindow = Annotated[
    float | None,
    typer.Option(
        metavar="SECONDS",
        min=SHORTEST_CONSTANT,
        max=LONGEST_WINDOW,
        help="Let force and acceleration of every blow fall with this time constant; what that adds to the damping is "
        "taken out of modes and joints.",
    ),
]


def chosen(
    without: list[str] | None,
    elements: int | None,
    joint_exponent: float,
    regularise: float | None,
    estimator: Estimator,
    force_window: float | None,
    exponential_window: float | None,
) -> Options:
    """The choices that these options make."""
    averaging = Averaging(estimator, BlowWindow(force_window, exponential_window))
    return Options(tuple(without or ()), elements, joint_exponent, regularise, averaging)
