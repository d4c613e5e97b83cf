"""Data of figures are the same from the store as from the identification itself."""

import numpy as np
import pytest

from jointlab.identification.inverse import METHODS
from jointlab.identification.pipeline import Identification
from jointlab.identification.read import newest_joints, read_direct, read_inverse
from jointlab.identification.save import joint_matrix
from jointlab.report.curves import loss_factor_panels, stiffness_panels, superposition_curves
from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.measurements.runs import Run, get_run


@pytest.fixture
def run(measured_catalogue: Catalogue, measured: int) -> Run:
    with measured_catalogue.reading() as session:
        return get_run(session, measured)


def test_pictures_from_the_store_are_those_of_the_identification(
    measured_catalogue: Catalogue, run: Run, identified: Identification
) -> None:
    stored, inverse = read_inverse(measured_catalogue, run), identified.inverse
    assert inverse is not None
    assert inverse.paper is not None
    routes = {METHODS[route.method]: route for route in inverse.results}
    assert list(stored.predicted) == list(routes)
    for name, route in routes.items():
        np.testing.assert_allclose(stored.predicted[name].accelerance, route.responses.accelerance, rtol=1e-9)
    for name, (observed, fitted) in stored.regressions.items():
        regression = inverse.paper.joints[name].regression
        scale = float(np.abs(regression.observed).max())
        np.testing.assert_allclose(observed, regression.observed, atol=1e-9 * scale)
        np.testing.assert_allclose(fitted, regression.fitted, atol=1e-9 * scale)

    joints = {METHODS[method]: own for method, (_, own) in newest_joints(measured_catalogue, run).items()}
    computed = {
        name: {joint: joint_matrix(each) for joint, each in route.joints.items()} for name, route in routes.items()
    }
    direct = read_direct(measured_catalogue, run)
    for panels in (stiffness_panels, loss_factor_panels):
        for ours, theirs in zip(panels(joints, direct), panels(computed, identified.direct), strict=True):
            assert ours.title == theirs.title
            assert list(ours.curves) == list(theirs.curves)
            assert list(ours.inverse) == list(theirs.inverse)
            for amplitude, drawn in ours.curves.items():
                other = theirs.curves[amplitude]  # k and h are stored with an error each, their correlation is not
                assert np.all(np.abs(drawn.value - other.value) < other.half_width)
    for name, own in direct.items():
        kinds = zip(
            superposition_curves(own.superposition),
            superposition_curves(identified.direct[name].superposition),
            strict=True,
        )
        for from_store, at_once in kinds:
            for amplitude, sums in from_store.items():
                np.testing.assert_allclose(sums.value, at_once[amplitude].value, rtol=1e-9)


def test_a_run_without_joints_has_none_of_them(measured_catalogue: Catalogue, run: Run) -> None:
    with pytest.raises(NotFoundError, match="run 77 has no joint matrices"):
        newest_joints(measured_catalogue, Run(**vars(run) | {"id": 77}))
