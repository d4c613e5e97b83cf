"""Accelerances of one set in a file: complete, in (m/s^2)/N, along positive directions."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from store.dof import StoredDof
from store.errors import StoreError
from store.exchange.accelerance_file import (
    accelerance_functions,
    even_spacing,
    read_accelerance_sets,
    read_accelerances,
)
from store.exchange.uff import UffDof, UffFunction, write_uff
from store.states import SINE
from tests.recordings import Recording

FREQUENCY = np.arange(5) / 2.0
ROWS = np.array([[1, 2j, 3, 4, 5], [6, 7, 8j, 9, 10]], dtype=complex)
OMEGA = 2j * np.pi * FREQUENCY
COHERENCE = np.linspace(0, 1, 10).reshape(2, 5)
INPUTS = (StoredDof(1, "y"), StoredDof(4, "x"))


@pytest.fixture
def functions() -> list[UffFunction]:
    return accelerance_functions(StoredDof(3, "y"), INPUTS, FREQUENCY, ROWS, COHERENCE)


def test_a_set_comes_back(tmp_path: Path, functions: list[UffFunction]) -> None:
    write_uff(tmp_path / "a.unv", functions)
    found = read_accelerances(tmp_path / "a.unv")
    assert (found.response, found.inputs, found.warnings) == (StoredDof(3, "y"), INPUTS, ())
    np.testing.assert_array_equal(found.frequency, FREQUENCY)
    np.testing.assert_array_equal(found.accelerance, ROWS)
    np.testing.assert_array_equal(found.coherence, COHERENCE)


def test_a_set_of_a_shaker_is_that_of_a_hammer_with_the_two_exchanged(tmp_path: Path) -> None:
    shaken = accelerance_functions(StoredDof(3, "y"), INPUTS, FREQUENCY, ROWS, COHERENCE, SINE)
    assert [str(function.reference) for function in shaken] == 4 * ["3+y"]
    assert [str(function.response) for function in shaken[:2]] == ["1+y", "4+x"]
    write_uff(tmp_path / "a.unv", shaken)
    found = read_accelerances(tmp_path / "a.unv", SINE)
    assert (found.response, found.inputs) == (StoredDof(3, "y"), INPUTS)
    np.testing.assert_array_equal(found.accelerance, ROWS)
    np.testing.assert_array_equal(found.coherence, COHERENCE)
    with pytest.raises(StoreError, match=r"response is at 4\+x, the first function's at 1\+y"):
        read_accelerances(tmp_path / "a.unv")


def test_a_shaker_that_moved_is_refused(tmp_path: Path, functions: list[UffFunction]) -> None:
    write_uff(tmp_path / "a.unv", functions)
    with pytest.raises(StoreError, match=r"the shaker is at 4\+x, the first function's at 1\+y"):
        read_accelerances(tmp_path / "a.unv", SINE)


def test_coherence_is_sorted_to_its_rows(tmp_path: Path, functions: list[UffFunction]) -> None:
    write_uff(tmp_path / "a.unv", [*functions[:2], functions[3], functions[2]])
    np.testing.assert_array_equal(read_accelerances(tmp_path / "a.unv").coherence, COHERENCE)


def test_a_set_without_coherence_says_so(tmp_path: Path, functions: list[UffFunction]) -> None:
    write_uff(tmp_path / "a.unv", functions[:2])
    assert read_accelerances(tmp_path / "a.unv").coherence is None


@pytest.mark.parametrize(("response", "reference", "sign"), [(1, 1, 1), (-1, 1, -1), (1, -1, -1), (-1, -1, 1)])
def test_negative_directions_turn_the_sign(
    tmp_path: Path, functions: list[UffFunction], response: int, reference: int, sign: int
) -> None:
    first = replace(functions[0], response=UffDof(3, "y", response), reference=UffDof(1, "y", reference))
    write_uff(tmp_path / "a.unv", [first])
    found = read_accelerances(tmp_path / "a.unv")
    np.testing.assert_array_equal(found.accelerance, sign * ROWS[:1])
    assert found.inputs == INPUTS[:1]


@pytest.mark.parametrize(
    ("unit", "denominator"),
    [
        ("m/s2", "N"),
        ("M/S^2", "n"),
        ("", ""),
        ("(m/s^2)/N", ""),
        ("m / s**2", "N"),
        ("m s^-2", "N"),
        ("M S-2", "N"),
        ("m*s**-2", "N"),
        ("(m s^-2)/N", ""),
        ("m s^-2/N", ""),
    ],
)
def test_the_usual_spellings_of_the_unit_are_read(
    tmp_path: Path, functions: list[UffFunction], unit: str, denominator: str
) -> None:
    write_uff(tmp_path / "a.unv", [replace(functions[0], unit=unit, denominator_unit=denominator)])
    assert read_accelerances(tmp_path / "a.unv").inputs == INPUTS[:1]


@pytest.mark.parametrize(
    ("change", "factor"),
    [
        ({"unit": "g"}, 9.80665),
        ({"unit": "g/N", "denominator_unit": ""}, 9.80665),
        ({"unit": "g", "denominator_unit": "lbf"}, 9.80665 / 4.4482216152605),
        ({"unit": "mm/s^2", "denominator_unit": "kN"}, 1e-6),
        ({"unit": "in/s**2", "denominator_unit": "mN"}, 25.4),
        ({"unit": "mm s^-2", "denominator_unit": "kN"}, 1e-6),
        ({"unit": "1/kg", "denominator_unit": ""}, 1.0),
        ({"unit": "[m/s2]", "denominator": 9, "denominator_unit": ""}, 1.0),
        ({"unit": "m/s", "quantity": 11}, OMEGA),
        ({"unit": "mm/s", "quantity": 1}, 1e-3 * OMEGA),
        ({"unit": "m/s/N", "denominator_unit": "", "quantity": 11}, OMEGA),
        ({"unit": "m", "quantity": 8}, OMEGA**2),
        ({"unit": "um", "quantity": 0}, 1e-6 * OMEGA**2),
        ({"unit": "", "denominator_unit": "", "quantity": 8}, OMEGA**2),
    ],
)
def test_other_units_mobility_and_receptance_are_converted(
    tmp_path: Path, functions: list[UffFunction], change: dict[str, Any], factor: Any
) -> None:
    write_uff(tmp_path / "a.unv", [replace(each, **change) for each in functions[:2]])
    found = read_accelerances(tmp_path / "a.unv")
    assert found.accelerance == pytest.approx(factor * ROWS, rel=1e-12)
    converted = {11: "mobility", 8: "receptance", 1: "mobility", 0: "receptance"}.get(change.get("quantity", 12))
    assert found.warnings == ((f"a.unv: {converted} is converted to accelerance",) if converted else ())


def test_a_window_that_records_carry_counts_in_the_conversion(tmp_path: Path, functions: list[UffFunction]) -> None:
    write_uff(tmp_path / "a.unv", [replace(each, unit="m", quantity=8) for each in functions[:2]])
    found = read_accelerances(tmp_path / "a.unv", decay=7.0)
    assert found.accelerance == pytest.approx((7.0 + OMEGA) ** 2 * ROWS, rel=1e-12)


@pytest.mark.parametrize("label", ["m/s\xb2", "µm/s²"])
def test_letters_that_are_no_utf_8_are_understood(tmp_path: Path, functions: list[UffFunction], label: str) -> None:
    write_uff(tmp_path / "a.unv", [replace(functions[0], unit="LABEL")], binary=False)
    content = (tmp_path / "a.unv").read_bytes()
    (tmp_path / "a.unv").write_bytes(content.replace(b"LABEL".ljust(20), label.encode("latin-1").ljust(20)))
    factor = 1e-6 if label.startswith("µ") else 1.0
    assert read_accelerances(tmp_path / "a.unv").accelerance == pytest.approx(factor * ROWS[:1], rel=1e-12)


def test_a_file_across_the_beam_in_z_is_read_as_y_with_a_note(tmp_path: Path, functions: list[UffFunction]) -> None:
    turned = [
        replace(functions[0], response=UffDof(3, "z"), reference=UffDof(1, "z", -1)),
        replace(functions[1], response=UffDof(3, "z"), reference=UffDof(4, "ry")),
    ]
    write_uff(tmp_path / "a.unv", turned)
    found = read_accelerances(tmp_path / "a.unv")
    assert (found.response, found.inputs) == (StoredDof(3, "y"), (StoredDof(1, "y"), StoredDof(4, "r")))
    np.testing.assert_array_equal(found.accelerance, -ROWS)
    assert found.warnings == ("a.unv: direction z is read as y, across the beam",)


def test_each_accelerometer_is_a_set_of_its_own(tmp_path: Path, functions: list[UffFunction]) -> None:
    other = accelerance_functions(StoredDof(5, "x"), INPUTS, 2 * FREQUENCY, 3 * ROWS, COHERENCE)
    write_uff(tmp_path / "a.unv", [*functions[:2], *other, *functions[2:]])
    first, second = read_accelerance_sets(tmp_path / "a.unv")
    assert (first.response, second.response) == (StoredDof(3, "y"), StoredDof(5, "x"))
    assert first.inputs == second.inputs == INPUTS
    np.testing.assert_array_equal(second.accelerance, 3 * ROWS)
    np.testing.assert_array_equal(second.frequency, 2 * FREQUENCY)
    np.testing.assert_array_equal(first.coherence, COHERENCE)


def test_levels_of_one_export_are_sets_one_after_the_other(tmp_path: Path, functions: list[UffFunction]) -> None:
    louder = accelerance_functions(StoredDof(3, "y"), INPUTS, FREQUENCY, 2 * ROWS, COHERENCE)
    write_uff(tmp_path / "a.unv", [*functions, *louder])
    first, second = read_accelerance_sets(tmp_path / "a.unv")
    assert first.inputs == second.inputs == INPUTS
    np.testing.assert_array_equal(second.accelerance, 2 * first.accelerance)
    write_uff(tmp_path / "b.unv", [*functions, louder[0]])
    with pytest.raises(StoreError, match="an input comes twice among 1y, 4x, 1y; export each point once"):
        read_accelerance_sets(tmp_path / "b.unv")


def test_a_roving_accelerometer_is_read_by_reciprocity(tmp_path: Path) -> None:
    roving = accelerance_functions(StoredDof(3, "y"), INPUTS, FREQUENCY, ROWS, COHERENCE, SINE)
    write_uff(tmp_path / "a.unv", roving)
    (found,) = read_accelerance_sets(tmp_path / "a.unv")
    assert (found.response, found.inputs) == (StoredDof(3, "y"), INPUTS)
    np.testing.assert_array_equal(found.accelerance, ROWS)
    np.testing.assert_array_equal(found.coherence, COHERENCE)
    assert found.warnings == ("a.unv: the accelerometer roves; by reciprocity it is taken to be where the force is",)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"unit": "V"}, "unit is V per N; export acceleration, velocity or displacement over force"),
        ({"denominator_unit": "m"}, "unit is m/s.2 per m"),
        ({"unit": "mm"}, r"unit mm contradicts data type 12 \(acceleration\); correct one of them"),
        ({"unit": "", "quantity": 0}, "unit is type 0 per N"),
        ({"abscissa_unit": "rad/s"}, "frequency is in 'rad/s'; export it in Hz"),
        ({"values": np.ones(4, complex)}, "4 lines, the first function has 5"),
        ({"values": np.ones(5)}, "is real"),
        ({"values": np.ones(5, complex)}, "imaginary part is zero on all lines; export complex values"),
        ({"step": 1.0}, "frequencies differ"),
        ({"start": 0.5}, "frequencies differ"),
        ({"response": UffDof(7, "y")}, "response is at 7.y"),
        ({"reference": UffDof(1, "z")}, r"1\+z is no point of the beam; number nodes .* directions of one plane"),
        ({"reference": UffDof(0, "y")}, "is no point of the beam"),
        ({"reference": UffDof(5)}, r"5\+scalar is no point of the beam"),
        ({"reference": UffDof(1, "y")}, "an input comes twice"),
    ],
)
def test_a_row_that_does_not_belong_is_refused_by_file_and_point(
    tmp_path: Path, functions: list[UffFunction], change: dict[str, Any], said: str
) -> None:
    write_uff(tmp_path / "set.unv", [functions[0], replace(functions[1], **change)])
    with pytest.raises(StoreError, match=f"set.unv.*{said}"):
        read_accelerances(tmp_path / "set.unv")


@pytest.mark.parametrize(
    ("select", "said"),
    [
        (lambda f: f[2:], "holds no frequency response"),
        (lambda f: f[:3], "coherence is there for 1y; expected once for each of 1y, 4x"),
        (lambda f: [*f[:2], f[2], f[2]], "coherence is there for 1y, 1y"),
        (lambda f: [*f[:3], replace(f[3], values=1.1 * f[3].values)], "coherence ranges"),
        (lambda f: [*f[:3], replace(f[3], values=f[3].values + 0j)], "coherence is complex"),
    ],
)
def test_a_set_that_is_not_whole_is_refused(
    tmp_path: Path, functions: list[UffFunction], select: Callable[[list[UffFunction]], list[UffFunction]], said: str
) -> None:
    write_uff(tmp_path / "set.unv", select(functions))
    with pytest.raises(StoreError, match=f"set.unv.*{said}"):
        read_accelerances(tmp_path / "set.unv")


def test_other_functions_are_passed_over_with_a_warning(tmp_path: Path, functions: list[UffFunction]) -> None:
    write_uff(tmp_path / "a.unv", [*functions, replace(functions[2], kind=2)])
    assert read_accelerances(tmp_path / "a.unv").warnings == ("a.unv: function type 2 is passed over",)


@pytest.mark.parametrize("frequency", [np.array([0.0, 1.0, 2.1]), np.array([0.0, 1.0, 1.0]), np.array([5.0])])
def test_an_axis_that_uff_cannot_hold_is_refused(frequency: np.ndarray[tuple[int], np.dtype[np.float64]]) -> None:
    with pytest.raises(StoreError, match="spac"):
        even_spacing(frequency)


def test_a_computed_axis_is_even() -> None:
    assert even_spacing(np.asarray(np.fft.rfftfreq(10_000, 1 / 5120), np.float64)) == pytest.approx(
        (0.0, 0.512), rel=1e-14
    )


def test_a_real_beam_is_read_as_one_set(recording: Recording) -> None:
    found = read_accelerances(recording("data/beam/beam_accelerance_derived.uff"))
    assert found.inputs == (StoredDof(1, "x"), StoredDof(2, "x"), StoredDof(3, "x"))
    assert found.accelerance.shape == (3, 1001)
    assert found.coherence is None
