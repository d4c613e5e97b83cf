"""A specimen's master curve as a section and a picture; terminal and page say the same."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from jointlab.documents.master import (
    Cause,
    Ends,
    LeftOutDocument,
    MasterDocument,
    PredictionDocument,
    ShiftParameter,
    runs_text,
)
from jointlab.report.plots import AMPLITUDE_COLOURS, GREY, figure, legend_above
from jointlab.report.section import Item, Notice, Section, Table, ends, number
from rig.operator import loading_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

KILO, MEGA, MICRO = 1e3, 1e6, 1e6
CAUSES = {
    Cause.NO_TEMPERATURE: "Left out, as no temperature was recorded",
    Cause.OTHER_RUN: "Left out, as other runs were asked for",
    Cause.OTHER_SERIES: "Left out, as a curve is of one configuration and amplitude",
}
"""Why points are left out, in the order of what most needs to be seen."""
LAWS = {"wlf": "WLF", "arrhenius": "Arrhenius"}


def master_section(found: MasterDocument) -> Section:
    """Predictions, what the curve covers, the sweeps behind it and what was left out; k in kN/m, 95 % intervals."""
    content: list[Item] = [
        *master_sentences(found),
        *([predictions_table(found.predictions)] if found.predictions else ()),
        *extrapolations(found.predictions),
        sweeps_table(found),
        *left_out_notices(found),
    ]
    if found.hammer_k22:
        content.append(hammer_table(found))
    return Section(f"Master curve of {found.specimen}", tuple(content))


def master_sentences(found: MasterDocument) -> list[str]:
    """What the curve is of, what it covers, its shift with the parameters, and the lag."""
    low, high = found.reduced_frequencies_covered
    proportional = "Stiffness is taken to be in proportion to T in kelvin."
    return [
        f"{found.specimen} {loading_text(found.configuration)}, {found.amplitude_pp_mm:g} mm peak to peak; it holds "
        "for this amplitude.",
        f"Reduced frequencies from {number(low)} to {number(high)} Hz are covered by measurements, at the reference "
        f"temperature {found.reference_c:g} °C.",
        f"Shift by {LAWS[found.shift]}: {', '.join(map(_parameter, found.parameters))}. "
        + (proportional if found.vertical_shift else "No vertical shift."),
        f"The points lag by {number(MICRO * found.lag.value)} [{_scaled(found.lag.ci95, 1 / MICRO)}] µs at all "
        "temperatures; that is taken for the tester's, and taken out.",
    ]


def _parameter(found: ShiftParameter) -> str:
    unit = "" if found.unit == "1" else f" {found.unit}"
    value = f"{found.name} = {number(found.value)}{unit}"
    if found.standard_error is None or found.ci95 is None:
        return f"{value} (given)"
    return f"{value} [{ends(found.ci95)}], standard error {number(found.standard_error, 2)}"


def extrapolations(asked: Sequence[PredictionDocument]) -> list[Notice]:
    """How each prediction is outside of what was measured."""
    return [Notice(f"extrapolated at {each.frequency:g} Hz: {phrase}.") for each in asked for phrase in each.beyond]


def left_out_notices(found: MasterDocument) -> list[Notice]:
    """What of the specimen is not in the curve, and why: one notice for each cause."""
    notices = []
    for cause, why in CAUSES.items():
        if of_cause := [_points(each) for each in found.left_out if each.cause is cause]:
            notices.append(Notice(f"{why}: {'; '.join(of_cause)}."))
    if found.not_identified:
        notices.append(Notice(f"Not identified, and so not in the curve: {runs_text(found.not_identified)}."))
    return notices


def _points(found: LeftOutDocument) -> str:
    count = f"{found.points} point{'s' if found.points > 1 else ''}"
    where = f"{loading_text(found.configuration)}, {found.amplitude_pp_mm:g} mm peak to peak"
    return f"{count} {where} ({runs_text(found.runs)})"


def predictions_table(asked: Sequence[PredictionDocument]) -> Table:
    """A row for each frequency that was asked for."""
    rows = [
        (
            f"{each.frequency:g}",
            f"{each.temperature_c:g}",
            number(each.reduced_frequency),
            number(each.k / KILO, 4),
            _scaled(each.k_ci95, KILO),
            number(each.gamma, 4),
            ends(each.gamma_ci95),
        )
        for each in asked
    ]
    return Table("By the curve", ("Hz", "°C", "reduced Hz", "k (kN/m)", "95 %", "γ", "95 %"), tuple(rows))


def sweeps_table(found: MasterDocument) -> Table:
    """A row for each temperature, with its shift factor."""
    rows = [
        (
            f"{each.temperature_c:.1f}",
            ", ".join(map(str, each.runs)),
            str(each.points),
            f"{each.lowest_frequency:.3g} … {each.highest_frequency:.3g}",
            number(each.shift_factor),
            ends(each.shift_factor_ci95),
        )
        for each in found.sweeps
    ]
    return Table("Sweeps", ("°C", "runs", "points", "Hz", "a_T", "95 %"), tuple(rows))


def hammer_table(found: MasterDocument) -> Table:
    """k22 by the curve and by the hammer."""
    by_frequency = {each.frequency: each for each in found.predictions}
    rows = []
    for each in found.hammer_k22:
        own = by_frequency[each.frequency]
        rows.append(
            (
                f"{each.frequency:g}",
                f"{number(own.k / KILO)} [{_scaled(own.k_ci95, KILO)}]",
                f"{number(each.k / KILO)} [{_scaled(each.k_ci95, KILO)}]",
                f"run {each.run}, {each.law}",
            )
        )
    title = "Beside k22 by the hammer (kN/m; cylinders at 45 degrees; blows have micrometres, at their own temperature)"
    return Table(title, ("Hz", "by the curve", "by the hammer", "from"), tuple(rows))


def _scaled(interval: Ends, scale: float) -> str:
    return ends([end / scale for end in interval])


def master_picture(found: MasterDocument) -> Figure:
    """|k_d| and gamma over reduced frequency: the curve at the reference temperature, and the shifted points."""
    drawn, (upper, lower) = figure(rows=2, height=2.6)
    curve = found.curve
    for axes, value, interval, unit in (
        (upper, curve.magnitude, curve.magnitude_ci95, MEGA),
        (lower, curve.gamma, curve.gamma_ci95, 1.0),
    ):
        below, above = np.array(interval).T / unit
        axes.fill_between(curve.reduced_frequency, below, above, color=GREY, alpha=0.5, linewidth=0, label="95 %")
        axes.semilogx(curve.reduced_frequency, np.array(value) / unit, color="black", linewidth=1.0, label="curve")
        for edge in found.reduced_frequencies_covered:
            axes.axvline(edge, color="black", linewidth=0.6, linestyle="dotted")
    _draw_points(found, (upper, lower))
    upper.set(ylabel="|k| (MN/m)", yscale="log")
    lower.set(ylabel="loss factor", xlabel=f"reduced frequency at {found.reference_c:g} °C (Hz)")
    legend_above(upper)
    return drawn


def _draw_points(found: MasterDocument, panels: Sequence[Any]) -> None:
    upper, lower = panels
    for place, sweep in enumerate(found.sweeps):
        own = [each for each in found.measured if each.sweep == place]
        at, colour = [each.reduced_frequency for each in own], AMPLITUDE_COLOURS[place % len(AMPLITUDE_COLOURS)]
        mark = {"color": colour, "markersize": 3}
        magnitude = [each.reduced_magnitude / MEGA for each in own]
        upper.plot(at, magnitude, "o", label=f"{sweep.temperature_c:.1f} °C", **mark)
        lower.plot(at, [each.gamma_without_lag for each in own], "o", **mark)
