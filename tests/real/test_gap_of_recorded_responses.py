"""Real responses beside simulations of them: the map says where they differ, and the resonances by how much."""

import numpy as np
import pyuff

from analysis.response_gap import response_gap
from tests.recordings import Recording

FREE_BEAM = np.array([4.7300, 7.8532, 10.9956, 14.1372, 17.2788, 20.4204]) ** 2
"""Of a free Euler-Bernoulli beam, in proportion to frequency (S. S. Rao, Mechanical Vibrations, table 8.1)."""


def test_a_measured_response_beside_its_finite_element_prediction(recording: Recording) -> None:
    file = recording("data/testbench/Y_B_exp_o3_i0.csv")
    frequency, size, phase, their_size, their_phase = np.loadtxt(file, delimiter=",", skiprows=2).T
    keep = frequency >= 20.0  # the sensor's own lower end
    measured, simulated = size * np.exp(1j * phase), their_size * np.exp(1j * their_phase)
    found = response_gap(frequency[keep], measured[None, keep], simulated[None, keep], ("channel 3 by impact 0",))
    (resonances,) = found.resonances
    assert [(each.measured, each.simulated) for each in resonances] == [(840.0, 925.0), (1115.0, 1245.0)]
    assert all(0.08 < each.shift < 0.13 and each.height > 2 for each in resonances)  # too stiff, too little damping
    assert found.percent > 100.0
    low, high = found.places[0].band
    assert low < 925.0 < high
    assert found.places[0].share > 0.9
    assert "measured at 840 Hz is simulated at 925 Hz (+10.1 %)" in found.statements[2]


def test_a_recorded_free_beam_beside_the_beam_of_the_textbook(recording: Recording) -> None:
    """Its poles as the textbook has them from the first one on, its shapes as measured."""
    sets = pyuff.UFF(str(recording("data/beam/beam_accelerance_derived.uff"))).read_sets()
    frequency = np.asarray(sets[0]["x"])
    measured = np.array([each["data"] for each in sets])
    keep = (frequency >= 20.0) & (frequency <= 800.0)
    known = np.array([51.5, 142.18, 278.66, 460.39, 687.16, 958.5])
    textbook = known[0] * FREE_BEAM / FREE_BEAM[0]
    textbook[3] *= 1.03  # and one mode that the simulation has three per cent too high
    loss = 2e-3

    def basis(modes: np.ndarray) -> np.ndarray:
        squares = frequency[keep] ** 2
        terms = [-squares / (mode**2 * (1 + 1j * loss) - squares) for mode in modes]
        return np.array([*terms, np.ones_like(squares), -squares / 1e6])

    shapes, *_ = np.linalg.lstsq(basis(known).T, measured[:, keep].T, rcond=None)
    found = response_gap(frequency[keep], measured[:, keep], (basis(textbook).T @ shapes).T, ("1", "2", "3"))
    low, high = found.places[0].band
    assert low < 475.0
    assert high > 460.0
    shifts = {round(each.measured): each.shift for row in found.resonances for each in row}
    assert abs(shifts[460] - 0.03) < 0.004
    assert all(abs(shift) < 0.008 for at, shift in shifts.items() if at != 460)
