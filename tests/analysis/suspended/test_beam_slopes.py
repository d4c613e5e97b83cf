from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.frequency_response import Real
from analysis.structure.beam import Beam, Mesh, Theory
from analysis.suspended.beam_slopes import PARAMETERS, free_frequencies

STEEL = Beam(0.914, 0.0254, 0.0508, 207e9, 0.3, 7850.0)
BENDING = (3, 4, 5)


def frequencies(beam: Beam, theory: Theory, masses: dict[int, float], places: tuple[int, ...] = BENDING) -> Real:
    mesh = Mesh.through(beam.length * np.array([0.0, 0.06, 0.3, 0.5, 0.77, 1.0]), 2)
    return free_frequencies(beam, mesh, places, theory, masses)[0]


@settings(max_examples=15, deadline=None)
@given(
    slenderness=st.floats(0.01, 0.15),
    poisson_ratio=st.floats(0.0, 0.45),
    theory=st.sampled_from(Theory),
    mass=st.floats(0.0, 0.2),
)
def test_slopes_are_those_of_a_high_order_difference(
    slenderness: float, poisson_ratio: float, theory: Theory, mass: float
) -> None:
    beam = replace(STEEL, height=slenderness * STEEL.length, poisson_ratio=poisson_ratio)
    mesh = Mesh.through(beam.length * np.array([0.0, 0.06, 0.3, 0.5, 0.77, 1.0]), 2)
    masses = {2: mass, 5: mass / 2}
    _, slopes = free_frequencies(beam, mesh, BENDING, theory, masses)
    step = 2e-3
    for column, name in enumerate(PARAMETERS):
        up2, up, down, down2 = (
            np.log(frequencies(replace(beam, **{name: getattr(beam, name) * np.exp(k * step)}), theory, masses))
            for k in (2, 1, -1, -2)
        )
        differences = (8 * (up - down) - (up2 - down2)) / (12 * step)
        np.testing.assert_allclose(slopes[:, column], differences, atol=3e-8)  # rounding of f over the step


def test_the_slopes_of_a_longitudinal_mode_are_those_of_a_rod() -> None:
    mesh = Mesh.through(np.linspace(0, STEEL.length, 11), 2)
    wave = np.sqrt(STEEL.youngs_modulus / STEEL.density) / (2 * STEEL.length)
    places = tuple(range(3, 12))
    found, slopes = free_frequencies(STEEL, mesh, places)
    rod = int(np.argmin(np.abs(found - wave)))
    assert found[rod] == pytest.approx(wave, rel=2e-3)
    np.testing.assert_allclose(slopes[rod], [0.5, -0.5, -1, 0, 0], atol=1e-9)


@settings(max_examples=15, deadline=None)
@given(
    modulus=st.floats(0.3, 3.0),
    density=st.floats(0.3, 3.0),
    length=st.floats(0.5, 2.0),
    height=st.floats(0.5, 2.0),
    width=st.floats(0.5, 2.0),
)
def test_frequencies_of_a_slender_bar_follow_the_root_of_e_by_rho_times_height_by_length_squared(
    modulus: float, density: float, length: float, height: float, width: float
) -> None:
    slender = replace(STEEL, height=1e-3 * STEEL.length)
    other = Beam(
        slender.length * length,
        slender.height * height,
        slender.width * width,
        slender.youngs_modulus * modulus,
        0.3,
        slender.density * density,
    )
    ratio = frequencies(other, Theory.TIMOSHENKO, {}) / frequencies(slender, Theory.TIMOSHENKO, {})
    # shear and rotary inertia lower mode 6 by (h/L)^2 times 34: Timoshenko's first correction
    np.testing.assert_allclose(ratio, np.sqrt(modulus / density) * height / length**2, rtol=6e-4)


def test_shear_and_rotary_inertia_make_a_stocky_bar_follow_its_height_less_than_a_slender_one() -> None:
    mesh = Mesh.through(np.linspace(0, STEEL.length, 11), 2)
    slopes = free_frequencies(STEEL, mesh, BENDING)[1]
    assert np.all(np.diff(slopes[:, 3]) < 0)
    assert 0.95 < slopes[2, 3] < 0.98
    np.testing.assert_allclose(slopes[:, 2] + slopes[:, 3], -1, atol=1e-12)  # of h and L, only h/L and 1/L
    np.testing.assert_allclose(
        free_frequencies(STEEL, mesh, BENDING, Theory.EULER_BERNOULLI)[1], [[0.5, -0.5, -2, 1, 0]] * 3, atol=1e-9
    )
