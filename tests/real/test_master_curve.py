"""A recorded elastomer at many temperatures: sweeps that the fit has not seen lie within its intervals."""

import csv

import numpy as np
import pytest

from analysis.direct.master_fit import fit_master_curve
from analysis.direct.time_temperature import ShiftLaw
from tests.analysis.direct.points import point
from tests.recordings import Recording

ERROR = 0.005  # no error is stated; what instruments of this kind claim


@pytest.mark.parametrize(("shift", "every"), [(ShiftLaw.WLF, 2), (ShiftLaw.WLF, 3), (ShiftLaw.ARRHENIUS, 2)])
def test_left_out_temperatures_are_predicted(recording: Recording, shift: ShiftLaw, every: int) -> None:
    path = recording("data/elastomer_dma/frequency_sweeps.csv")
    with path.open(encoding="utf-8-sig", newline="") as file:
        rows = [list(map(float, row)) for row in list(csv.reader(file))[2:]]
    rows = [row for row in rows if row[3] > 20]  # above it the film is not a glass, where WLF does not hold
    sweeps = sorted({row[4] for row in rows})
    unseen = set(sweeps[1:-1:every])
    seen = [row for row in rows if row[4] not in unseen]
    points = [point(complex(row[1], row[2]), ERROR, row[0]) for row in seen]
    curve = fit_master_curve(points, [row[3] for row in seen], shift, reference=62.5)
    held, misses = [], []
    for frequency, storage, loss, temperature, sweep in rows:
        if sweep in unseen:
            found = curve.at(frequency, temperature)
            held.append(found.stiffness.low < storage < found.stiffness.high)
            held.append(found.loss_factor.low < loss / storage < found.loss_factor.high)
            misses.append(abs(np.log(storage / found.stiffness.value)))
    assert np.mean(held) >= 0.93
    assert np.median(misses) < 0.03
