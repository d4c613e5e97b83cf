"""Pictures of a trial: claimed against true probability of verdicts, and named against true effects."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from jointlab.report.plots import BLUE, GREEN, MEASURED, ORANGE, as_svg, figure

CELL = 0.19
"""Side of a cell of the confusion table, inches."""
RIGHT = {"in no catalogue": "unknown"}
"""The right answer for effects that have no name in the catalogue."""


def reliability(summary: Mapping[str, Any]) -> str:
    """Claimed probabilities of effects and of verdicts against the share that holds; a dot's size is their number."""
    picture, (axes,) = figure(width=4.6, height=4.0)
    axes.plot([0, 1], [0, 1], "--", color=MEASURED, linewidth=0.8, label="as claimed")
    for title, name, colour in (
        ("effects", "inclusion_calibration", BLUE),
        ("verdicts", "verdict_calibration", ORANGE),
    ):
        bins, error = summary[name]["bins"], summary[name]["error"]
        axes.scatter(
            [each["claimed"] for each in bins],
            [each["right"] for each in bins],
            [20 + 3 * each["cases"] for each in bins],
            color=colour,
            alpha=0.6,
            label=title if error is None else f"{title}, error {error:.3f}",
        )
    axes.set(xlabel="probability claimed", ylabel="share that holds", xlim=(0, 1.03), ylim=(0, 1.03))
    axes.legend(frameon=False, loc="upper left", fontsize=8)
    return as_svg(picture, "Reliability of verdicts")


def confusion(table: Mapping[str, Any]) -> str:
    """True effects, row by row, against named ones: counts, right ones in one colour, wrong ones in another."""
    there, named = table["there"], table["named"]
    counts = np.array(table["counts"], dtype=int).reshape(len(there), len(named))
    right = np.array([[column == RIGHT.get(row, row) for column in named] for row in there]).reshape(counts.shape)
    picture, (axes,) = figure(width=2.8 + CELL * len(named), height=2.2 + CELL * max(len(there), 1))
    from matplotlib.colors import ListedColormap  # an extra, which is there where `figure` draws

    if counts.size:
        colour = np.ma.masked_where(counts == 0, np.where(right, 0, 1))
        axes.pcolormesh(colour, cmap=ListedColormap([GREEN, ORANGE]), vmin=0, vmax=1, alpha=0.55)
    for row, column in np.argwhere(counts):
        axes.text(column + 0.5, row + 0.5, str(counts[row, column]), ha="center", va="center", fontsize=6.5)
    axes.set_xticks(np.arange(len(named)) + 0.5, [_words(each) for each in named], rotation=90, fontsize=6.5)
    axes.set_yticks(np.arange(len(there)) + 0.5, [_words(each) for each in there], fontsize=6.5)
    axes.invert_yaxis()
    axes.set(xlabel="named", ylabel="there")
    return as_svg(picture, "What was named for what was there")


def _words(name: str) -> str:
    return name.replace("_", " ")
