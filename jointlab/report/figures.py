"""The paper's Figs. 5 to 9 and 11 to 14, drawn for this bench. Each returns inline SVG, or several under one label."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from analysis.dof import Direction, Dof
from analysis.frequency_response import Complex, FrequencyResponses, Real
from analysis.inverse.response_band import ResponseBand
from analysis.modal.stabilisation import Stabilisation
from analysis.modes import Modes
from jointlab.report.curves import Panel, PlottedCurve, panel_colours
from jointlab.report.plots import (
    AMPLITUDE_COLOURS,
    BLUE,
    CURVE_STYLES,
    GREY,
    MEASURED,
    ORANGE,
    PREDICTED,
    amplitude_styles,
    as_svg,
    band,
    figure,
    legend_above,
    panels,
)
from store.states import CONFIGURATIONS

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def regression(observed_and_fitted: Mapping[str, tuple[Real, Real]]) -> str:
    """Fig. 5: observed against fitted side of the joint equations, for each joint."""
    drawn, (axes,) = figure(height=4.0)
    span = 0.0
    for (name, (observed, fitted)), colour, marker in zip(
        observed_and_fitted.items(), AMPLITUDE_COLOURS * 9, "o+xsd^v*" * 9, strict=False
    ):
        axes.plot(fitted, observed, marker, color=colour, label=f"joint {name}", markersize=5, fillstyle="none")
        span = max(span, float(np.abs(observed).max()), float(np.abs(fitted).max()))
    axes.plot([-span, span], [-span, span], "--", color=MEASURED, linewidth=0.8, label="slope one")
    axes.set(xlabel="curve-fitted", ylabel="observed")
    axes.legend(frameon=False)
    return as_svg(drawn, "Fig. 5: observed against curve-fitted data")


def stabilisation(chart: Stabilisation, measured: FrequencyResponses, found: Real) -> str:
    """Poles of every model order over the sum of all accelerances; lines are the modes (modes,) found, in Hz."""
    drawn, (axes,) = figure(height=3.0)
    kinds = (
        ("new", ~chart.stable, ".", GREY, 3),
        ("stable", chart.stable & (chart.column < 0), "o", BLUE, 4),
        ("candidate mode", chart.column >= 0, "^", ORANGE, 4),
    )
    for name, which, mark, colour, size in kinds:
        axes.plot(
            chart.frequency[which],
            chart.order[which],
            mark,
            color=colour,
            markersize=size,
            fillstyle="none",
            label=name,
        )
    for mode in found:
        axes.axvline(float(mode), color=MEASURED, linewidth=0.6, linestyle="dashed")
    axes.set(xlabel="frequency (Hz)", ylabel="model order", xlim=(0, float(measured.frequency[-1])))
    legend_above(axes)
    shown = measured.frequency > 0
    right = axes.twinx()
    total = np.abs(measured.accelerance[:, shown]).sum(axis=0)
    right.semilogy(measured.frequency[shown], total, color=MEASURED, linewidth=0.7, alpha=0.7)
    right.set_ylabel("sum of |A| ((m/s²)/N)")
    return as_svg(drawn, "Stabilisation chart")


def mode_shapes(
    measured: Modes, predicted: Modes, measured_at: Mapping[Dof, float], predicted_at: Mapping[Dof, float]
) -> str:
    """Fig. 6: transverse shapes, measured at the points struck and predicted along the beam, mode by mode.

    `measured_at` and `predicted_at` give the position in metres of every dof of the two sets of modes.
    """
    label = "Fig. 6: mode shapes, measured and predicted"
    drawn = {}
    for mode in range(measured.poles.size):
        title = f"mode {mode + 1}, {measured.frequency[mode]:.1f} Hz"
        at = _transverse(predicted, mode, predicted_at), _transverse(measured, mode, measured_at)
        drawn[title] = as_svg(_mode_shape(*at), f"{label}: {title}")
    return panels(label, drawn)


def _mode_shape(predicted: tuple[Real, Complex], measured: tuple[Real, Complex]) -> Figure:
    (x, shape), (points, measured_shape) = predicted, measured
    shape = shape / shape[np.argmax(np.abs(shape))]
    # the scale of a measured shape is free: fit it to the prediction
    nearby = np.interp(points, x, shape.real) + 1j * np.interp(points, x, shape.imag)
    measured_shape = measured_shape * np.vdot(measured_shape, nearby) / np.vdot(measured_shape, measured_shape)
    drawn, (axes,) = figure(height=2.0)
    axes.plot(x, shape.real, color=PREDICTED, linewidth=1.4, label="predicted")
    axes.plot(points, measured_shape.real, "+", color=MEASURED, markersize=8, label="measured")
    axes.set(xlabel="position along the beam (m)", ylabel="shape (largest is 1)", ylim=(-1.4, 1.4))
    legend_above(axes)
    return drawn


def _transverse(modes: Modes, mode: int, positions: Mapping[Dof, float]) -> tuple[Real, Complex]:
    """Positions and components in y of one shape, from left to right."""
    chosen = [column for column, dof in enumerate(modes.dofs) if dof.direction is Direction.Y]
    chosen.sort(key=lambda column: positions[modes.dofs[column]])
    return np.array([positions[modes.dofs[column]] for column in chosen]), modes.shapes[mode, chosen]


def accelerance(
    label: str,
    measured: FrequencyResponses,
    predicted: Mapping[str, FrequencyResponses],
    point: Dof,
    band: ResponseBand | None = None,
) -> str:
    """Figs. 7 to 9: accelerance of one row, measured and predicted by Eq. (46) from each method's joints.

    A band is the 95 % interval of the prediction's magnitude; where the model is right it is thinner than the line.
    """
    drawn, (magnitude, phase) = figure(rows=2, height=2.1)
    for (name, responses), style in zip({"measured": measured, **predicted}.items(), CURVE_STYLES, strict=False):
        colour, line = style
        row = responses.accelerance[responses.row(point)]
        keep = responses.frequency > 0
        frequency = responses.frequency[keep]
        magnitude.semilogy(frequency, np.abs(row[keep]), linestyle=line, linewidth=1.1, color=colour, label=name)
        # dots: a line would draw every jump from 180 to -180 degrees
        phase.plot(frequency, np.degrees(np.angle(row[keep])), ".", markersize=1.5, color=colour)
    if band is not None:
        low, high = np.moveaxis(band.magnitude_ci95[band.responses.row(point)], -1, 0)
        lines, low = band.responses.frequency, np.maximum(low, 1e-9)
        colour, _ = CURVE_STYLES[1]
        shown = magnitude.get_ylim()  # of the curves: a band may reach down to zero
        magnitude.fill_between(lines, low, high, color=colour, alpha=0.3, linewidth=0, label="95 % of the prediction")
        magnitude.set_ylim(shown)
    magnitude.set(ylabel="|A| ((m/s²)/N)")
    legend_above(magnitude)
    phase.set(xlabel="frequency (Hz)", ylabel="phase (deg)", yticks=(-180, -90, 0, 90, 180))
    return as_svg(drawn, f"{label}: accelerance at {measured.response} for a blow at {point}")


def dynamic_stiffness(
    joint: str,
    magnitude: Mapping[str, Mapping[float, PlottedCurve]],
    loss_factor: Mapping[str, Mapping[float, PlottedCurve]],
) -> str:
    """Fig. 11: dynamic stiffness and loss factor by configuration and amplitude (mm p-p), for one joint's cylinders."""
    label = f"Fig. 11, joint {joint}: dynamic stiffness and loss factor of the cylinders"
    measured = [configuration for configuration in CONFIGURATIONS if configuration in magnitude]
    styles = amplitude_styles(magnitude[configuration] for configuration in measured)
    drawn = {}
    for configuration in measured:
        for words, curves, name, unit in (
            ("stiffness", magnitude[configuration], "|k| (MN/m)", 1e6),
            ("loss factor", loss_factor[configuration], "loss factor", 1.0),
        ):
            title = f"{configuration}, {words}"
            drawn[title] = as_svg(_sweeps(curves, styles, name, unit), f"{label}: {title}")
    return panels(label, drawn)


def _sweeps(
    curves: Mapping[float, PlottedCurve], styles: Mapping[float, tuple[str, str]], name: str, unit: float
) -> Figure:
    drawn, (axes,) = figure(height=2.2)
    for amplitude, curve in sorted(curves.items(), reverse=True):
        colour, line = styles[amplitude]
        low, high = (curve.value - curve.half_width) / unit, (curve.value + curve.half_width) / unit
        axes.plot(
            curve.frequency, curve.value / unit, linestyle=line, color=colour, linewidth=1.3, label=f"{amplitude:g} mm"
        )
        axes.fill_between(curve.frequency, low, high, color=colour, alpha=0.2, linewidth=0)
    axes.set_ylim(bottom=0)
    axes.set(xlabel="frequency (Hz)", ylabel=name)
    legend_above(axes)
    return drawn


def superposition(joint: str, computed: Mapping[float, PlottedCurve], measured: Mapping[float, PlottedCurve]) -> str:
    """Fig. 12: angled pair, measured, against a + b computed from compression and shear, by amplitude (mm p-p)."""
    drawn, (axes,) = figure(height=2.8)
    styles = amplitude_styles((measured,))
    for amplitude, (colour, line) in styles.items():
        curve = measured[amplitude]
        axes.plot(curve.frequency, curve.value / 1e6, linestyle=line, color=colour, label=f"measured, {amplitude:g} mm")
    for amplitude, (colour, _) in styles.items():
        sums = computed[amplitude]
        axes.plot(sums.frequency, sums.value / 1e6, "+", color=colour, label=f"computed, {amplitude:g} mm")
    axes.set(xlabel="frequency (Hz)", ylabel="|k| (MN/m)")
    axes.set_ylim(bottom=0)
    legend_above(axes)
    return as_svg(drawn, f"Fig. 12, joint {joint}: superposition of the cylinders at 45 degrees")


def direct_against_inverse(label: str, axis: str, shown: Sequence[Panel], scale: float = 1.0) -> str:
    """Figs. 13 and 14: the direct sweep over the interval that the inverse test leaves, all divided by `scale`.

    A method or an amplitude has one colour in all panels, also where another panel lacks it.
    """
    bands, points = panel_colours(shown)
    drawn = {each.title: as_svg(_panel(each, axis, scale, bands, points), f"{label}: {each.title}") for each in shown}
    return panels(label, drawn)


def _panel(panel: Panel, axis: str, scale: float, bands: Mapping[str, str], points: Mapping[float, str]) -> Figure:
    drawn, (axes,) = figure(height=2.6)
    for method, interval in panel.inverse.items():
        band(axes, [end / scale for end in interval], bands[method], method)
    for amplitude, curve in sorted(panel.curves.items()):
        axes.errorbar(
            curve.frequency,
            curve.value / scale,
            curve.half_width / scale,
            fmt="o",
            markersize=3,
            color=points[amplitude],
            elinewidth=0.8,
            fillstyle="none",
            label=f"tester, {amplitude:g} mm",
        )
    axes.set(xlabel="frequency (Hz)", ylabel=axis)
    legend_above(axes)
    return drawn


@dataclass(frozen=True, eq=False)
class LevelCurve:
    """One joint by several hammer sets: amplitude in m p-p, rising, k22 in N/m (sets,), its interval (sets, 2)."""

    amplitude_pp: Real
    stiffness: Real
    interval: Real


def against_amplitude(curves: Mapping[str, LevelCurve]) -> str:
    """Stiffness k22 of each joint against the amplitude that blows caused."""
    drawn, (axes,) = figure(height=3.0)
    for (name, curve), colour in zip(curves.items(), AMPLITUDE_COLOURS * 9, strict=False):
        below, above = curve.stiffness - curve.interval[:, 0], curve.interval[:, 1] - curve.stiffness
        axes.errorbar(
            1e6 * curve.amplitude_pp,
            curve.stiffness / 1e6,
            np.stack([below, above]) / 1e6,
            fmt="o-",
            markersize=3,
            color=colour,
            linewidth=0.8,
            label=f"joint {name}",
        )
    axes.set_xscale("log")
    axes.set(xlabel="amplitude (µm p-p)", ylabel="k22 (MN/m)")
    axes.legend(frameon=False)
    return as_svg(drawn, "Stiffness k22 against amplitude")
