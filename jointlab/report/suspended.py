"""The report's section on the suspended beam: Table 1 with intervals, and what it says of damping and material."""

from __future__ import annotations

from analysis.interval import Estimate
from analysis.suspended.beam_update import PARAMETERS
from jointlab.identification.suspended import SuspendedBeam
from jointlab.report.section import Section, Table, ends, number

UNITS = {"youngs_modulus": "Pa", "density": "kg/m³", "length": "m", "height": "m", "width": "m"}


def suspended_section(suspended: SuspendedBeam) -> Section:
    """Table 1, the beam after the update, and what is not determined or not right."""
    result = suspended.result
    modes = tuple(
        (
            str(row.mode),
            _interval(row.experiment, 6),
            number(row.timoshenko, 6),
            number(row.euler_bernoulli, 6),
            number(row.updated, 6),
            _interval(row.damping_ratio, 3),
        )
        for row in result.table
    )
    update = result.update
    beam = tuple(
        (
            name.replace("_", " ").replace("youngs", "Young's"),
            f"{number(getattr(update.drawn, name), 5)} {UNITS[name]}",
            f"{_interval(update.parameter(name), 5)} {UNITS[name]}",
        )
        for name in PARAMETERS
    )
    return Section(
        "The beam without joints",
        (
            Table(
                "Table 1: the suspended beam, the cords taken out",
                ("mode", "measured, 95 % (Hz)", "Timoshenko", "Euler-Bernoulli", "updated", "damping ratio, 95 %"),
                modes,
            ),
            Table("The beam after the update", ("", "as drawn", "updated, 95 %"), beam),
            *(f"{text}." for text in result.statements),
        ),
    )


def _interval(estimate: Estimate | None, digits: int) -> str:
    return "–" if estimate is None else ends(estimate.interval(), digits)
