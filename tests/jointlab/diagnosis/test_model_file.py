"""The corrected simulation, read by thirty lines that know nothing of us."""

import json
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from analysis.dof import Dof
from analysis.gap.catalogue import candidates
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.findings.model_values import values_of
from analysis.gap.fitting.fit import evaluated
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.model import Model
from analysis.gap.fitting.requested_rows import at_rows
from analysis.gap.measurement import Measurement
from jointlab.diagnosis.curves import with_rows_predicted
from jointlab.diagnosis.load import Subject
from jointlab.diagnosis.model_file import read_effects, write_model
from jointlab.errors import JointlabError
from store.exchange.accelerance_file import read_accelerances
from tests.analysis.gap.conftest import blank, drawn, simulation_of
from tests.elsewhere import READER, read_elsewhere

TOGETHER = (
    {"amplitude_dependence", "foundation_compliance", "out_of_plane_bending", "cross_axis_sensitivity"},
    {"support_position", "impact_angle", "exponential_window", "beam_damping", "accelerometer_mass", "channel_delay"},
)
UNSEEN = Dof.parse("5y")


@pytest.fixture(scope="module")
def measurement() -> Measurement:
    whole = blank(drawn())
    thin = whole.thinned(30)
    return replace(thin, predict=((thin.drawing.accelerometer, UNSEEN),))


@pytest.mark.parametrize("ids", TOGETHER, ids=lambda ids: sorted(ids)[0])
def test_the_reader_computes_what_the_model_predicts(measurement: Measurement, ids: set[str], tmp_path: Path) -> None:
    model = invented(measurement, ids)
    files = write_model(tmp_path / "model.json", Subject("an article", measurement), document(model))
    assert [file.name for file in files] == ["model.json", "model.h5", "model.unv"]
    inputs = tuple(point for _, point in with_rows_predicted(measurement).predict)
    whole, scores = at_rows(model.fit.likelihood, model.fit.scores, inputs, measurement.sets[0].frequency)
    expected = whole.predict(scores, ()).accelerances[0][-len(inputs) :]
    np.testing.assert_allclose(read_elsewhere(files[1]), expected, rtol=1e-6)
    uff = read_accelerances(files[2])
    assert [str(dof) for dof in uff.inputs] == [str(dof) for dof in inputs]
    np.testing.assert_allclose(uff.accelerance, expected, rtol=1e-9)
    with h5py.File(files[1]) as file:
        assert list(file["blows"].attrs["points"]) == [str(dof) for dof in inputs]
        assert json.loads(file["model"][()])["model"] == json.loads(files[0].read_text(encoding="utf-8"))["model"]
    assert read_effects(files[0]) == values_of(model, UNCALIBRATED)


def test_the_reader_is_short_and_needs_numpy_and_h5py_alone() -> None:
    lines = READER.read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 30
    assert [each for each in lines if each.startswith(("import", "from"))] == [
        "import sys",
        "import h5py",
        "import numpy as np",
    ]


def test_a_diagnosis_without_its_model_is_refused(measurement: Measurement, tmp_path: Path) -> None:
    with pytest.raises(JointlabError, match="diagnose the run again"):
        write_model(tmp_path / "model", Subject("an article", measurement), {"gap": {}, "verdict": {}})


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("{", "cannot be read as JSON"),
        ('{"format": "jointlab-diagnosis/1"}', "no corrected simulation"),
        ('{"format": "jointlab-model/1", "model": {"effects": 3}}', "is damaged"),
    ],
)
def test_another_file_is_refused(content: str, said: str, tmp_path: Path) -> None:
    (tmp_path / "model.json").write_text(content, encoding="utf-8")
    with pytest.raises(JointlabError, match=said):
        read_effects(tmp_path / "model.json")


def invented(measurement: Measurement, ids: set[str]) -> Model:
    """A model of several effects, the first variant of the first law of each, whose unknowns were drawn at random."""
    found = {each.id: each for each in reversed(candidates(measurement)) if each.id in ids}
    assert set(found) == ids
    effects = tuple(found.values())
    likelihood = Likelihood(simulation_of(measurement, *effects))
    scores = 0.4 * np.random.default_rng(2).standard_normal(likelihood.unknowns)
    return Model(effects, evaluated(likelihood, scores))


def document(model: Model) -> dict[str, Any]:
    """What matters here of a diagnosis."""
    values: dict[str, Any] = json.loads(json.dumps(asdict(values_of(model, UNCALIBRATED))))
    return {"model": values, "gap": {}, "verdict": {}, "nuisances": {}}
