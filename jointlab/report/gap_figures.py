"""Pictures of a gap diagnosis: maps that are read at a glance, and bars before and after. Each is an inline SVG."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from analysis.frequency_response import Real
from jointlab.diagnosis.law_text import COORDINATES, places
from jointlab.diagnosis.wording import RIGS, percent
from jointlab.report.gap_tables import SIGNIFICANT
from jointlab.report.plots import BLUE, GREEN, MEASURED, ORANGE, as_svg, figure, legend_above

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = "YlOrRd"
CURVE_AXES = {
    "magnitude": "|A| ((m/s²)/N)",
    "phase_deg": "phase (deg)",
    "stiffness": "k (MN/m)",
    "loss_factor": "loss factor",
}
CURVE_UNITS = {"stiffness": 1e6}
"""Units of axes in those of the document, where they differ."""
CURVE_STYLES = {"measured": ("#9a9a9a", 3.0, "-"), "before": (ORANGE, 1.2, "--"), "after": (BLUE, 1.2, "-")}
"""Colour, width and kind of line: distinguished without colour, and seen where they coincide."""
SHAPE_AXES = {
    "frequency": "frequency (Hz)",
    "order": "order of measuring, first to last",
    "amplitude": "amplitude (m)",
    "point": "points in the order struck",
    "set": "hammer sets",
}
"""Labels of the axis, by the quantity that a function depends on."""
LAW_STYLES = {"compression": (BLUE, "solid"), "shear": (ORANGE, "dashed")}
"""Colour and kind of line of a law along each axis of the cylinders: distinguished without colour."""
MARKED = 0.08
"""Share of a map's whole misfit from which a cell has its share written in it."""


def gap_map(drawn: Mapping[str, Any]) -> str:
    """Misfit beyond noise by row and band; a cell's colour is its share of all in this map."""
    energy = np.maximum(np.array(drawn["energy"], dtype=float), 0.0)
    significance = np.array(drawn["significance"], dtype=float)
    share = energy / max(float(energy.sum()), np.finfo(float).tiny)
    rows, edges = drawn["rows"], np.array(drawn["edges_hz"], dtype=float)
    picture, (axes,) = figure(height=0.9 + 0.24 * len(rows))
    from matplotlib.colors import PowerNorm  # an extra, which is there where `figure` draws

    seen = np.ma.masked_where(significance < SIGNIFICANT, share)
    lines = np.arange(len(rows) + 1)
    top = max(float(share.max()), 0.02)
    mesh = axes.pcolormesh(edges, lines, seen, cmap=COLOURS, norm=PowerNorm(0.5, 0.0, top), linewidth=0)
    axes.set_yticks(lines[:-1] + 0.5, [str(row) for row in rows], fontsize=8)
    axes.invert_yaxis()
    axes.grid(visible=False)
    axes.set_xlabel("frequency (Hz)")
    _write_shares(axes, edges, np.where(significance < SIGNIFICANT, 0.0, share), top)
    bar = picture.colorbar(mesh, ax=axes, fraction=0.03, pad=0.01)
    bar.ax.yaxis.set_major_formatter(lambda value, _: f"{100 * value:.0f} %")
    return as_svg(picture, f"Map: {drawn['title']}")


def _write_shares(axes: Axes, edges: Real, share: Real, top: float) -> None:
    for row, band in np.argwhere(share >= MARKED):
        colour = "white" if share[row, band] > 0.5 * top else MEASURED
        middle = (edges[band] + edges[band + 1]) / 2
        text = f"{100 * share[row, band]:.0f}"
        axes.text(middle, row + 0.5, text, ha="center", va="center", fontsize=7, color=colour)


def before_and_after(gap: Mapping[str, Any]) -> str:
    """The gap of each rig before and after the effects are in the model; 90 % interval of the first rig, and floor."""
    rigs = gap["by_rig"]
    picture, (axes,) = figure(height=0.8 + 0.6 * len(rigs))
    ticks, names = list[float](), list[str]()
    for place, (rig, found) in enumerate(rigs.items()):
        for offset, moment, colour in ((-0.2, "before", ORANGE), (0.2, "after", BLUE)):
            if found[moment] is None:
                continue
            axes.barh(place + offset, found[moment], 0.36, color=colour, label=moment if place == 0 else None)
            interval = gap["after_ci90_percent"] if (place, moment) == (0, "after") else ()
            at = max(found[moment], *(end or 0.0 for end in interval)) if interval else found[moment]
            axes.annotate(
                percent(found[moment]),
                (at, place + offset),
                (5, 0),
                textcoords="offset points",
                va="center",
                fontsize=8,
            )
        ticks.append(place)
        names.append(RIGS[rig])
    low, high = gap["after_ci90_percent"]
    if rigs and low is not None and high is not None:
        axes.plot([low, high], [0.2, 0.2], "|-", color=MEASURED, markersize=9, label="90 % interval")
    if gap["floor_percent"] is not None:
        axes.axvline(gap["floor_percent"], color=GREEN, linestyle="--", label="floor: measuring again")
    axes.set_yticks(ticks, names)
    axes.invert_yaxis()
    axes.margins(x=0.12)
    axes.set_xlabel("gap on held-out data (%)")
    legend_above(axes)
    return as_svg(picture, "Gap before and after")


def curves(drawn: Mapping[str, Any], place: str) -> str:
    """Measured, before and after over frequency: accelerance, closer, and phase; or k and gamma of the tester."""
    shown = [name for name in CURVE_AXES if name in drawn]
    band = drawn.get("close_up_hz")
    picture, axes = figure(rows=len(shown) + (band is not None), height=2.0)
    for name, each in zip((shown[0], *shown) if band else shown, axes, strict=True):
        _draw_curves(each, drawn, name)
    if band:
        axes[0].set_yscale("log")
        axes[1].set(xlim=band, ylabel=f"closer, {CURVE_AXES[shown[0]]}")
        close = _within(drawn, band)
        axes[1].set_ylim(0, 1.08 * max(max(drawn[shown[0]][moment][at] for at in close) for moment in CURVE_STYLES))
    if "phase_deg" in shown:
        axes[-1].set(ylim=(-190, 190), yticks=(-180, -90, 0, 90, 180))
    legend_above(axes[0])
    axes[-1].set_xlabel("frequency (Hz)")
    return as_svg(picture, f"Measured, before and after: {place}")


def shape(curve: Mapping[str, Any], title: str) -> str:
    """The real and the imaginary part of a function that would take up what is left, with their 90 % bands."""
    picture, axes = figure(rows=2, height=2.0)
    for each, part in zip(axes, ("real", "imaginary"), strict=True):
        each.fill_between(curve["at"], *curve[f"{part}_ci90"], color=BLUE, alpha=0.2, linewidth=0)
        each.plot(curve["at"], curve[part], color=BLUE, linewidth=1.4)
        each.axhline(0.0, color=MEASURED, linewidth=0.6)
        each.set_ylabel(f"{part} part ({curve['unit']})")
    axes[-1].set_xlabel(SHAPE_AXES[curve["over"]])
    return as_svg(picture, title)


def law(found: Mapping[str, Any], title: str) -> str:
    """A law of the joints as found: stiffness over that at its first place, and loss factor, with their 90 % bands."""
    coordinate, at = COORDINATES[found["over"]], places(found)
    picture, axes = figure(rows=2, height=2.0)
    for each, (quantity, label) in zip(axes, law_labels(found).items(), strict=True):
        for axis, (colour, kind) in LAW_STYLES.items():
            band = found[axis][quantity]
            each.fill_between(at, *band["ci90"], color=colour, alpha=0.2, linewidth=0)
            each.plot(at, band["value"], color=colour, linestyle=kind, linewidth=1.4, label=f"in {axis}")
        each.set_ylabel(label)
        if coordinate.log:
            _in_steps_of_1_2_5(each)
    legend_above(axes[0])
    axes[-1].set_xlabel(coordinate.axis)
    return as_svg(picture, title)


def _in_steps_of_1_2_5(axes: Axes) -> None:
    """A logarithmic scale with plain numbers, which are enough for less than a decade."""
    from matplotlib.ticker import LogLocator, NullFormatter  # an extra, which is there where `figure` draws

    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())


def law_labels(found: Mapping[str, Any]) -> dict[str, str]:
    """Labels of the axes of a law's quantities, by their names in the document."""
    first = COORDINATES[found["over"]].words(found["at"][0])
    return {"stiffness": f"k over that at {first}", "loss_factor": "loss factor"}


def _within(drawn: Mapping[str, Any], band: Sequence[float]) -> list[int]:
    """Places of the lines in a band."""
    return [at for at, frequency in enumerate(drawn["frequency_hz"]) if band[0] <= frequency <= band[1]]


def _draw_curves(axes: Axes, drawn: Mapping[str, Any], name: str) -> None:
    frequency = np.array(drawn["frequency_hz"], dtype=float)
    for moment, (colour, width, line) in CURVE_STYLES.items():
        values = np.array(drawn[name][moment], dtype=float) / CURVE_UNITS.get(name, 1.0)
        if name == "phase_deg":  # dots: a line would draw every jump from 180 to -180 degrees
            axes.plot(frequency, values, ".", markersize=width + 1, color=colour)
        else:
            axes.plot(frequency, values, line, linewidth=width, color=colour, label=moment)
    axes.set_ylabel(CURVE_AXES[name])
