"""A real rubber mount from inverse substructuring, which comes without any warning: where is it a stiffness at all?

The data were digitised from a plot to 3.5 Hz, 8 % and 0.05 rad. The mount is a spring up to where its own mass, some
0.4 kg, takes off half of its stiffness; below 40 Hz the inversion gives noise, above 125 Hz a negative stiffness.
"""

import numpy as np
import pytest

from analysis.frequency_response import Real
from analysis.inverse.apparent_stiffness import Refusal, StiffnessBands, identifiable_bands
from tests.recordings import Recording

RELATIVE_ERROR = 0.05


@pytest.fixture(scope="module")
def mount(recording: Recording) -> Real:
    """(3, lines) frequency in Hz, magnitude and angle in rad."""
    return np.loadtxt(recording("data/rubber_mount/Zj_00_digitised.csv"), delimiter=",", unpack=True)


@pytest.fixture(scope="module")
def bands(mount: Real) -> StiffnessBands:
    frequency, size, angle = mount
    return identifiable_bands(frequency, size * np.exp(1j * angle), RELATIVE_ERROR)


def test_one_band_is_physical_and_nothing_else(mount: Real, bands: StiffnessBands) -> None:
    places = np.flatnonzero(bands.accepted)
    assert np.all(np.diff(places) == 1)
    assert 35 < mount[0, places[0]] < 45
    assert 80 < mount[0, places[-1]] < 125
    assert bands.refused[0].lowest < 1
    assert bands.refused[-1].highest == 2000


def test_every_line_outside_has_a_reason(bands: StiffnessBands) -> None:
    assert {band.refusal for band in bands.refused} >= {Refusal.LOSS, Refusal.RISE, Refusal.FALL, Refusal.STORAGE}
    negative = [band for band in bands.refused if band.refusal is Refusal.STORAGE and band.lowest < 200]
    assert [round(band.lowest) for band in negative] == [128]
