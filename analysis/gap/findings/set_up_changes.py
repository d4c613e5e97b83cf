"""Joints that were stiffer in one hammer set than in another by more than set-ups usually make.

Such a change is no effect of the catalogue. If it is small, the scatter of set-ups in the model absorbs it, and the
verdict may be that no effect acts. The change is then reported all the same.
"""

from dataclasses import dataclass

import numpy as np

from analysis.gap.evidence.calibration import Calibration
from analysis.gap.findings.intervals import deviations_of
from analysis.gap.fitting.model import Model
from analysis.gap.simulation.scales import HALF_NORMAL

UNUSUAL = 4.0
"""Standard deviations of the difference of two set-ups, by the stated or usual scatter, beyond which it is reported."""
CLEAR = 3.0
"""Standard errors beyond which a difference is not noise."""


@dataclass(frozen=True)
class SetUpChange:
    """A joint that differs between two hammer sets.

    Attributes:
        joint: its name.
        softest, stiffest: numbers of the sets between which it differs most, from 1.
        percent: by which it is stiffer there.
        error_percent: standard error of that.
    """

    joint: str
    softest: int
    stiffest: int
    percent: float
    error_percent: float


def set_up_changes(model: Model, calibration: Calibration) -> tuple[SetUpChange, ...]:
    """Joints of a fitted model that differ between hammer sets unusually far; empty with fewer than two sets."""
    likelihood = model.fit.likelihood
    if len(likelihood.setups) < 2:
        return ()
    scale, stated = likelihood.scales.setup_scatter, likelihood.measurement.tolerances.setup_scatter
    usual = HALF_NORMAL.setup_scatter if stated is None else stated
    places = np.array([list(own)[1:] for own in likelihood.setups])  # (sets, joints)
    stiffness = scale * model.fit.scores[places]
    errors = scale * deviations_of(model, calibration)[places]
    found = list[SetUpChange]()
    for joint, own, error in zip(likelihood.measurement.drawing.joints, stiffness.T, errors.T, strict=True):
        softest, stiffest = int(np.argmin(own)), int(np.argmax(own))
        change = float((1 + own[stiffest]) / (1 + own[softest]) - 1)
        uncertain = float(np.hypot(error[softest], error[stiffest]))
        if change > UNUSUAL * np.sqrt(2) * usual and change > CLEAR * uncertain:
            found.append(SetUpChange(joint.name, softest + 1, stiffest + 1, 100 * change, 100 * uncertain))
    return tuple(found)
