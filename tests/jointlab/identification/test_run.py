"""A report is of the identification that is stored, by its choices, and says so where it cannot be."""

import numpy as np

from analysis.modal.estimator import Estimator
from jointlab.identification.options import Options
from jointlab.identification.run import identify_run, recompute
from jointlab.identification.save import save_identification
from store.blows import list_blows, withdraw_blow
from store.catalogue import Catalogue

CHOSEN = Options(
    without=("transducer_lag",), elements=1, estimator=Estimator.HV, force_window=0.05, exponential_window=0.5
)


def test_what_is_stored_is_found_again_by_its_choices_until_a_blow_is_taken_back(
    measured_catalogue: Catalogue, measured: int
) -> None:
    first = identify_run(measured_catalogue, measured, CHOSEN)
    with measured_catalogue.writing() as session:
        stored = save_identification(session, measured, first)
    again, standing = recompute(measured_catalogue, measured)
    assert again.options == CHOSEN
    assert standing == f"It is that of analysis {stored.likelihood_joints}"
    assert first.inverse is not None
    assert again.inverse is not None
    for name, joint in first.inverse.likelihood.joints.items():
        np.testing.assert_allclose(again.inverse.likelihood.joints[name].k_ci95, joint.k_ci95, rtol=1e-9)

    with measured_catalogue.writing() as session:
        blow = next(each for each in list_blows(session, measured) if each.accepted and each.waveform is not None)
        assert blow.id is not None
        withdraw_blow(session, blow.id, "another mark was hit", "test")
    _, standing = recompute(measured_catalogue, measured)
    assert standing.startswith(f"It is not that of analysis {stored.likelihood_joints}: blows were taken back")
