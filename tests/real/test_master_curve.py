"""A recorded elastomer at many temperatures: sweeps that the fit has not seen lie within its intervals."""

import csv

import numpy as np
import pytest

from analysis.direct.master_curve import MasterCurve
from analysis.direct.master_fit import fit_master_curve
from analysis.direct.shift_law import ShiftLaw
from tests.analysis.direct.points import point
from tests.recordings import Recording

ERROR = 0.005  # no error is stated; what instruments of this kind claim


@pytest.fixture(scope="module")
def rows(recording: Recording) -> list[list[float]]:
    """Hz, storage and loss modulus, degrees Celsius and number of the sweep, above 20 degrees; below, the film is a
    glass, where WLF does not hold."""
    path = recording("data/elastomer_dma/frequency_sweeps.csv")
    with path.open(encoding="utf-8-sig", newline="") as file:
        found = [list(map(float, row)) for row in list(csv.reader(file))[2:]]
    return [row for row in found if row[3] > 20]


def fitted(rows: list[list[float]], shift: ShiftLaw) -> MasterCurve:
    points = [point(complex(row[1], row[2]), ERROR, row[0]) for row in rows]
    return fit_master_curve(points, [row[3] for row in rows], shift, reference=62.5)


def held(curve: MasterCurve, unseen: list[list[float]], lag: float) -> float:
    """Share of storage moduli and loss factors, the instrument's lag taken out, within the curve's intervals."""
    found = []
    for frequency, storage, loss, temperature, _ in unseen:
        asked = curve.at(frequency, temperature)
        tangent = np.tan(np.arctan2(loss, storage) - 2 * np.pi * frequency * lag)
        found += [
            asked.stiffness.low < storage < asked.stiffness.high,
            asked.loss_factor.low < tangent < asked.loss_factor.high,
        ]
    return float(np.mean(found))


@pytest.mark.parametrize(("shift", "every"), [(ShiftLaw.WLF, 2), (ShiftLaw.WLF, 3), (ShiftLaw.ARRHENIUS, 2)])
def test_left_out_temperatures_are_predicted(rows: list[list[float]], shift: ShiftLaw, every: int) -> None:
    left_out = set(sorted({row[4] for row in rows})[1:-1:every])
    unseen = [row for row in rows if row[4] in left_out]
    curve = fitted([row for row in rows if row[4] not in left_out], shift)
    assert held(curve, unseen, curve.lag.value) >= 0.93
    misses = [abs(np.log(row[1] / curve.at(row[0], row[3]).stiffness.value)) for row in unseen]
    assert np.median(misses) < 0.03
    # the same phase at 100 Hz at all temperatures, from 25 to 100 degrees Celsius: the instrument's, not the film's
    assert 40e-6 < curve.lag.value < 70e-6


def test_frequencies_up_to_twenty_times_the_highest_are_predicted(rows: list[list[float]]) -> None:
    lag = fitted(rows, ShiftLaw.WLF).lag.value
    curve = fitted([row for row in rows if row[0] < 5], ShiftLaw.WLF)
    assert held(curve, [row for row in rows if row[0] > 7], lag) >= 0.9
