import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from analysis.dof import Dof
from analysis.inverse.longitudinal_averaging import averaged, averaged_change

MEASURED = (Dof.parse("1x"), Dof.parse("3y"), Dof.parse("11x"))
angle = st.floats(-np.pi, np.pi)


@given(first=st.floats(0.1, 10), second=st.floats(0.1, 10), phase=angle, apart=st.floats(-3.0, 3.0))
def test_x_components_become_their_mean_magnitude_at_their_mean_phase(
    first: float, second: float, phase: float, apart: float
) -> None:
    shapes = np.array([[first * np.exp(1j * phase), 5j, second * np.exp(1j * (phase + apart))]])
    found = averaged(shapes, MEASURED)[0]
    expected = (first + second) / 2 * np.exp(1j * (phase + apart / 2))
    np.testing.assert_allclose(found, [expected, 5j, expected], rtol=1e-9)


def test_one_x_component_is_left_alone() -> None:
    shapes = np.array([[1 + 1j, 2.0]])
    np.testing.assert_array_equal(averaged(shapes, MEASURED[:2]), shapes)


@given(seed=st.integers(0, 10**6))
def test_the_change_is_the_derivative(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shapes = np.exp(1j * rng.uniform(-1, 1, (2, 3))) * rng.uniform(0.5, 2, (2, 3))
    change = rng.standard_normal((2, 4, 3)) + 1j * rng.standard_normal((2, 4, 3))
    step = 1e-6
    for direction in range(4):
        up, down = (averaged(shapes + sign * step * change[:, direction], MEASURED) for sign in (1, -1))
        found = averaged_change(shapes, change, MEASURED)[:, direction]
        np.testing.assert_allclose(found, (up - down) / (2 * step), atol=1e-7)
