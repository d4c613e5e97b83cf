"""Measured curves as a CSV file: a line for each value.

Columns: `part`, `observable`, then `value` for real values or `value_real` and `value_imag` for complex ones,
`deviation` (standard deviation, of real and imaginary part each; `inf` for a value that counts nothing), and a column
for each condition by its name, in SI units. A condition that a curve does not have is left empty in all its lines. A
file that is only to be predicted needs neither values nor deviations.
"""

import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from analysis.errors import AnalysisError
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.prediction import PredictedCurve
from jointlab.errors import JointlabError

OWN = ("part", "observable", "value", "value_real", "value_imag", "deviation")
"""Columns that are no conditions."""
OTHER_SEPARATORS = (";", "\t")
"""Separators of tables that are not read."""


def read_curves(path: Path, *, measured: bool = True) -> tuple[Curve, ...]:
    """Curves of a CSV file, in the order of their first lines.

    Where they need not be `measured` and the file has no values, these are complex zeros that count nothing.

    Raises:
        JointlabError: the file is not such a table, with the line and what is wrong there.
    """
    header, lines = _table(path)
    is_complex, blank = "value_real" in header, not measured and not {"value", "value_real"} & set(header)
    needed = ["part", "observable", "deviation", *(["value_real", "value_imag"] if is_complex else ["value"])]
    missing = [each for each in needed[: 2 if blank else None] if each not in header]
    if missing:
        raise JointlabError(f"{path} has no column {missing[0]!r}; it needs {', '.join(needed)} and conditions")
    groups = dict[tuple[str, str], list[tuple[int, dict[str, str]]]]()
    for number, line in lines:
        groups.setdefault((line["part"], line["observable"]), []).append((number, line))
    if not groups:
        raise JointlabError(f"{path} has no values")
    return tuple(
        _curve(path, part, observable, own, None if blank else is_complex, [each for each in header if each not in OWN])
        for (part, observable), own in groups.items()
    )


def _table(path: Path) -> tuple[list[str], list[tuple[int, dict[str, str]]]]:
    """The header of a CSV file, and its lines by column, each with its number in the file; empty lines are left out.

    Blanks at both ends of a cell are no part of it.
    """
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            reader = csv.reader(file, skipinitialspace=True)
            try:
                rows = [
                    (reader.line_num, [each.strip() for each in cells]) for cells in reader if cells not in ([], [""])
                ]
            except csv.Error as error:
                raise JointlabError(f"{path}, line {reader.line_num}: {error}") from error
    except (OSError, UnicodeDecodeError) as error:
        raise JointlabError(f"{path} cannot be read: {error}") from error
    header = rows[0][1] if rows else []
    if len(header) == 1 and (other := next((each for each in OTHER_SEPARATORS if each in header[0]), None)):
        raise JointlabError(
            f"{path} has {other!r} between its cells; write commas there, and decimal points in numbers"
        )
    if twice := [name for name in header if name and header.count(name) > 1]:
        raise JointlabError(f"{path} has two columns {twice[0]!r}; name each condition once")
    for number, cells in rows[1:]:
        if len(cells) != len(header):
            raise JointlabError(
                f"{path}, line {number} has {len(cells)} cells, and not {len(header)} as the header; write decimal "
                "points, not commas"
            )
    return header, [(number, dict(zip(header, cells, strict=True))) for number, cells in rows[1:]]


def _curve(
    path: Path,
    part: str,
    observable: str,
    lines: list[tuple[int, dict[str, str]]],
    is_complex: bool | None,
    names: list[str],
) -> Curve:
    """One curve; `is_complex` is None where it has no values."""

    def column(name: str) -> np.ndarray:
        found = []
        for number, line in lines:
            try:
                if "_" in line[name]:  # Python would read 1_000 as a thousand
                    raise ValueError
                found.append(float(line[name]))
            except ValueError:
                raise JointlabError(f"{path}, line {number}: {name} is {line[name]!r}, not a number") from None
        return np.array(found)

    # One that is given anywhere is asked for everywhere: a blank cell would drop it for the whole curve.
    given = [name for name in names if any(line[name] for _, line in lines)]
    if is_complex is None:
        values, deviation = np.zeros(len(lines), dtype=complex), np.full(len(lines), np.inf)
    else:
        values = column("value_real") + 1j * column("value_imag") if is_complex else column("value")
        deviation = column("deviation")
    conditions = {name: column(name) for name in given}
    wrong = [*(~np.isfinite(each) for each in (values, *conditions.values())), ~(deviation > 0)]
    places = [np.flatnonzero(each)[0] for each in wrong if np.any(each)]
    try:
        return Curve(observable, part, values, deviation, conditions)
    except AnalysisError as error:
        where = f", line {lines[places[0]][0]}" if places else ""
        raise JointlabError(f"{path}{where}: {error}") from error


def write_predictions(path: Path, found: Sequence[tuple[Curve, PredictedCurve, PredictedCurve]]) -> None:
    """Write what was predicted for each curve, without the effects of a verdict and with them.

    Raises:
        JointlabError: the file cannot be written.
    """
    names = list(dict.fromkeys(name for each, _, _ in found for name in each.conditions))
    columns = ("before_real", "before_imag", "before_deviation", "after_real", "after_imag", "after_deviation")
    try:
        with path.open("w", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            writer.writerow(["part", "observable", *names, *columns])
            for curve, *predictions in found:
                for place in range(curve.values.size):
                    own = [curve.conditions[name][place] if name in curve.conditions else "" for name in names]
                    cells = [
                        number
                        for each in predictions
                        for number in (each.values[place].real, each.values[place].imag, each.deviation[place])
                    ]
                    writer.writerow([curve.part, curve.observable, *own, *cells])
    except OSError as error:
        raise JointlabError(f"{path} cannot be written: {error.strerror or error}") from error
