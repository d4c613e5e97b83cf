"""Which terms of an identified joint are observable, by the intervals that are shown."""

import numpy as np

from analysis.inverse.joint_estimate import joint_from_terms
from analysis.inverse.undetermined_terms import Unobservable, reasons_array
from analysis.tables import loss_factor_terms, stiffness_terms

STIFFNESS = np.array([2e6, 9e5, 0.0, 2e6, 0.0, 300.0])
TERMS = np.concatenate([STIFFNESS, 0.1 * STIFFNESS])
NO_REASON = reasons_array([None] * 12)


def deviations(k33: float, h33: float) -> np.ndarray:
    """(12, 12) covariance with these relative deviations of the last terms, 1 % of the others."""
    relative = np.full(12, 0.01)
    relative[5], relative[11] = k33, h33
    return np.diag(np.square(relative * np.maximum(np.abs(TERMS), 1.0)))


def test_a_term_whose_interval_is_wider_than_the_term_is_not_observable() -> None:
    for deviation, why in ((0.02, None), (0.26, Unobservable.WIDER_THAN_VALUE), (0.6, Unobservable.INCLUDES_ZERO)):
        covariance = deviations(deviation, 0.02)
        found = joint_from_terms("I", 2, TERMS, covariance, [(covariance, np.full(12, 1.96))], NO_REASON)
        assert found.why_not[2, 2] is why
        assert found.why_not[0, 0] is None
        assert found.why_not[0, 2] is Unobservable.INCLUDES_ZERO


def test_a_loss_factor_is_observable_by_its_own_interval_too() -> None:
    covariance = deviations(0.05, 0.4)
    found = joint_from_terms("I", 2, TERMS, covariance, [(covariance, np.full(12, 1.96))], NO_REASON)
    known = {
        row.element: row.observable for row in (*stiffness_terms([found], np.ones((3, 3))), *loss_factor_terms([found]))
    }
    assert (known["k33"], known["gamma33"], known["gamma11"]) == (True, False, True)
