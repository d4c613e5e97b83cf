"""A plan as sections of a page with their pictures, and as a document for other programs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.frequency_response import Real
from analysis.interval import Z95
from analysis.inverse.joint_estimate import square
from analysis.inverse.regression import TERMS, UPPER
from jointlab.identification.document import plain
from jointlab.identification.undetermined_text import remedy_text, weak_direction_text
from jointlab.planning.plan import Plan
from jointlab.report.plots import (
    AMPLITUDE_COLOURS,
    BLUE,
    GREEN,
    MEASURED,
    ORANGE,
    PURPLE,
    SKY,
    as_svg,
    figure,
    legend_above,
    panels,
)
from jointlab.report.section import Item, Notice, Picture, Section, Table, number
from jointlab.report.tables import TRANSLATIONS
from jointlab.report.typography import with_signs

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FORMAT = "jointlab-plan/1"
JOINT_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY)
WIDEST = 1000.0  # per cent; what is wider is not known at all
NONE_OF = 1e-9  # share of the largest term up to which one is zero, as k12 of upright cylinders is but for rounding


def plan_sections(plan: Plan) -> list[Section]:
    """Expected intervals, design quantities and studies."""
    return [_expected(plan), _design(plan), _studies(plan)]


def plan_document(plan: Plan) -> dict[str, Any]:
    """The plan as plain numbers; half-widths are those of 95 % intervals."""
    document: dict[str, Any] = plain(
        {
            "format": FORMAT,
            "title": plan.title,
            "points": [str(point) for point in plan.points],
            "noise": plan.noise,
            "joints": {
                joint.name: {
                    "k": joint.dynamic_stiffness.real,
                    "h": joint.dynamic_stiffness.imag,
                    "k_half_width95": square(Z95 * plan.expectation.stiffness_deviation[joint.name]),
                    "h_half_width95": square(Z95 * plan.expectation.damping_deviation[joint.name]),
                }
                for joint in plan.joints
            },
            "weak_directions": [weak_direction_text(weak) for weak in plan.expectation.weak_directions],
            "remedies": [remedy_text(remedy) for remedy in plan.remedies],
            "design": {
                joint.name: {
                    "k_bar": joint.stiffness_ratio,
                    "R": joint.aspect_ratio,
                    "theta_deg": np.degrees(joint.inclination),
                    "rotation_ratio": joint.rotation_ratio,
                }
                for joint in plan.design.joints
            },
            "first_elastic_hz": plan.design.first_elastic,
            "statements": plan.design.statements,
            "studies": {
                "k_bar": plan.stiffness_ratios,
                "condition_numbers": {f"modes 1-{modes}": found for modes, found in plan.conditions.items()},
                "frequency_ratio": plan.eigenvalues.frequency,
                "sensitivity": plan.eigenvalues.sensitivity,
            },
        }
    )
    return document


def _expected(plan: Plan) -> Section:
    return Section(
        "Expected results",
        (
            f"{len(plan.points)} points, averaged accelerances with {plan.noise:g} (m/s²)/N of noise a line, and every "
            "tolerance that the article states.",
            _expected_table(plan),
            Picture("Expected half-widths", half_widths(plan)),
            *(f"{with_signs(weak_direction_text(weak))}." for weak in plan.expectation.weak_directions),
            Table(
                "Remedies for the weakest direction, the best first",
                ("remedy",),
                tuple((with_signs(remedy_text(remedy)),) for remedy in plan.remedies),
            ),
        ),
    )


def _expected_table(plan: Plan) -> Table:
    rows = []
    for joint in plan.joints:
        for letter, value, deviation in (
            ("k", joint.dynamic_stiffness.real, plan.expectation.stiffness_deviation[joint.name]),
            ("h", joint.dynamic_stiffness.imag, plan.expectation.damping_deviation[joint.name]),
        ):
            half = square(Z95 * deviation)
            largest = max(abs(value[p, q]) for p, q in TRANSLATIONS)
            for p, q in TRANSLATIONS:
                element, size = f"{letter}{p + 1}{q + 1}", abs(value[p, q])
                width = f"± {number(half[p, q] / 1e6)} MN/m"
                if size > NONE_OF * largest:
                    width += f", {number(100 * half[p, q] / size, 2)} %"
                rows.append((joint.name, element, f"{number(value[p, q] / 1e6)} MN/m", width))
    head = ("joint", "element", "expected", "half-width")
    return Table("Expected 95 % intervals by maximum likelihood", head, tuple(rows))


def _design(plan: Plan) -> Section:
    rows = tuple(
        (
            joint.name,
            number(joint.stiffness_ratio),
            number(joint.aspect_ratio),
            number(float(np.degrees(joint.inclination))),
            number(joint.rotation_ratio),
        )
        for joint in plan.design.joints
    )
    against: list[Item] = [Notice(f"{text}.") for text in plan.design.statements]
    return Section(
        "Design quantities",
        (
            f"First elastic mode of the free beam: {plan.design.first_elastic:.1f} Hz; first longitudinal mode: "
            f"{plan.design.first_longitudinal:.0f} Hz.",
            Table("Eqs. (12) to (16)", ("joint", "k-bar", "R", "theta (deg)", "k-theta / (k-t L²)"), rows),
            *(against or ["There is no objection to this bench."]),
        ),
    )


def _studies(plan: Plan) -> Section:
    return Section(
        "Design studies",
        (
            "Both studies vary k-bar of all supports together, with this bench's R and theta; vertical lines are this "
            "bench's joints, and Fig. 3 shows the worst of them.",
            Picture("Fig. 3: condition number against joint stiffness", conditions(plan)),
            Picture("Fig. 4: natural frequencies against joint stiffness", eigenvalues(plan)),
        ),
    )


def conditions(plan: Plan) -> str:
    """Fig. 3: condition number of Eq. (45) against k-bar, by number of modes; of the joint that has the highest."""
    drawn, (axes,) = figure(height=3.2)
    for (modes, found), colour in zip(plan.conditions.items(), AMPLITUDE_COLOURS, strict=False):
        axes.loglog(plan.stiffness_ratios, np.max(found, axis=1), color=colour, label=f"modes 1 to {modes}")
    _mark(axes, plan)
    axes.set(xlabel="k-bar", ylabel="condition number")
    axes.legend(frameon=False)
    return as_svg(drawn, "Fig. 3: condition number against joint stiffness")


def eigenvalues(plan: Plan) -> str:
    """Fig. 4: natural frequencies over the first elastic one, and their sensitivity, against k-bar."""
    label, found = "Fig. 4: natural frequencies against joint stiffness", plan.eigenvalues
    drawn = {
        title: as_svg(_by_mode(plan, values, axis, scale), f"{label}: {title}")
        for title, values, axis, scale in (
            ("frequencies", found.frequency, "frequency over the first elastic one", "log"),
            ("sensitivity", found.sensitivity, "d ln f / d ln k-bar", "linear"),
        )
    }
    return panels(label, drawn)


def _by_mode(plan: Plan, values: Real, axis: str, scale: str) -> Figure:
    """A quantity of each mode against k-bar."""
    drawn, (axes,) = figure(height=3.0)
    for mode, own in enumerate(values):
        colour = AMPLITUDE_COLOURS[mode % len(AMPLITUDE_COLOURS)]
        line = "-" if mode < len(AMPLITUDE_COLOURS) else "--"
        axes.plot(plan.stiffness_ratios, own, line, color=colour, label=f"mode {mode + 1}")
    axes.set(xscale="log", yscale=scale, xlabel="k-bar", ylabel=axis)
    _mark(axes, plan)
    legend_above(axes)
    return drawn


def half_widths(plan: Plan) -> str:
    """Half-width of the expected 95 % interval of every stiffness over its value, per cent."""
    drawn, (axes,) = figure(height=3.0)
    width = 0.8 / len(plan.joints)
    place = np.arange(len(UPPER)) - 0.4 + width / 2
    for index, joint in enumerate(plan.joints):
        colour = JOINT_COLOURS[index % len(JOINT_COLOURS)]
        value = np.array([abs(joint.dynamic_stiffness[at].real) for at in UPPER])
        half = Z95 * plan.expectation.stiffness_deviation[joint.name]
        share = np.minimum(100 * half / np.maximum(value, NONE_OF * value.max()), WIDEST)
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
