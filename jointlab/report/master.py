"""A specimen's master curve as a section, a picture and a document for programs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.direct.master_curve import MasterCurve, MasterPoint, Range
from analysis.direct.master_fit import temperature_groups
from analysis.direct.time_temperature import KELVIN
from jointlab.identification.master import SpecimenMaster
from jointlab.report.plots import AMPLITUDE_COLOURS, GREY, figure, legend_above
from jointlab.report.section import Item, Notice, Section, Table, ends, number

if TYPE_CHECKING:
    from matplotlib.figure import Figure

KILO, MEGA, MICRO = 1e3, 1e6, 1e6
SHOWN = 10.0
"""How far outside of the measured reduced frequencies the picture goes: a decade."""
UNITS = {"C1": "", "C2": " K", "E": " kJ/mol"}


def master_section(found: SpecimenMaster) -> Section:
    """Predictions, what the curve covers, and the sweeps behind it; k and h in kN/m, 95 % intervals."""
    curve = found.curve
    low, high = curve.covered
    shift = curve.model.shift
    constants = curve.shift_values or {
        name: Range(each, each, each) for name, each in zip(("C1", "C2"), shift.constants or (), strict=True)
    }
    law = ", ".join(
        f"{name} = {number(each.value)}{UNITS[name]}" + (f" [{ends(each[1:])}]" if curve.shift_values else " (given)")
        for name, each in constants.items()
    )
    content: list[Item] = [
        f"{found.specimen} in {found.configuration}, {found.amplitude_pp_mm:g} mm peak to peak; it holds for this "
        "amplitude.",
        f"Reduced frequencies from {number(low)} to {number(high)} Hz are covered by measurements, at the reference "
        f"temperature {shift.reference:g} °C.",
        f"Shift by {shift.law.value.upper()}: {law}. "
        + ("Stiffness is taken to be in proportion to T in kelvin." if curve.model.vertical else "No vertical shift."),
        f"The points lag by {number(MICRO * curve.lag.value)} [{ends(MICRO * np.array(curve.lag[1:]))}] µs at all "
        "temperatures; that is taken for the tester's, and taken out.",
        _predictions(found.asked),
        *(
            Notice(f"extrapolated at {each.frequency:g} Hz: {phrase}.")
            for each in found.asked
            for phrase in each.beyond
        ),
        _sweeps(found),
    ]
    if found.without_temperature:
        content.append(Notice(f"{found.without_temperature} points have no temperature and are left out."))
    if found.hammer:
        content.append(_hammer(found))
    return Section(f"Master curve of {found.specimen}", tuple(content))


def _predictions(asked: Sequence[MasterPoint]) -> Table:
    rows = [
        (
            f"{each.frequency:g}",
            f"{each.temperature:g}",
            number(each.reduced_frequency),
            number(each.stiffness.value / KILO, 4),
            ends(np.array(each.stiffness[1:]) / KILO),
            number(each.loss_factor.value, 4),
            ends(each.loss_factor[1:]),
        )
        for each in asked
    ]
    return Table("By the curve", ("Hz", "°C", "reduced Hz", "k (kN/m)", "95 %", "gamma", "95 %"), tuple(rows))


def _sweeps(found: SpecimenMaster) -> Table:
    rows = []
    temperature = _temperatures(found)
    groups = temperature_groups(temperature)
    for place, mean in enumerate(groups):
        own = [each for each, at in zip(found.swept, _nearest(temperature, groups), strict=True) if at == place]
        frequency = [each.point.result.frequency for each in own]
        rows.append(
            (
                f"{mean:.1f}",
                ", ".join(map(str, sorted({each.run for each in own}))),
                str(len(own)),
                f"{min(frequency):.3g} … {max(frequency):.3g}",
                number(found.curve.shift_factor(float(mean))),
            )
        )
    return Table("Sweeps", ("°C", "runs", "points", "Hz", "a_T"), tuple(rows))


def _hammer(found: SpecimenMaster) -> Table:
    by_frequency = {each.frequency: each for each in found.asked}
    rows = [
        (
            f"{each.frequency:g}",
            f"{number(by_frequency[each.frequency].stiffness.value / KILO)} "
            f"[{ends(np.array(by_frequency[each.frequency].stiffness[1:]) / KILO)}]",
            f"{number(each.stiffness.value / KILO)} [{ends(np.array(each.stiffness[1:]) / KILO)}]",
            f"run {each.run}, {each.law}",
        )
        for each in found.hammer
    ]
    title = "Beside k22 by the hammer (kN/m; cylinders at 45 degrees; blows have micrometres, at their own temperature)"
    return Table(title, ("Hz", "by the curve", "by the hammer", "from"), tuple(rows))


def master_document(found: SpecimenMaster) -> dict[str, Any]:
    """The same for programs; SI units, temperatures in degrees Celsius."""
    curve = found.curve
    return {
        "specimen": found.specimen,
        "configuration": found.configuration,
        "amplitude_pp_mm": found.amplitude_pp_mm,
        "runs": sorted({each.run for each in found.swept}),
        "shift": curve.model.shift.law.value,
        "reference_c": curve.model.shift.reference,
        "constants": {name: dict(each._asdict()) for name, each in curve.shift_values.items()},
        "constants_given": curve.model.shift.constants,
        "vertical_shift": curve.model.vertical,
        "reduced_frequencies_covered": list(curve.covered),
        "temperatures_c": curve.model.temperatures.tolist(),
        "lag_s": dict(curve.lag._asdict()),
        "discrepancy": dict(curve.sizes._asdict()),
        "without_temperature": found.without_temperature,
        "points": [
            {
                "frequency": each.frequency,
                "temperature_c": each.temperature,
                "reduced_frequency": each.reduced_frequency,
                "k": each.stiffness.value,
                "k_ci95": list(each.stiffness[1:]),
                "gamma": each.loss_factor.value,
                "gamma_ci95": list(each.loss_factor[1:]),
                "extrapolated": list(each.beyond),
            }
            for each in found.asked
        ],
        "hammer_k22": [
            {
                "run": each.run,
                "frequency": each.frequency,
                "law": each.law,
                "k": each.stiffness.value,
                "k_ci95": list(each.stiffness[1:]),
            }
            for each in found.hammer
        ],
    }


def master_picture(found: SpecimenMaster) -> Figure:
    """|k_d| and gamma over reduced frequency: the curve at the reference temperature, and the shifted points."""
    curve = found.curve
    drawn, (upper, lower) = figure(rows=2, height=2.6)
    reference = curve.model.shift.reference
    low, high = curve.covered
    shown = [curve.at(float(each), reference) for each in np.geomspace(low / SHOWN, high * SHOWN, 120)]
    for axes, ranges, unit in (
        (upper, [each.magnitude for each in shown], MEGA),
        (lower, [each.loss_factor for each in shown], 1.0),
    ):
        value, below, above = np.array(ranges).T / unit
        at = [each.reduced_frequency for each in shown]
        axes.fill_between(at, below, above, color=GREY, alpha=0.5, linewidth=0, label="95 %")
        axes.semilogx(at, value, color="black", linewidth=1.0, label="curve")
        for edge in (low, high):
            axes.axvline(edge, color="black", linewidth=0.6, linestyle="dotted")
    _draw_points(found, curve, (upper, lower))
    upper.set(ylabel="|k| (MN/m)", yscale="log")
    lower.set(ylabel="loss factor", xlabel=f"reduced frequency at {reference:g} °C (Hz)")
    legend_above(upper)
    return drawn


def _draw_points(found: SpecimenMaster, curve: MasterCurve, panels: Sequence[Any]) -> None:
    upper, lower = panels
    temperature = _temperatures(found)
    groups = temperature_groups(temperature)
    lifted = (curve.model.shift.reference + KELVIN) / (temperature + KELVIN) if curve.model.vertical else temperature**0
    magnitude = np.array([each.point.result.magnitude for each in found.swept]) * lifted / MEGA
    loss = np.array([each.point.result.loss_factor for each in found.swept])
    nearest = _nearest(temperature, groups)
    for place, mean in enumerate(groups):
        own, colour = nearest == place, AMPLITUDE_COLOURS[place % len(AMPLITUDE_COLOURS)]
        upper.plot(curve.reduced[own], magnitude[own], "o", color=colour, markersize=3, label=f"{mean:.1f} °C")
        lower.plot(curve.reduced[own], loss[own], "o", color=colour, markersize=3)


def _temperatures(found: SpecimenMaster) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.array([each.point.temperature_c for each in found.swept], dtype=np.float64)


def _nearest(
    temperature: np.ndarray[Any, np.dtype[np.float64]], groups: np.ndarray[Any, np.dtype[np.float64]]
) -> np.ndarray[Any, np.dtype[np.intp]]:
    return np.asarray(np.argmin(np.abs(temperature[:, None] - groups), axis=1))
