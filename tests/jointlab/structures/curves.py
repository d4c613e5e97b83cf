"""CSV files of curves for tests."""

import csv
from collections.abc import Sequence
from pathlib import Path

from analysis.gap.structures.curve import Curve


def write_curves(path: Path, curves: Sequence[Curve]) -> None:
    """Write curves so that `read_curves` gives them again."""
    is_complex = any(each.is_complex for each in curves)
    names = list(dict.fromkeys(name for each in curves for name in each.conditions))
    columns = ["value_real", "value_imag"] if is_complex else ["value"]
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["part", "observable", *columns, "deviation", *names])
        for each in curves:
            for place, value in enumerate(each.values):
                parts = [value.real, value.imag] if is_complex else [value]
                own = [each.conditions[name][place] if name in each.conditions else "" for name in names]
                writer.writerow([each.part, each.observable, *parts, each.deviation[place], *own])
