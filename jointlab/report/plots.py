"""How the report's pictures look: one style, colours that colour-blind people can tell apart, inline SVG."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from html import escape
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


def stroke(index: int) -> tuple[str, str]:
    """Colour and kind of line of curve `index`: neighbours differ in both, and 24 curves in one of them."""
    return COLOURS[index % len(COLOURS)], LINES[(index + index // 12) % len(LINES)]


def figure(rows: int = 1, columns: int = 1, width: float = 7.2, height: float = 3.2) -> tuple[Figure, list[Axes]]:
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


def as_svg(drawn: Figure, label: str) -> str:
    """The figure as an inline SVG element with `label` as its text alternative."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    buffer = io.StringIO()
    for axes in drawn.axes:
        legend = axes.get_legend()
        for words in (axes.title, *(legend.get_texts() if legend else ())):
            words.set_parse_math(False)  # a joint's name is no formula
    # the bytes that `savefig` writes, which draws all of it once more before
    canvas = FigureCanvasSVG(drawn)
    canvas.print_svg(buffer, metadata={"Date": None, "Creator": None})  # type: ignore[no-untyped-call]
    text = buffer.getvalue()
    # Several SVGs share one page: their ids must not meet.
    prefix = re.sub(r"[^a-z0-9]+", "-", label.lower()).strip("-")
    text = re.sub(r'\bid="', f'id="{prefix}-', text)
    text = re.sub(r'(xlink:href="#|url\(#)', rf"\g<1>{prefix}-", text)
    start = text.index("<svg")
    return text[start:].replace("<svg ", f'<svg role="img" aria-label="{escape(label)}" ', 1)


def band(axes: Axes, interval: Sequence[float], colour: str, label: str) -> None:
    """A horizontal interval across the axes, as Figs. 13 and 14 show the inverse result."""
    axes.axhspan(interval[0], interval[1], color=colour, alpha=0.18, linewidth=0, label=label)
