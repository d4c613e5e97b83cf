"""A run with one blow at each point has the noise that its own records tell."""

import numpy as np
import pytest

from analysis.modal.estimator import Estimator
from jointlab.diagnosis.load import LOWEST_LINE, subject_of_run
from jointlab.identification.load import measurement_of_run
from jointlab.identification.options import Options
from store.catalogue import Catalogue
from store.measurements.blows import list_blows, withdraw_blow


@pytest.fixture
def one_blow_a_point(measured_catalogue: Catalogue, measured: int) -> int:
    """The demo's run with the first blow at each point alone."""
    with measured_catalogue.writing() as session:
        kept = set[object]()
        for blow in list_blows(session, measured):
            place = (blow.set_number, blow.point)
            if blow.accepted and place in kept:
                assert blow.id is not None
                withdraw_blow(session, blow.id, "one blow is to be enough", "test")
            elif blow.accepted:
                kept.add(place)
    return measured


def test_accelerances_of_one_blow_a_point_have_a_variance_that_a_diagnosis_takes_as_it_is(
    measured_catalogue: Catalogue, measured: int, one_blow_a_point: int
) -> None:
    for estimator in Estimator.H1, Estimator.LOCAL:
        (struck, *_) = measurement_of_run(measured_catalogue, one_blow_a_point, Options(estimator=estimator)).sets
        assert (struck.averages, struck.coherence, struck.estimator) == (1, None, estimator.value)
        assert struck.variance is not None
        assert np.all(struck.variance[:, 1:] > 0)
        if estimator is Estimator.H1:
            (taken, *_) = subject_of_run(measured_catalogue, one_blow_a_point).measurement.sets
            stated = struck.variance[:, struck.frequency >= LOWEST_LINE]
            assert np.median(taken.deviation**2 / stated) == pytest.approx(1.0, abs=0.1)
