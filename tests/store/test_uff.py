"""UFF58: files of other programs are read, theirs read ours, and a damaged file is refused by name."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from store.errors import StoreError
from store.uff import FunctionKind, Quantity, UffDof, UffFunction, read_uff, write_uff
from tests.recordings import Recording

# The folder of a test function is shared by its examples, which overwrite one file.
PROPERTY = settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def accelerance(values: NDArray[Any] | None = None, **changes: Any) -> UffFunction:
    whole = UffFunction(
        kind=FunctionKind.FREQUENCY_RESPONSE,
        response=UffDof(3, "y", -1),
        reference=UffDof(11, "x"),
        start=0.0,
        step=0.5,
        values=np.array([1 + 2j, 3.25, -4e-9j]) if values is None else values,
        abscissa_unit="Hz",
        unit="m/s^2",
        denominator_unit="N",
        quantity=Quantity.ACCELERATION,
        denominator=Quantity.FORCE,
        name="accelerance",
    )
    return replace(whole, **changes)


def assert_equal(found: UffFunction, expected: UffFunction) -> None:
    np.testing.assert_array_equal(found.values, expected.values)
    assert replace(found, values=expected.values).__dict__ == expected.__dict__


@pytest.mark.parametrize("binary", [True, False])
def test_a_function_comes_back_with_all_that_was_written(tmp_path: Path, binary: bool) -> None:
    written = [accelerance(), accelerance(np.array([0.5, 1.0]), kind=6, unit="", denominator_unit="", name="coherence")]
    write_uff(tmp_path / "a.unv", written, binary=binary)
    for found, expected in zip(read_uff(tmp_path / "a.unv"), written, strict=True):
        assert_equal(found, expected)


FINITE = st.floats(allow_nan=False, allow_infinity=False)


@given(
    values=st.one_of(
        hnp.arrays(np.float64, st.integers(1, 50), elements=FINITE),
        hnp.arrays(
            np.complex128, st.integers(1, 50), elements=st.complex_numbers(allow_nan=False, allow_infinity=False)
        ),
    ),
    axis=st.sampled_from(["x", "y", "z", "rx", "ry", "rz"]),
    sign=st.sampled_from([-1, 1]),
    node=st.integers(1, 99_999),
)
@PROPERTY
def test_binary_keeps_every_value(tmp_path: Path, values: NDArray[Any], axis: str, sign: int, node: int) -> None:
    written = accelerance(values, response=UffDof(node, axis, sign))
    write_uff(tmp_path / "a.unv", [written])
    (found,) = read_uff(tmp_path / "a.unv")
    np.testing.assert_array_equal(found.values, values)
    assert found.values.dtype == values.dtype
    assert found.response == written.response


@pytest.mark.parametrize("step", [1 / 4096, 1 / 5120, 0.000244141, 0.5, 1 / 3, 12.0, 5e-7])
def test_the_abscissa_keeps_its_step(tmp_path: Path, step: float) -> None:
    write_uff(tmp_path / "a.unv", [accelerance(step=step, start=-7 * step)])
    (found,) = read_uff(tmp_path / "a.unv")
    assert found.step == pytest.approx(step, rel=1e-6)
    assert found.start == pytest.approx(-7 * step, rel=1e-5)
    write_uff(tmp_path / "b.unv", [found])
    (again,) = read_uff(tmp_path / "b.unv")
    assert (again.start, again.step) == (found.start, found.step)


def test_the_header_of_binary_data_counts_its_bytes_and_writes_decimal_points(tmp_path: Path) -> None:
    write_uff(tmp_path / "a.unv", [accelerance(step=1.0)])
    lines = (tmp_path / "a.unv").read_bytes().split(b"\n")
    assert int(lines[1][31:43]) == 3 * 16
    assert lines[8].split() == [b"6", b"3", b"1", b"0.0000000000", b"1.0000000000", b"0.00000e+00"]
    assert len(lines[8]) == 3 * 10 + 3 * 13


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_values_that_are_not_finite_are_not_written(tmp_path: Path, bad: float) -> None:
    with pytest.raises(StoreError, match="not finite"):
        write_uff(tmp_path / "a.unv", [accelerance(np.array([1.0, bad]))])
    assert not (tmp_path / "a.unv").exists()


@pytest.mark.parametrize("name", ["x" * 81, "naïve", "two\nlines"])
def test_a_name_that_would_break_the_header_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(StoreError, match="does not fit"):
        write_uff(tmp_path / "a.unv", [accelerance(name=name)])


def _replace(pattern: bytes, by: bytes) -> Callable[[bytes], bytes]:
    def change(content: bytes) -> bytes:
        changed, count = re.subn(pattern, by, content, count=1)
        assert count == 1
        return changed

    return change


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda content: b"", "not a UFF file"),
        (lambda content: b"point;value\n1;2\n", "not a UFF file"),
        (lambda content: content[: len(content) // 2], "cut short"),
        (lambda content: content[:-30], "cut short"),
        (_replace(rb"         3         1 0\.0", b"         9         1 0.0"), "3 values, the header says 9"),
        (_replace(rb" 0\.5000000000", b"-0.500000000"), "step -0.5"),
        (_replace(rb" 0\.5000000000", b"         nan "), "step nan"),
        (_replace(rb"3\.25000000000e\+00", b"              nan"), "value 2 is not a finite number"),
        (_replace(rb"3\.25000000000e\+00", b"3.2500x000000e+00"), "damaged or not a UFF file"),
        (_replace(rb"  -2       NONE        11", b"   7       NONE        11"), "response direction 7 is unknown"),
        (_replace(rb"         6         3", b"         3         3"), "damaged|data type 3"),
        (lambda content: content.replace(b"    58", b"    15", 1), "holds no function|damaged"),
    ],
)
def test_a_damaged_text_file_is_refused_by_name_and_cause(
    tmp_path: Path, change: Callable[[bytes], bytes], said: str
) -> None:
    path = tmp_path / "set.unv"
    write_uff(path, [accelerance()], binary=False)
    path.write_bytes(change(path.read_bytes()))
    with pytest.raises(StoreError, match=f"set.unv.*({said})"):
        read_uff(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(StoreError, match=r"gone\.unv cannot be read: No such file"):
        read_uff(tmp_path / "gone.unv")


def test_an_uneven_abscissa_is_refused(tmp_path: Path) -> None:
    write_uff(tmp_path / "a.unv", [accelerance(np.array([1.0, 2.0]))], binary=False)
    lines = (tmp_path / "a.unv").read_text().splitlines()
    lines[8] = f"{2:10d}{2:10d}{0:10d}{0:13.5e}{0:13.5e}{0:13.5e}"
    lines[13] = "  1.00000e+00  5.00000e+00  1.70000e+00  6.00000e+00"
    (tmp_path / "b.unv").write_text("\n".join(lines) + "\n")
    with pytest.raises(StoreError, match=r"b\.unv, dataset 1: abscissa is unevenly spaced"):
        read_uff(tmp_path / "b.unv")


UNITS = """    -1
   164
{code:10d}{name:20s}{mode:10d}
  1.00000000000000000D+00  1.00000000000000000D+00  1.00000000000000000D+00
  0.00000000000000000D+00
    -1
"""


def test_a_file_in_other_units_than_si_is_refused_by_its_units_dataset(tmp_path: Path) -> None:
    write_uff(tmp_path / "a.unv", [accelerance()])
    content = (tmp_path / "a.unv").read_bytes()
    (tmp_path / "b.unv").write_bytes(UNITS.format(code=5, name="mm (milli-newton)", mode=2).encode() + content)
    with pytest.raises(StoreError, match=r"b\.unv, dataset 1: the file is in units code 5, expected 1 \(SI\)"):
        read_uff(tmp_path / "b.unv")
    (tmp_path / "c.unv").write_bytes(UNITS.format(code=1, name="SI - mks (Newton)", mode=2).encode() + content)
    assert len(read_uff(tmp_path / "c.unv")) == 1


@given(st.data())
@PROPERTY
def test_any_damaged_file_gives_functions_or_an_error_of_the_store(tmp_path: Path, data: st.DataObject) -> None:
    path = tmp_path / "a.unv"
    write_uff(path, [accelerance(), accelerance()], binary=data.draw(st.booleans(), label="binary"))
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4), label="changes")):
        at = data.draw(st.integers(0, len(content) - 1), label="at")
        length = data.draw(st.integers(0, 12), label="length")
        content[at : at + length] = data.draw(st.binary(max_size=12), label="by")
    path.write_bytes(content[: data.draw(st.integers(0, len(content)), label="cut")])
    said, functions = "", []
    try:
        functions = read_uff(path)
    except StoreError as error:
        said = str(error)
    assert functions or re.fullmatch(r"a\.unv.*", said)
    assert all(np.all(np.isfinite(function.values)) and function.step > 0 for function in functions)


@given(st.binary(max_size=300))
@PROPERTY
def test_bytes_that_are_no_uff_give_an_error_of_the_store(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.unv"
    for whole in (content, b"    -1\n    58\n" + content + b"\n    -1\n"):
        path.write_bytes(whole)
        with pytest.raises(StoreError, match=r"a\.unv"):
            read_uff(path)


@pytest.mark.parametrize(
    ("name", "count", "samples", "rate", "unit", "response"),
    [
        ("Sample_UFF58_ascii.uff", 1, 79_292, 65_536.0, "Pa", "0+x"),
        ("Sample_UFF58b_bin.uff", 1, 79_292, 65_536.0, "Pa", "0+x"),
        ("accelerometers_4ch.uff", 4, 222_400, 3200.0, "m/s2", "1+z"),
    ],
)
def test_files_of_other_vendors_are_read(
    recording: Recording, name: str, count: int, samples: int, rate: float, unit: str, response: str
) -> None:
    functions = read_uff(recording(f"data/uff/{name}"))
    assert len(functions) == count
    first = functions[0]
    assert first.values.shape == (samples,)
    assert 1 / first.step == pytest.approx(rate, rel=1e-5)
    assert (first.unit, str(first.response), first.kind) == (unit, response, FunctionKind.TIME_RESPONSE)


def test_text_and_binary_of_one_vendor_hold_the_same_signal(recording: Recording) -> None:
    folder = recording("data/uff")
    (text,) = read_uff(folder / "Sample_UFF58_ascii.uff")
    (binary,) = read_uff(folder / "Sample_UFF58b_bin.uff")
    assert text.values == pytest.approx(binary.values, rel=1e-5)


def test_the_accelerances_of_a_real_beam_equal_its_text_files(recording: Recording) -> None:
    folder = recording("data/beam")
    functions = read_uff(folder / "beam_accelerance_derived.uff")
    assert [str(function.reference) for function in functions] == ["1+x", "2+x", "3+x"]
    for number, function in enumerate(functions, start=1):
        lines = (folder / f"meas_point_{number}.txt").read_text().split()
        measured = np.array([complex(line.replace("i", "j").strip("()")) for line in lines])
        assert function.values == pytest.approx(measured, rel=1e-9, abs=1e-12)
        assert function.abscissa[-1] == 1000.0
