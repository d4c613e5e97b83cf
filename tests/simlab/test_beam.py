import numpy as np
import pytest
from scipy.optimize import brentq

from simlab.beam import SimulatedBeam, free_modes


def timoshenko_determinant(frequency: float, beam: SimulatedBeam) -> float:
    """Free ends' conditions of the closed-form Timoshenko solution; zero at a natural frequency."""
    omega = 2 * np.pi * frequency
    second_moment = beam.width * beam.height**3 / 12
    bending = beam.youngs_modulus * second_moment
    correction = 10 * (1 + beam.poisson_ratio) / (12 + 11 * beam.poisson_ratio)
    shear = correction * beam.area * beam.youngs_modulus / (2 * (1 + beam.poisson_ratio))
    mass, rotary = beam.density * beam.area * omega**2, beam.density * second_moment * omega**2
    # (shear p^2 + mass)(bending p^2 - shear + rotary) + shear^2 p^2 = 0 for y ~ exp(p x)
    squares = np.roots([shear * bending, shear * rotary + mass * bending, mass * (rotary - shear)])
    exponents = np.concatenate([np.sqrt(squares.astype(complex)), -np.sqrt(squares.astype(complex))])
    rotation = (shear * exponents**2 + mass) / (shear * exponents)
    left, right = np.ones(4), np.exp(exponents * beam.length)
    rows = [row * end for end in (left, right) for row in (exponents * rotation, exponents - rotation)]
    # imaginary, since one pair of exponents is; columns scaled so that the growing exponential does not drown the rest
    return float(np.linalg.det(np.array(rows) / np.maximum(1.0, np.abs(right))).imag)


def test_the_free_beam_rings_at_the_exact_timoshenko_frequencies() -> None:
    beam = SimulatedBeam()
    modes = free_modes(beam)
    for frequency in (160.0, 439.0, 854.0, 1398.0, 2064.0):
        exact = brentq(timoshenko_determinant, 0.995 * frequency, 1.005 * frequency, args=(beam,), xtol=1e-9)
        assert np.min(np.abs(modes.frequency - exact)) < 1e-4


def test_ten_cubic_elements_stand_up_to_a_fifth_of_a_per_cent_above_the_exact_bar() -> None:
    """Table 1's frequencies are those of ten elements; the bench is exact, so it lies below, more for higher modes."""
    table_1 = np.array([160.06, 439.13, 855.68])
    excess = table_1 / free_modes(SimulatedBeam()).frequency[3:6] - 1
    assert np.all(np.diff(excess) > 0)
    assert np.all((excess > 0) & (excess < 0.002))


def test_out_of_plane_the_beam_rings_near_320_and_880_hz() -> None:
    across = free_modes(SimulatedBeam().on_edge()).frequency
    np.testing.assert_allclose(across[3:5], [320.0, 880.0], rtol=0.03)


def test_the_rod_rings_at_whole_half_waves() -> None:
    beam = SimulatedBeam()
    speed = np.sqrt(beam.youngs_modulus / beam.density)
    modes = free_modes(beam)
    axial = modes.frequency[np.abs(modes.series["x"]).max(axis=(0, 1)) > 1e-6]
    np.testing.assert_allclose(axial[:4], [n * speed / (2 * beam.length) for n in range(4)], rtol=1e-9, atol=1e-9)


def test_the_three_rigid_modes_carry_the_whole_mass_of_the_bar() -> None:
    beam = SimulatedBeam()
    modes = free_modes(beam)
    assert np.all(modes.angular_frequency[:3] == 0.0)
    assert modes.angular_frequency[3] > 0.0
    middle = beam.length / 2
    for direction in "xy":
        effective = 1.0 / np.sum(modes.shape(direction, middle)[:3] ** 2)
        assert effective == pytest.approx(beam.mass, rel=1e-9)


def test_rotation_is_the_slope_less_the_shear_in_bending_and_nothing_in_the_rod() -> None:
    modes = free_modes(SimulatedBeam())
    first = 3
    step = 1e-5
    slope = (modes.shape("y", 0.3 + step)[first] - modes.shape("y", 0.3 - step)[first]) / (2 * step)
    assert modes.shape("r", 0.3)[first] == pytest.approx(slope, rel=0.01)
    axial = np.abs(modes.series["x"]).max(axis=(0, 1)) > 1e-6
    assert not modes.shape("r", 0.3)[axial].any()


@pytest.mark.parametrize("position", [-1e-3, 0.92])
def test_a_position_off_the_beam_is_refused(position: float) -> None:
    with pytest.raises(ValueError, match="off the beam"):
        free_modes(SimulatedBeam()).shape("y", position)


def test_kinks_change_no_mode_and_break_no_shape() -> None:
    whole = free_modes(SimulatedBeam())
    apart = free_modes(SimulatedBeam(terms=24, kinks=(0.06, 0.16, 0.85)))
    low = whole.frequency < 8000.0
    np.testing.assert_allclose(apart.frequency[: low.sum()], whole.frequency[low], rtol=1e-6, atol=1e-3)
    for direction in "xyr":
        left, right = (apart.shape(direction, 0.16 + side) for side in (0.0, 1e-12))
        np.testing.assert_allclose(left, right, atol=1e-8 * np.abs(apart.series[direction]).max())
