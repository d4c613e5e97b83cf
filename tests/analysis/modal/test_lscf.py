"""Poles by linear least squares, from responses of known poles."""

import numpy as np
import pytest

from analysis.errors import NoModeError
from analysis.frequency_response import Complex, Real
from analysis.modal.lscf import lscf_poles
from analysis.modes import poles_from

FREQUENCY = np.linspace(0.5, 512, 1024)


def responses(poles: Complex, constants: Complex, frequency: Real = FREQUENCY) -> Complex:
    """Accelerances of viscously damped modes; `constants` (modes, ...) are residues' numerators."""
    laplace = 2j * np.pi * frequency
    units = laplace**2 / ((laplace - poles[:, None]) * (laplace - poles[:, None].conj()))
    return np.tensordot(np.moveaxis(constants, 0, -1), units, axes=1).astype(np.complex128)


def nearest(found: Complex, pole: complex) -> float:
    """Distance of the nearest of `found`, as a fraction of the half bandwidth of `pole`."""
    return float(np.min(np.abs(found - pole))) / -pole.real


POLES = poles_from(np.array([60.0, 150.0, 310.0]), np.array([0.05, 0.02, 0.01]))


@pytest.mark.parametrize("frequency", [FREQUENCY, np.sort(np.random.default_rng(0).uniform(5, 512, 800))])
def test_exact_poles_are_found_on_even_and_on_uneven_lines(frequency: Real) -> None:
    constants = np.random.default_rng(1).standard_normal((3, 5))
    response = responses(POLES, constants.astype(np.complex128), frequency)
    orders = lscf_poles(frequency, response, highest_order=30)
    assert [entry.order for entry in orders] == list(range(1, 31))
    for pole in POLES:
        assert nearest(orders[-1].poles, pole) < 1e-3


def test_poles_decay_and_rise_in_frequency() -> None:
    rng = np.random.default_rng(2)
    response = responses(POLES, rng.standard_normal((3, 4)).astype(np.complex128))
    response = response + 0.01 * (rng.standard_normal(response.shape) + 1j * rng.standard_normal(response.shape))
    for entry in lscf_poles(FREQUENCY, response):
        assert np.all(entry.poles.real < 0)
        assert np.all(np.diff(entry.poles.imag) >= 0)
        assert np.all(entry.poles.imag > 0)


def test_two_references_tell_two_modes_at_the_same_frequency_apart() -> None:
    rng = np.random.default_rng(3)
    poles = poles_from(np.array([100.0, 100.0]), np.array([0.02, 0.02]))
    shapes, participations = rng.standard_normal((2, 6)), rng.standard_normal((2, 2))
    block = responses(poles, np.einsum("mi,mj->mij", shapes, participations).astype(np.complex128))
    both = lscf_poles(FREQUENCY, block, highest_order=10)[-1].poles
    one = lscf_poles(FREQUENCY, block[:, 0], highest_order=10)[-1].poles
    close = 0.05 * -poles[0].real
    assert np.sum(np.abs(both - poles[0]) < close) == 2
    assert np.sum(np.abs(one - poles[0]) < close) == 1


def test_few_lines_are_used_up_to_the_highest_order_that_they_determine() -> None:
    response = responses(POLES, np.ones((3, 1), dtype=np.complex128), FREQUENCY[:40])
    # 80 numbers of one row, and two unknowns of each of 39 powers
    assert [entry.order for entry in lscf_poles(FREQUENCY[:40], response)] == list(range(1, 39))


def test_lines_that_determine_next_to_no_order_are_refused_with_what_to_do() -> None:
    response = responses(POLES, np.ones((3, 1), dtype=np.complex128), FREQUENCY[:11])
    with pytest.raises(NoModeError, match="up to order 9, and 10 is the least; measure more lines"):
        lscf_poles(FREQUENCY[:11], response)
