"""direct.csv of a bundle: one row for each steady-state sine point of the elastomer tester."""

import csv
import io
import math
from collections.abc import Collection, Sequence
from dataclasses import astuple, dataclass, fields
from pathlib import Path

from store.errors import StoreError
from store.results.dynamic_stiffness import StoredStiffness
from store.states import CONFIGURATIONS

_MOST_ROWS = 1_000_000_000
_LARGEST = 1e15  # beyond any quantity of a tester, in the units of the table; squares and products are still numbers
SAME_FREQUENCY = 2e-3  # relative; a record is that much off its command at most, and is moved off the mains by more


class UnfitPointError(StoreError):
    """A sine point has no row in the table; `why` is the reason alone, without the point."""

    def __init__(self, order: int, why: str) -> None:
        super().__init__(f"sine point {order} cannot be exported: {why}")
        self.why = why


@dataclass(frozen=True)
class DirectPoint:
    """One row, under the column names of the format.

    Attributes:
        order: the order of measuring; time_s: s since the start.
        stiffness_n_per_m: |k_d|; phase_deg: the loss angle.
        sd_rel: relative standard deviation of the complex stiffness per real and imaginary part.
    """

    order: int
    time_s: float
    specimen: str
    configuration: str
    amplitude_pp_mm: float
    frequency_hz: float
    stiffness_n_per_m: float
    phase_deg: float
    thd_percent: float
    temperature_c: float
    sd_rel: float


COLUMNS = tuple(field.name for field in fields(DirectPoint))
# Lowest value, whether it is allowed, and highest value (not allowed) of each column.
_LIMITS = {
    "order": (1, True, _MOST_ROWS),
    "time_s": (0.0, True, math.inf),
    "amplitude_pp_mm": (0.0, False, _LARGEST),
    "frequency_hz": (0.0, False, _LARGEST),
    "stiffness_n_per_m": (0.0, False, _LARGEST),
    "phase_deg": (-90.0, False, 90.0),
    "thd_percent": (0.0, True, math.inf),
    "temperature_c": (-273.15, False, math.inf),
    "sd_rel": (0.0, False, _LARGEST),
}


def read_direct(path: Path, specimens: Collection[str]) -> tuple[tuple[DirectPoint, ...], tuple[str, ...]]:
    """The rows of a table, and a warning for each column that is unknown.

    Args:
        specimens: names of the joints whose cylinders may be in it.

    Raises:
        StoreError: a column is missing, a value is missing, no number or out of range, an order comes twice,
            or there are no rows; the message names the file, the line and the column.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
        lines = list(csv.reader(io.StringIO(text, newline=""), strict=True))
    except OSError as error:
        raise StoreError(f"{path.name} cannot be read: {error.strerror or error}") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise StoreError(f"{path.name} is not a table of comma-separated text: {error}") from error
    header = [name.strip() for name in lines[0]] if lines else []
    if missing := [name for name in COLUMNS if name not in header]:
        raise StoreError(f"{path.name}, line 1: missing column {', '.join(missing)}")
    if len(set(header)) != len(header):
        raise StoreError(f"{path.name}, line 1: a column comes twice")
    unknown = [name for name in header if name not in COLUMNS]
    points: dict[int, DirectPoint] = {}
    for number, line in enumerate(lines[1:], start=2):
        if not line:
            continue
        where = f"{path.name}, line {number}"
        if len(line) != len(header):
            raise StoreError(f"{where}: {len(line)} values, expected {len(header)}")
        point = _point(dict(zip(header, line, strict=True)), where, specimens)
        if point.order in points:
            raise StoreError(f"{where}: order {point.order} comes twice")
        points[point.order] = point
    if not points:
        raise StoreError(f"{path.name} has no rows; where the tester was not used, leave direct out of setup.json")
    return tuple(points.values()), tuple(f"{path.name}: unknown column {name!r} is ignored" for name in unknown)


def write_direct(path: Path, points: Sequence[DirectPoint]) -> None:
    """Write the rows with all digits."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        writer.writerows(astuple(point) for point in points)


def to_dynamic_stiffness(point: DirectPoint) -> StoredStiffness:
    """The row with k = |k_d| cos d, h = |k_d| sin d (Eqs. 47, 48), and standard errors from `sd_rel`."""
    magnitude, angle = point.stiffness_n_per_m, math.radians(point.phase_deg)
    error = point.sd_rel * magnitude
    stiffness = magnitude * math.cos(angle)
    return StoredStiffness(
        order_number=point.order,
        elapsed=point.time_s,
        specimen=point.specimen,
        configuration=point.configuration,
        amplitude_pp_mm=point.amplitude_pp_mm,
        frequency=point.frequency_hz,
        stiffness=stiffness,
        damping=magnitude * math.sin(angle),
        loss_factor=math.tan(angle),
        magnitude=magnitude,
        loss_angle_deg=point.phase_deg,
        stiffness_se=error,
        damping_se=error,
        # gamma = h/k with equal errors in k and h
        loss_factor_se=point.sd_rel / math.cos(angle) ** 2,
        magnitude_se=error,
        loss_angle_se_deg=math.degrees(point.sd_rel),
        sd_rel=point.sd_rel,
        thd_percent=point.thd_percent,
        temperature_c=point.temperature_c,
    )


def to_direct_point(point: StoredStiffness) -> DirectPoint:
    """The row of a point that was measured or imported.

    Raises UnfitPointError if the point lacks a value that the format needs, or has one that `read_direct` refuses.
    """
    sd_rel = point.sd_rel
    if sd_rel is None and point.stiffness_se is not None:
        sd_rel = point.stiffness_se / point.magnitude
    if sd_rel is None or point.thd_percent is None or point.temperature_c is None:
        needed = {
            "standard error": sd_rel,
            "harmonic distortion": point.thd_percent,
            "temperature": point.temperature_c,
        }
        lacking = [name for name, value in needed.items() if value is None]
        raise UnfitPointError(point.order_number, f"direct.csv needs its {' and '.join(lacking)}")
    # the table has one frequency; that of a record which was made beside a multiple of the mains is the true one
    beside = point.reached_frequency
    if beside is not None and math.isclose(beside, point.frequency, rel_tol=SAME_FREQUENCY):
        beside = None
    row = DirectPoint(
        order=point.order_number,
        time_s=point.elapsed,
        specimen=point.specimen,
        configuration=point.configuration,
        amplitude_pp_mm=point.amplitude_pp_mm,
        frequency_hz=point.frequency if beside is None else round(beside, 3),
        stiffness_n_per_m=point.magnitude,
        phase_deg=point.loss_angle_deg,
        thd_percent=point.thd_percent,
        temperature_c=point.temperature_c,
        sd_rel=sd_rel,
    )
    for name, limits in _LIMITS.items():
        if not _is_within(getattr(row, name), *limits):
            raise UnfitPointError(point.order_number, f"{name} of direct.csv cannot be {getattr(row, name)}")
    return row


def _point(row: dict[str, str], where: str, specimens: Collection[str]) -> DirectPoint:
    if row["specimen"] not in specimens:
        raise StoreError(f"{where}: specimen {row['specimen']!r} is none of the joints {', '.join(specimens)}")
    if row["configuration"] not in CONFIGURATIONS:
        raise StoreError(f"{where}: configuration {row['configuration']!r} is none of {', '.join(CONFIGURATIONS)}")
    numbers = {name: _number(row[name], f"{where}, {name}", *_LIMITS[name]) for name in _LIMITS}
    order = numbers.pop("order")
    if order != int(order):
        raise StoreError(f"{where}, order: {row['order']!r} is not a whole number")
    return DirectPoint(order=int(order), specimen=row["specimen"], configuration=row["configuration"], **numbers)


def _number(text: str, where: str, lowest: float, reached: bool, highest: float) -> float:
    try:
        # Python reads 1_000 as a thousand; in a table it is no number.
        value = float(text if "_" not in text else "")
    except ValueError as error:
        raise StoreError(f"{where}: {text!r} is not a number") from error
    if not math.isfinite(value):
        raise StoreError(f"{where}: {text!r} is not a finite number")
    if not _is_within(value, lowest, reached, highest):
        raise StoreError(f"{where}: {text} is out of range")
    return value


def _is_within(value: float, lowest: float, reached: bool, highest: float) -> bool:
    return (value >= lowest if reached else value > lowest) and value < highest
