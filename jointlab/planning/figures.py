"""Pictures of a plan: Figs. 3 and 4 for the bench at hand, and the half-widths to expect. Each is an inline SVG."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from analysis.inverse.regression import TERMS, UPPER
from jointlab.planning.plan import Plan
from jointlab.report.plots import AMPLITUDE_COLOURS, BLUE, GREEN, MEASURED, ORANGE, PURPLE, SKY, as_svg, figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

JOINT_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY)
WIDEST = 1000.0  # per cent; what is wider is not known at all


def conditions(plan: Plan) -> str:
    """Fig. 3: condition number of Eq. (45) against k-bar, by number of modes; of the joint that has the highest."""
    drawn, (axes,) = figure(width=4.6, height=3.2)
    for (modes, found), colour in zip(plan.conditions.items(), AMPLITUDE_COLOURS, strict=False):
        axes.loglog(plan.stiffness_ratios, np.max(found, axis=1), color=colour, label=f"modes 1 to {modes}")
    _mark(axes, plan)
    axes.set(xlabel="k-bar", ylabel="condition number")
    axes.legend(frameon=False)
    return as_svg(drawn, "Fig. 3: condition number against joint stiffness")


def eigenvalues(plan: Plan) -> str:
    """Fig. 4: natural frequencies over the first elastic one, and their sensitivity, against k-bar."""
    drawn, (frequency, sensitivity) = figure(columns=2, height=3.0)
    for mode in range(len(plan.eigenvalues.frequency)):
        colour = AMPLITUDE_COLOURS[mode % len(AMPLITUDE_COLOURS)]
        line = "-" if mode < len(AMPLITUDE_COLOURS) else "--"
        frequency.loglog(plan.stiffness_ratios, plan.eigenvalues.frequency[mode], line, color=colour)
        sensitivity.semilogx(
            plan.stiffness_ratios, plan.eigenvalues.sensitivity[mode], line, color=colour, label=f"mode {mode + 1}"
        )
    for axes in (frequency, sensitivity):
        _mark(axes, plan)
        axes.set_xlabel("k-bar")
    frequency.set_ylabel("frequency over the first elastic one")
    sensitivity.set_ylabel("d ln f / d ln k-bar")
    sensitivity.legend(frameon=False, fontsize=8)
    return as_svg(drawn, "Fig. 4: natural frequencies against joint stiffness")


def half_widths(plan: Plan) -> str:
    """Half-width of the expected 95 % interval of every stiffness over its value, per cent."""
    drawn, (axes,) = figure(width=5.4, height=3.0)
    width = 0.8 / len(plan.joints)
    place = np.arange(len(UPPER)) - 0.4 + width / 2
    for index, joint in enumerate(plan.joints):
        colour = JOINT_COLOURS[index % len(JOINT_COLOURS)]
        value = np.array([abs(joint.dynamic_stiffness[at].real) for at in UPPER])
        half = 1.96 * plan.expectation.stiffness_deviation[joint.name]
        share = np.minimum(100 * half / np.maximum(value, 1e-9 * value.max()), WIDEST)
        axes.bar(place + width * index, share, 0.9 * width, color=colour, label=f"joint {joint.name}")
    axes.set_yscale("log")
    axes.set_xticks(np.arange(len(UPPER)), TERMS[: len(UPPER)])
    axes.axhline(100.0, color=MEASURED, linewidth=0.8, linestyle="--")
    axes.set_ylabel("half-width of 95 % (%)")
    axes.legend(frameon=False)
    return as_svg(drawn, "Expected half-widths")


def _mark(axes: Axes, plan: Plan) -> None:
    for joint in plan.design.joints:
        axes.axvline(joint.stiffness_ratio, color=MEASURED, linewidth=0.8, linestyle=":")
