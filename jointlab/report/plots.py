"""How the report's pictures look: one style, colours that colour-blind people can tell apart, inline SVG."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from itertools import islice
from typing import TYPE_CHECKING

from store.extras import explained_imports

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito's palette: distinct for every common kind of colour vision.
BLUE, ORANGE, GREEN, PURPLE, SKY, BLACK = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#222222"
GREY = "#B0B0B0"
COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY, BLACK)
LINES = ("solid", "dashed", "dotted", "dashdot")
MEASURED, PREDICTED = BLACK, ORANGE
CURVE_STYLES = ((MEASURED, "solid"), (ORANGE, "dashed"), (BLUE, "dotted"))
AMPLITUDE_COLOURS = (BLUE, GREEN, ORANGE, PURPLE, SKY)
AMPLITUDE_STYLES = tuple(zip(AMPLITUDE_COLOURS * 9, LINES * 9, strict=False))
TESTER_COLOURS = (MEASURED, GREEN, PURPLE)
"""Of the tester's amplitudes, the smallest first, where results of the hammer stand beside them."""
METHOD_COLOURS = (ORANGE, BLUE)
"""Of the inverse methods, in the order in which they are known."""
WIDTH = 4.8
"""Inches that a picture is drawn wide: as wide as a phone, its words are still 9 px high."""
SMALLEST, LARGEST = 0.7, 1.2
"""Smallest and largest size of a picture as shown, relative to its drawn size, so that its text is easy to read."""
PIXELS = 96  # an inch, in CSS
LEGEND_CHARACTERS = 56
"""Characters of a legend that fit beside each other above a picture, keys and gaps included."""
KEY_CHARACTERS = 7
"""Width of the key of a curve and of the gap behind its name, in characters."""


def stroke(index: int) -> tuple[str, str]:
    """Colour and kind of line of curve `index`: neighbours differ in both, and 24 curves in one of them."""
    return COLOURS[index % len(COLOURS)], LINES[(index + index // 12) % len(LINES)]


def amplitude_styles(by_amplitude: Iterable[Iterable[float]]) -> dict[float, tuple[str, str]]:
    """Colour and kind of line of every amplitude of several groups, alike in all of them, the largest first."""
    amplitudes = sorted({amplitude for group in by_amplitude for amplitude in group}, reverse=True)
    return dict(zip(amplitudes, AMPLITUDE_STYLES, strict=False))


def figure(rows: int = 1, columns: int = 1, width: float = WIDTH, height: float = 2.6) -> tuple[Figure, list[Axes]]:
    """An empty figure of `rows` x `columns` axes, in reading order; `height` in inches a row.

    Raises MissingExtraError where matplotlib is not installed.
    """
    with explained_imports():
        from matplotlib.figure import Figure
    drawn = Figure(figsize=(width, height * rows), layout="constrained")
    grid = drawn.subplots(rows, columns, squeeze=False)
    axes: list[Axes] = [grid[row][column] for row in range(rows) for column in range(columns)]
    for each in axes:
        each.grid(visible=True, alpha=0.25, linewidth=0.6)
        each.spines[["top", "right"]].set_visible(False)
    return drawn, axes


def without_formulas(drawn: Figure) -> None:
    """Draw ``$`` in titles and legends as it is: the name of a joint or of a part is no formula."""
    legends = [*drawn.legends, *(legend for axes in drawn.axes if (legend := axes.get_legend()) is not None)]
    for words in (*(axes.title for axes in drawn.axes), *(text for legend in legends for text in legend.get_texts())):
        words.set_parse_math(False)


def as_svg(drawn: Figure, label: str) -> str:
    """The figure as an inline SVG element with `label` as its text alternative, as wide as its place allows."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    buffer = io.StringIO()
    without_formulas(drawn)
    # the bytes that `savefig` writes, which draws all of it once more before
    canvas = FigureCanvasSVG(drawn)
    canvas.print_svg(buffer, metadata={"Date": None, "Creator": None})  # type: ignore[no-untyped-call]  # matplotlib has no types here
    text = buffer.getvalue()
    # Several SVGs share one page: their ids must not meet.
    prefix = re.sub(r"[^a-z0-9]+", "-", label.lower()).strip("-")
    text = re.sub(r'\bid="', f'id="{prefix}-', text)
    text = re.sub(r'(xlink:href="#|url\(#)', rf"\g<1>{prefix}-", text)
    width = PIXELS * drawn.get_figwidth()
    size = f"width: 100%; min-width: {SMALLEST * width:.0f}px; max-width: {LARGEST * width:.0f}px"
    start = text.index("<svg")
    return text[start:].replace("<svg ", f'<svg role="img" aria-label="{escape(label)}" style="{size}" ', 1)


def panels(label: str, drawn: Mapping[str, str]) -> str:
    """Pictures by their titles under one label: two beside each other, one below the other on a phone."""
    inner = "".join(f"<div><p>{escape(title)}</p>{svg}</div>" for title, svg in drawn.items())
    return f'<div class="panels" role="group" aria-label="{escape(label)}">{inner}</div>'


def legend_above(axes: Axes) -> None:
    """A legend of the axes above the whole figure, where it hides no curve, in as many columns as fit."""
    handles, names = axes.get_legend_handles_labels()
    drawn = axes.get_figure()
    if names and drawn is not None:
        columns = _columns([len(name) for name in names])
        drawn.legend(handles, names, frameon=False, fontsize=9, ncols=columns, loc="outside upper left")


def _columns(lengths: Sequence[int]) -> int:
    """Columns of a legend by the lengths of its names, which it shares among them in order, the first ones longest.

    A legend that is too wide would squeeze the axes under it.
    """
    for columns in range(len(lengths), 1, -1):
        rows, longer = divmod(len(lengths), columns)
        names, width = iter(lengths), 0
        for column in range(columns):
            width += max(islice(names, rows + (column < longer))) + KEY_CHARACTERS
        if width <= LEGEND_CHARACTERS:
            return columns
    return 1


def band(axes: Axes, interval: Sequence[float], colour: str, label: str) -> None:
    """A horizontal interval across the axes, as Figs. 13 and 14 show the inverse result."""
    axes.axhspan(interval[0], interval[1], color=colour, alpha=0.18, linewidth=0, label=label)
