"""The fit over cylinders, from the fit over matrices: it tells the two k11 apart, where joints are built as stated."""

import json
from dataclasses import replace

import numpy as np
import pytest

from jointlab.identification.document import identification_document
from jointlab.identification.load import measurement_of_bundle
from jointlab.identification.pipeline import Identification, identify
from store.exchange.bundle import read_bundle
from tests.recordings import Recording


@pytest.fixture(scope="module")
def found(recording: Recording) -> Identification:
    whole = measurement_of_bundle(read_bundle(recording("examples/none")))
    return identify(replace(whole, sets=whole.sets[:1], points=()))


@pytest.mark.parametrize("joint", ["I", "II"])
def test_k11_of_each_joint_is_told_where_matrices_tell_the_sum(
    found: Identification, recording: Recording, joint: str
) -> None:
    assert found.inverse is not None
    assert found.inverse.cylinders is not None
    truth = np.array(json.loads(recording("examples/truth/none.json").read_text())["joints"][joint]["k"])
    by_matrix, by_cylinders = found.inverse.fit.joints[joint], found.inverse.cylinders.joints[joint]
    low, high = by_cylinders.k_ci95[0, 0]
    assert low < truth[0, 0] < high
    assert high - low < 0.25 * np.diff(by_matrix.k_ci95[0, 0])[0]
    for at in ((0, 1), (1, 1)):
        assert by_cylinders.stiffness[at] == pytest.approx(truth[at], rel=0.005)


def test_the_document_names_every_parameter_of_the_cylinders(found: Identification) -> None:
    document = identification_document(found)["inverse_cylinders"]
    assert document["passed"]
    for name in ("Re a(I)", "Re b(I)", "Im a(II)", "Im b(II)"):
        low, high = document["parameters"][name]["ci95"]
        assert low < document["parameters"][name]["value"] < high
