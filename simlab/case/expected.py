"""What identification should find on a case's bench: its joints as they are with the effects."""

from __future__ import annotations

from typing import Any

import numpy as np

from simlab.case.article import JOINT_NAMES
from simlab.case.draw import Case
from simlab.case.simulate import stand_of
from simlab.truth import BLOW_BAND, loss_factors


def expected_joints(case: Case) -> dict[str, Any]:
    """Each joint's k, h (N/m, N, N m) and gamma under the reference set's blows, in the shape of the bench's truth.

    Averaged over 77 to 900 Hz; ``k_spread`` and ``h_spread`` are the largest less the smallest value there.  What
    couples the joints to each other, where a case has that, is left out.
    """
    stand = stand_of(case, BLOW_BAND)
    both = np.asarray(stand.joints(0, 0.5, case.campaign.setups[0].peak_force).stiffness)
    found = {}
    for i, name in enumerate(JOINT_NAMES):
        band = both[:, 3 * i : 3 * i + 3, 3 * i : 3 * i + 3]
        mean = band.mean(axis=0)
        found[name] = {
            "k": mean.real.tolist(),
            "h": mean.imag.tolist(),
            "gamma": loss_factors(mean),
            "k_spread": np.ptp(band.real, axis=0).tolist(),
            "h_spread": np.ptp(band.imag, axis=0).tolist(),
        }
    return found
