"""direct.csv: every value back, and a wrong one refused by line and column."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from store.errors import StoreError
from store.exchange.direct_table import (
    COLUMNS,
    DirectPoint,
    read_direct,
    to_direct_point,
    to_dynamic_stiffness,
    write_direct,
)

PROPERTY = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
SPECIMENS = ("I", "II")
POINT = DirectPoint(1, 1.8, "I", "compression", 0.1, 5.0, 2074689.0, 4.7918, 0.176, 21.92, 0.0009604)
HEADER = ",".join(COLUMNS)
LINE = "1,1.8,I,compression,0.1,5,2074689,4.79180,0.176,21.92,0.0009604"


def positive(highest: float = 1e12) -> st.SearchStrategy[float]:
    return st.floats(1e-12, highest, exclude_min=True)


POINTS = st.builds(
    DirectPoint,
    order=st.integers(1, 10**6),
    time_s=st.floats(0, 1e9),
    specimen=st.sampled_from(SPECIMENS),
    configuration=st.sampled_from(["compression", "shear", "angled"]),
    amplitude_pp_mm=positive(),
    frequency_hz=positive(),
    stiffness_n_per_m=positive(),
    phase_deg=st.floats(-89, 89),
    thd_percent=st.floats(0, 1e6),
    temperature_c=st.floats(-200, 1e4),
    sd_rel=positive(1.0),
)


@given(st.lists(POINTS, min_size=1, max_size=5, unique_by=lambda point: point.order))
@PROPERTY
def test_every_value_comes_back_from_the_file_and_from_the_results(tmp_path: Path, points: list[DirectPoint]) -> None:
    write_direct(tmp_path / "direct.csv", points)
    assert read_direct(tmp_path / "direct.csv", SPECIMENS) == (tuple(points), ())
    assert [to_direct_point(to_dynamic_stiffness(point)) for point in points] == points


def test_stiffness_damping_and_loss_factor_follow_from_magnitude_and_angle() -> None:
    found = to_dynamic_stiffness(replace(POINT, stiffness_n_per_m=2.0, phase_deg=30.0, sd_rel=0.01))
    assert (found.stiffness, found.damping, found.loss_factor) == pytest.approx((math.sqrt(3), 1.0, 1 / math.sqrt(3)))
    assert (found.stiffness_se, found.damping_se, found.magnitude_se) == (0.02, 0.02, 0.02)
    # first order: gamma = h/k, so that its error is sd |k_d| / k^2 in units of |k_d|
    assert found.loss_factor_se == pytest.approx(0.02 * 2.0 / 3)
    assert found.loss_angle_se_deg == pytest.approx(math.degrees(0.01))


def test_the_relative_deviation_of_a_measured_point_comes_from_its_standard_error() -> None:
    measured = replace(to_dynamic_stiffness(POINT), sd_rel=None, stiffness_se=2074.689)
    assert to_direct_point(measured).sd_rel == pytest.approx(0.001)


@pytest.mark.parametrize("missing", ["stiffness_se", "thd_percent", "temperature_c"])
def test_a_point_that_lacks_a_value_of_the_format_is_not_exported(missing: str) -> None:
    absent: dict[str, Any] = {missing: None, "sd_rel": None}
    measured = replace(to_dynamic_stiffness(POINT), **absent)
    with pytest.raises(StoreError, match="sine point 1 cannot be exported"):
        to_direct_point(measured)


@pytest.mark.parametrize(
    ("column", "changes"),
    [
        ("phase_deg", {"loss_angle_deg": 174.2}),  # of a force with the wrong sign
        ("phase_deg", {"loss_angle_deg": -90.0}),
        ("time_s", {"elapsed": -0.5}),
        ("sd_rel", {"sd_rel": 0.0}),
    ],
)
def test_a_point_that_could_not_be_read_again_is_not_exported(column: str, changes: dict[str, Any]) -> None:
    measured = replace(to_dynamic_stiffness(POINT), **changes)
    (value,) = changes.values()
    with pytest.raises(StoreError, match=f"sine point 1 cannot be exported: {column} of direct.csv cannot be {value}"):
        to_direct_point(measured)


def test_columns_may_come_in_any_order_and_unknown_ones_are_warned_of(tmp_path: Path) -> None:
    names, values = HEADER.split(",")[::-1], LINE.split(",")[::-1]
    (tmp_path / "direct.csv").write_text(f"{','.join(names)},note\n{','.join(values)},ok\n\n")
    points, warnings = read_direct(tmp_path / "direct.csv", SPECIMENS)
    assert points == (POINT,)
    assert warnings == ("direct.csv: unknown column 'note' is ignored",)


def _with(column: str, value: str) -> Callable[[str], str]:
    def change(line: str) -> str:
        values = line.split(",")
        values[COLUMNS.index(column)] = value
        return ",".join(values)

    return change


@pytest.mark.parametrize(
    ("column", "value", "said"),
    [
        ("stiffness_n_per_m", "nan", "'nan' is not a finite number"),
        ("stiffness_n_per_m", "inf", "'inf' is not a finite number"),
        ("stiffness_n_per_m", "-5", "-5 is out of range"),
        ("stiffness_n_per_m", "", "'' is not a number"),
        ("stiffness_n_per_m", "1_000", "'1_000' is not a number"),
        ("frequency_hz", "0", "0 is out of range"),
        ("frequency_hz", "1e300", "1e300 is out of range"),
        ("stiffness_n_per_m", "1e300", "1e300 is out of range"),
        ("amplitude_pp_mm", "1e300", "1e300 is out of range"),
        ("sd_rel", "1e300", "1e300 is out of range"),
        ("amplitude_pp_mm", "0,1", "12 values, expected 11"),
        ("phase_deg", "90", "90 is out of range"),
        ("temperature_c", "-300", "-300 is out of range"),
        ("sd_rel", "0", "0 is out of range"),
        ("order", "0", "0 is out of range"),
        ("order", "1.5", "'1.5' is not a whole number"),
        ("order", "99999999999", "out of range"),
        ("specimen", "III", "specimen 'III' is none of the joints I, II"),
        ("configuration", "bending", "'bending' is none of compression, shear, angled"),
    ],
)
def test_a_wrong_value_is_refused_by_line_and_column(tmp_path: Path, column: str, value: str, said: str) -> None:
    lines = [HEADER, LINE.replace("1", "7", 1), _with(column, value)(LINE)]
    (tmp_path / "direct.csv").write_text("\n".join(lines))
    with pytest.raises(StoreError, match=f"direct.csv, line 3.*{said}"):
        read_direct(tmp_path / "direct.csv", SPECIMENS)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "line 1: missing column order, time_s"),
        (HEADER, "has no rows; where the tester was not used"),
        (HEADER.replace("amplitude_pp_mm", "amplitude_pp_m") + "\n" + LINE, "missing column amplitude_pp_mm"),
        (f"{HEADER},order\n{LINE},1", "a column comes twice"),
        (f"{HEADER}\n{LINE}\n{LINE}", "line 3: order 1 comes twice"),
        (f"{HEADER}\n{LINE[:-30]}", "line 2"),
        (f'{HEADER}\n"{LINE}', "not a table"),
    ],
)
def test_a_table_that_is_not_whole_is_refused(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "direct.csv").write_text(text)
    with pytest.raises(StoreError, match=f"direct.csv.*{said}"):
        read_direct(tmp_path / "direct.csv", SPECIMENS)


@pytest.mark.parametrize("content", [b"\xff\xfe\x00", b"order\x00"])
def test_bytes_that_are_no_text_are_refused(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "direct.csv").write_bytes(content)
    with pytest.raises(StoreError, match=r"direct\.csv"):
        read_direct(tmp_path / "direct.csv", SPECIMENS)


@given(st.data())
@PROPERTY
def test_any_damaged_table_gives_rows_or_an_error_of_the_store(tmp_path: Path, data: st.DataObject) -> None:
    content = bytearray(f"{HEADER}\n{LINE}\n{LINE.replace('1', '2', 1)}\n".encode())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content) - 1))
        by = data.draw(
            st.one_of(st.binary(max_size=8), st.sampled_from([b",", b"\n", b'"', b"\r", b"nan", b"-", b"e9"]))
        )
        content[at : at + data.draw(st.integers(0, 8))] = by
    path = tmp_path / "direct.csv"
    path.write_bytes(content)
    said = ""
    points: tuple[DirectPoint, ...] = ()
    try:
        points, _ = read_direct(path, SPECIMENS)
    except StoreError as error:
        said = str(error)
    assert points or said.startswith("direct.csv")
    assert all(math.isfinite(to_dynamic_stiffness(point).stiffness) for point in points)


def test_a_point_that_was_measured_beside_the_mains_has_its_true_frequency_in_the_table() -> None:
    measured = to_dynamic_stiffness(replace(POINT, frequency_hz=50.0))
    assert to_direct_point(replace(measured, reached_frequency=49.9999)).frequency_hz == 50.0
    assert to_direct_point(replace(measured, reached_frequency=48.00001)).frequency_hz == 48.0
