"""UFF58: files of other programs are read, theirs read ours, and a damaged file is refused by name."""

import re
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyuff
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from store.errors import StoreError
from store.exchange.uff import FunctionKind, UffDof, UffFunction, UffModel, read_uff, write_uff
from store.exchange.uff_units import UffQuantity
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
        quantity=UffQuantity.ACCELERATION,
        denominator=UffQuantity.FORCE,
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
    for found, expected in zip(read_uff(tmp_path / "a.unv").functions, written, strict=True):
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
    (found,) = read_uff(tmp_path / "a.unv").functions
    np.testing.assert_array_equal(found.values, values)
    assert found.values.dtype == values.dtype
    assert found.response == written.response


@pytest.mark.parametrize("step", [1 / 4096, 1 / 5120, 0.000244141, 0.5, 1 / 3, 12.0, 5e-7])
def test_the_abscissa_keeps_its_step(tmp_path: Path, step: float) -> None:
    write_uff(tmp_path / "a.unv", [accelerance(step=step, start=-7 * step)])
    (found,) = read_uff(tmp_path / "a.unv").functions
    assert found.step == pytest.approx(step, rel=1e-6)
    assert found.start == pytest.approx(-7 * step, rel=1e-5)
    write_uff(tmp_path / "b.unv", [found])
    (again,) = read_uff(tmp_path / "b.unv").functions
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
    lines[8] = f"{2:10d}{3:10d}{0:10d}{0:13.5e}{0:13.5e}{0:13.5e}"
    lines[13] = "  1.00000e+00  5.00000e+00  1.70000e+00  6.00000e+00  3.00000e+00  7.00000e+00"
    (tmp_path / "b.unv").write_text("\n".join(lines) + "\n")
    with pytest.raises(StoreError, match=r"b\.unv, dataset 1: abscissa is unevenly spaced"):
        read_uff(tmp_path / "b.unv")


UNITS = """    -1
   164
{code:10d}{name:20s}{mode:10d}
  {length}  {force}  1.00000000000000000D+00
  0.00000000000000000D+00
    -1
"""


def units(code: int, length: str = "1.00000000000000000D+00", force: str = "1.00000000000000000D+00") -> bytes:
    return UNITS.format(code=code, name="a description", mode=2, length=length, force=force).encode()


MM, INCH = (
    ("1.00000000000000000D+03", "1.00000000000000000D+03"),
    ("3.93700787401574814D+01", "2.24808943099710480D-01"),
)


@pytest.mark.parametrize(
    ("code", "factors", "expected"), [(5, MM, 1.0), (7, INCH, 0.0254 / 4.4482216152605), (1, (), 1)]
)
def test_values_without_labels_are_in_the_units_of_dataset_164(
    tmp_path: Path, code: int, factors: tuple[str, ...], expected: float
) -> None:
    written = accelerance(unit="", denominator_unit="")
    write_uff(tmp_path / "a.unv", [written])
    (tmp_path / "b.unv").write_bytes(units(code, *factors) + (tmp_path / "a.unv").read_bytes())
    read = read_uff(tmp_path / "b.unv")
    assert read.functions[0].values == pytest.approx(expected * written.values, rel=1e-12)
    assert read.notes == ()


def test_a_coherence_has_no_unit_whatever_its_header_says(tmp_path: Path) -> None:
    """Some programs repeat the data types of the accelerance in the header of its coherence."""
    written = accelerance(kind=FunctionKind.COHERENCE, values=np.array([0.2, 0.9, 1.0]), unit="", denominator_unit="")
    write_uff(tmp_path / "a.unv", [written])
    (tmp_path / "b.unv").write_bytes(units(7, *INCH) + (tmp_path / "a.unv").read_bytes())
    assert read_uff(tmp_path / "b.unv").functions[0].values.tolist() == [0.2, 0.9, 1.0]


def test_units_that_stand_after_the_data_hold_for_them(tmp_path: Path) -> None:
    written = accelerance(unit="", denominator_unit="")
    write_uff(tmp_path / "a.unv", [written])
    (tmp_path / "b.unv").write_bytes((tmp_path / "a.unv").read_bytes() + units(7, *INCH))
    (found,) = read_uff(tmp_path / "b.unv").functions
    assert found.values == pytest.approx(0.0254 / 4.4482216152605 * written.values, rel=1e-12)


def test_units_that_change_within_a_file_hold_for_what_follows_and_leave_what_came_first_in_doubt(
    tmp_path: Path,
) -> None:
    written = accelerance(unit="", denominator_unit="")
    write_uff(tmp_path / "a.unv", [written])
    data, inch, metre = (tmp_path / "a.unv").read_bytes(), units(7, *INCH), units(1)
    (tmp_path / "b.unv").write_bytes(inch + data + metre + data)
    found = [each.values[0] / written.values[0] for each in read_uff(tmp_path / "b.unv").functions]
    assert found == pytest.approx([0.0254 / 4.4482216152605, 1.0])
    (tmp_path / "c.unv").write_bytes(data + inch + data + metre)
    with pytest.raises(StoreError, match=r"c\.unv, dataset 1: the datasets 164 of the file differ"):
        read_uff(tmp_path / "c.unv")


def test_labels_are_taken_before_dataset_164_with_a_note(tmp_path: Path) -> None:
    write_uff(tmp_path / "a.unv", [accelerance(unit="g", denominator_unit="lbf")])
    (tmp_path / "b.unv").write_bytes(units(7, *INCH) + (tmp_path / "a.unv").read_bytes())
    read = read_uff(tmp_path / "b.unv")
    np.testing.assert_array_equal(read.functions[0].values, accelerance().values)
    assert read.notes == ("b.unv: dataset 164 has other units than the labels of the functions; the labels are taken",)


@pytest.mark.parametrize("factors", [MM, ("0.00000000000000000D+00", "1.00000000000000000D+00")])
def test_a_code_that_contradicts_its_factors_matters_only_without_labels(
    tmp_path: Path, factors: tuple[str, str]
) -> None:
    write_uff(tmp_path / "a.unv", [accelerance()])
    (tmp_path / "b.unv").write_bytes(units(1, *factors) + (tmp_path / "a.unv").read_bytes())
    np.testing.assert_array_equal(read_uff(tmp_path / "b.unv").functions[0].values, accelerance().values)
    write_uff(tmp_path / "c.unv", [accelerance(unit="")])
    (tmp_path / "d.unv").write_bytes(units(1, *factors) + (tmp_path / "c.unv").read_bytes())
    with pytest.raises(StoreError, match=r"d\.unv, dataset 2: .*164.*; state the unit in one place"):
        read_uff(tmp_path / "d.unv")


MODEL = UffModel("Träger 1", (0.0, 0.055, 0.156, 0.914), datetime(2026, 3, 1, 12, 0, tzinfo=UTC))


@pytest.mark.parametrize("binary", [True, False])
def test_a_beam_is_drawn_by_other_programs_and_read_back(tmp_path: Path, binary: bool) -> None:
    write_uff(tmp_path / "a.unv", [accelerance()], MODEL, binary=binary)
    header, si, nodes, line, function = pyuff.UFF(str(tmp_path / "a.unv")).read_sets()
    assert [each["type"] for each in (header, si, nodes, line, function)] == [151, 164, 15, 82, 58]
    assert (header["model_name"], header["date_db_created"]) == ("Tr?ger 1", "01-Mar-26")
    assert (si["units_code"], si["length"], si["force"]) == (1, 1.0, 1.0)
    assert nodes["x"] == pytest.approx(MODEL.positions)
    assert (list(nodes["y"]), list(line["nodes"])) == ([0.0] * 4, [1, 2, 3, 4])
    read = read_uff(tmp_path / "a.unv")
    assert read.nodes == {node: pytest.approx((x, 0, 0)) for node, x in enumerate(MODEL.positions, start=1)}
    assert_equal(read.functions[0], accelerance())
    assert read.notes == ()


def test_datasets_without_functions_are_passed_over_with_one_note(tmp_path: Path) -> None:
    write_uff(tmp_path / "a.unv", [accelerance()])
    others = "".join(f"    -1\n{kind:6d}\n no such record\n    -1\n" for kind in (55, 2414, 15, 2411, 2420, 151, 82))
    (tmp_path / "b.unv").write_bytes(others.encode() + (tmp_path / "a.unv").read_bytes())
    read = read_uff(tmp_path / "b.unv")
    assert read.notes == ("b.unv: dataset 15, 55, 2411, 2414, 2420 is passed over",)
    assert read.nodes == {}
    assert_equal(read.functions[0], accelerance())


def test_nodes_in_inches_are_in_metres(tmp_path: Path) -> None:
    nodes = {"type": 2411, "node_nums": [3, 7], "def_cs": [0, 0], "disp_cs": [0, 0], "color": [1, 1]}
    pyuff.UFF(str(tmp_path / "nodes.unv")).write_sets({**nodes, "x": [0.0, 10.0], "y": [0.0, 0.0], "z": [1.0, 1.0]})
    write_uff(tmp_path / "a.unv", [accelerance()])
    parts = units(7, *INCH), (tmp_path / "nodes.unv").read_bytes(), (tmp_path / "a.unv").read_bytes()
    (tmp_path / "b.unv").write_bytes(b"".join(parts))
    assert read_uff(tmp_path / "b.unv").nodes == {
        3: pytest.approx((0, 0, 0.0254)),
        7: pytest.approx((0.254, 0, 0.0254)),
    }


def _with_blanks(content: bytes) -> bytes:
    return b"\r\n".join(line.ljust(80) for line in content.splitlines()) + b"\r\n"


def _with_fortran_exponents(content: bytes) -> bytes:
    head, data = content.split(b"\n", 13)[:13], content.split(b"\n", 13)[13]
    return b"\n".join([*head, data.replace(b"e", b"D")])


def _with_blanks_after_delimiters(content: bytes) -> bytes:
    return content.replace(b"    -1\n", b"    -1   \n")


@pytest.mark.parametrize("quirk", [_with_blanks, _with_fortran_exponents, _with_blanks_after_delimiters])
def test_text_with_the_quirks_of_other_writers_is_read(tmp_path: Path, quirk: Callable[[bytes], bytes]) -> None:
    write_uff(tmp_path / "a.unv", [accelerance()], binary=False)
    (tmp_path / "b.unv").write_bytes(quirk((tmp_path / "a.unv").read_bytes()))
    assert_equal(read_uff(tmp_path / "b.unv").functions[0], accelerance())


@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
def test_binary_data_that_end_with_a_new_line_are_read(tmp_path: Path, end: bytes) -> None:
    write_uff(tmp_path / "a.unv", [accelerance()])
    content = (tmp_path / "a.unv").read_bytes()
    (tmp_path / "b.unv").write_bytes(content[: -len(b"    -1\n")] + end + b"    -1" + end)
    assert_equal(read_uff(tmp_path / "b.unv").functions[0], accelerance())


def test_an_even_axis_that_is_written_out_is_even(tmp_path: Path) -> None:
    # what pyuff writes unless it is told that the axis is even
    axis, values = np.arange(0, 500, 0.3), np.exp(1j * np.arange(0, 500, 0.3))
    dofs = {"rsp_node": 3, "rsp_dir": 2, "ref_node": 1, "ref_dir": 2}
    dataset = {"type": 58, "func_type": 4, **dofs, "x": axis, "data": values}
    dataset |= {"ordinate_spec_data_type": 12, "orddenom_spec_data_type": 13, "abscissa_spec_data_type": 18}
    pyuff.UFF(str(tmp_path / "a.unv")).write_sets(dataset)
    (found,) = read_uff(tmp_path / "a.unv").functions
    assert found.start == 0.0
    assert found.step == pytest.approx(0.3, rel=1e-5)
    assert found.values == pytest.approx(values, rel=1e-9)


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
    said, functions = "", tuple[UffFunction, ...]()
    try:
        functions = read_uff(path).functions
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
    functions = read_uff(recording(f"data/uff/{name}")).functions
    assert len(functions) == count
    first = functions[0]
    assert first.values.shape == (samples,)
    assert 1 / first.step == pytest.approx(rate, rel=1e-5)
    assert (first.unit, str(first.response), first.kind) == (unit, response, FunctionKind.TIME_RESPONSE)


def test_text_and_binary_of_one_vendor_hold_the_same_signal(recording: Recording) -> None:
    folder = recording("data/uff")
    (text,) = read_uff(folder / "Sample_UFF58_ascii.uff").functions
    (binary,) = read_uff(folder / "Sample_UFF58b_bin.uff").functions
    assert text.values == pytest.approx(binary.values, rel=1e-5)


def test_the_accelerances_of_a_real_beam_equal_its_text_files(recording: Recording) -> None:
    folder = recording("data/beam")
    functions = read_uff(folder / "beam_accelerance_derived.uff").functions
    assert [str(function.reference) for function in functions] == ["1+x", "2+x", "3+x"]
    for number, function in enumerate(functions, start=1):
        lines = (folder / f"meas_point_{number}.txt").read_text().split()
        measured = np.array([complex(line.replace("i", "j").strip("()")) for line in lines])
        assert function.values == pytest.approx(measured, rel=1e-9, abs=1e-12)
        assert function.abscissa[-1] == 1000.0


def test_a_moment_and_a_rotation_have_their_own_units(tmp_path: Path) -> None:
    by_moment = accelerance(reference=UffDof(3, "rz"), unit="", denominator_unit="")
    of_rotation = accelerance(response=UffDof(4, "rz"), unit="", denominator_unit="")
    write_uff(tmp_path / "a.unv", [by_moment, of_rotation])
    in_mm = units(10, "1.00000000000000000D+03")
    (tmp_path / "b.unv").write_bytes(in_mm + (tmp_path / "a.unv").read_bytes())
    found = [each.values[0] / by_moment.values[0] for each in read_uff(tmp_path / "b.unv").functions]
    assert found == pytest.approx([1.0, 1.0])  # (mm/s^2)/(N mm), and (rad/s^2)/N


def _in_components(content: bytes, *names: bytes) -> bytes:
    for name in names:
        content = content.replace(b"       NONE         3", b" " + name.rjust(10) + b"         3", 1)
    return content


def test_a_node_number_of_two_components_is_refused(tmp_path: Path) -> None:
    write_uff(tmp_path / "a.unv", [accelerance(), accelerance(reference=UffDof(10, "x"))], binary=False)
    text = (tmp_path / "a.unv").read_bytes()
    (tmp_path / "b.unv").write_bytes(_in_components(text, b"BEAM", b"BEAM"))
    assert len(read_uff(tmp_path / "b.unv").functions) == 2
    (tmp_path / "c.unv").write_bytes(_in_components(text, b"BEAM", b"FIXTURE"))
    with pytest.raises(StoreError, match=r"c\.unv, dataset 2: node 3 belongs to BEAM and to FIXTURE"):
        read_uff(tmp_path / "c.unv")


def test_an_abscissa_of_another_quantity_is_refused(tmp_path: Path) -> None:
    write_uff(tmp_path / "a.unv", [accelerance(abscissa_unit="")], binary=False)
    text = (tmp_path / "a.unv").read_bytes()
    (tmp_path / "b.unv").write_bytes(text.replace(b"\n        18", b"\n        19", 1))
    with pytest.raises(StoreError, match=r"abscissa is of data type 19; export it over frequency \(18\)"):
        read_uff(tmp_path / "b.unv")


def test_zeros_that_fill_the_last_line_are_no_values(tmp_path: Path) -> None:
    write_uff(tmp_path / "a.unv", [accelerance()], binary=False)
    text = (tmp_path / "a.unv").read_bytes()
    last = text.rindex(b"    -1")
    for name, more in (("b", 2 * f"{0:20.11e}"), ("c", f"{0:20.11e}{1:20.11e}")):
        (tmp_path / f"{name}.unv").write_bytes(text[: last - 1] + more.encode() + b"\n" + text[last:])
    assert_equal(read_uff(tmp_path / "b.unv").functions[0], accelerance())
    with pytest.raises(StoreError, match="4 values, the header says 3; correct the number"):
        read_uff(tmp_path / "c.unv")


def test_functions_that_are_not_wanted_spoil_nothing(tmp_path: Path) -> None:
    history = accelerance(np.array([1.0, 2.0]), kind=FunctionKind.TIME_RESPONSE, abscissa_unit="s")
    write_uff(tmp_path / "a.unv", [history, accelerance()], binary=False)
    text = (tmp_path / "a.unv").read_bytes()
    (tmp_path / "b.unv").write_bytes(text.replace(b" 0.5000000000", b" 0.0000000000", 1))
    read = read_uff(tmp_path / "b.unv", (FunctionKind.FREQUENCY_RESPONSE,))
    assert_equal(read.functions[0], accelerance())
    assert read.notes == ("b.unv: function type 1 is passed over",)
