"""Files of the corrected simulation of a diagnosis for other programs: parameters, matrices and accelerances."""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import ZIP_STORED, ZipFile

import numpy as np
from pydantic import TypeAdapter, ValidationError

from analysis.gap.faults.removal import examine
from analysis.gap.findings.model_values import ModelValues, simulated
from analysis.gap.fitting.requested_rows import Matrices, matrices_at
from analysis.gap.measurement import Measurement
from jointlab.diagnosis.curves import with_rows_predicted
from jointlab.diagnosis.load import Subject, subject_of_run
from jointlab.diagnosis.predictions import write_accelerances
from jointlab.diagnosis.save import newest_diagnosis
from jointlab.errors import JointlabError
from store.catalogue import Catalogue
from store.errors import NotFoundError
from store.exchange.uff import UffModel
from store.extras import explained_imports
from store.version import software_version

FORMAT = "jointlab-model/1"
VALUES = TypeAdapter(ModelValues)
OF_VERDICT = ("gap", "verdict", "nuisances")
"""Keys of a diagnosis that are written with its model."""


def write_model(path: Path, subject: Subject, document: Mapping[str, Any]) -> tuple[Path, ...]:
    """Write the corrected simulation of a diagnosis, and return the files.

    These are, under the name of `path` without its ending, ``.json`` with the parameters, and where the beam was struck
    ``.h5`` with the matrices and ``.unv`` with the accelerances that they give. A path that ends in ``.zip`` becomes a
    file that holds them.

    Args:
        path: where to write.
        subject: the subject that was diagnosed.
        document: the document of its diagnosis.

    Raises:
        JointlabError: a file cannot be written, or the diagnosis was made before models were kept.
        AnalysisError: the article was amended after the diagnosis.
    """
    if "model" not in document:
        raise JointlabError("this diagnosis was made before its model was kept with it; diagnose the run again")
    try:
        if path.suffix != ".zip":
            return _written(path, subject, document)
        with TemporaryDirectory() as folder:
            files = _written(Path(folder) / path.name, subject, document)
            with ZipFile(path, "w", ZIP_STORED) as archive:
                for file in files:
                    archive.write(file, file.name)
        return (path,)
    except OSError as error:
        raise JointlabError(f"{path} cannot be written: {error.strerror or error}") from error


def write_model_of_run(catalogue: Catalogue, run_id: int, path: Path) -> tuple[Path, ...]:
    """Write the corrected simulation of a run's newest diagnosis.

    Raises:
        NotFoundError: there is no such run, or it has no diagnosis.
        JointlabError, AnalysisError: as of `write_model`.
    """
    found = newest_diagnosis(catalogue, run_id)
    if found is None:
        raise NotFoundError(f"run {run_id} has no diagnosis; make one with jointlab gap diagnose {run_id}")
    return write_model(path, subject_of_run(catalogue, run_id), found.document)


def read_effects(path: Path) -> ModelValues:
    """The values in a ``.json`` file of `write_model`.

    Raises:
        JointlabError: the file cannot be read, or has another format.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise JointlabError(f"{path} cannot be read as JSON: {error}") from error
    if not isinstance(document, dict) or document.get("format") != FORMAT:
        raise JointlabError(f"{path} is no corrected simulation in the format {FORMAT}")
    try:
        return VALUES.validate_python(document["model"])
    except (KeyError, ValidationError) as error:
        raise JointlabError(f"{path} is damaged: {error}") from error


def _written(path: Path, subject: Subject, document: Mapping[str, Any]) -> tuple[Path, ...]:
    measurement, values = with_rows_predicted(subject.measurement), VALUES.validate_python(document["model"])
    as_json = {"format": FORMAT, "title": subject.title, "creator": f"Jointlab {software_version()}"}
    as_json |= {name: document[name] for name in OF_VERDICT} | {"model": document["model"]}
    files = [path.with_suffix(".json")]
    files[0].write_text(json.dumps(as_json, indent=1) + "\n", encoding="utf-8")
    if measurement.sets:
        found = _matrices(values, measurement)
        files += [path.with_suffix(".h5"), path.with_suffix(".unv")]
        _write_hdf5(files[1], found, as_json)
        positions = measurement.drawing.node_positions.tolist()
        asked = [(found.response, point) for point in found.inputs]
        model = UffModel(subject.title, positions, datetime.now(UTC))
        write_accelerances(files[2], found.frequency, found.accelerance, asked, model)
    return tuple(files)


def _matrices(values: ModelValues, measurement: Measurement) -> Matrices:
    likelihood, scores = simulated(values, examine(measurement).measurement)
    inputs = tuple(point for _, point in measurement.predict)
    return matrices_at(likelihood, scores, inputs, measurement.sets[0].frequency)


def _write_hdf5(path: Path, found: Matrices, document: Mapping[str, Any]) -> None:
    with explained_imports():
        import h5py
    names, positions = zip(*found.attached, strict=True)
    with h5py.File(path, "w") as file:
        file.attrs.update(format=FORMAT, title=document["title"], creator=document["creator"])
        file["model"] = json.dumps(document)
        for name, values, unit in (
            ("frequency", found.frequency, "Hz"),
            ("pole", found.pole, "1/s"),
            ("accelerance", found.accelerance, "(m/s^2)/N"),
            ("beam/mass", found.mass, "1"),
            ("beam/damping", found.damping, "1/s"),
            ("beam/stiffness", found.stiffness, "1/s^2"),
            ("beam/loss_factor", found.loss, "1"),
            ("attached/modes", found.attached_modes, "kg^-1/2"),
            ("attached/position", np.array(positions), "m"),
            ("attached/dynamic_stiffness", found.attached_stiffness, "N/m, N and N m"),
            ("sensor/modes", found.sensor_modes, "kg^-1/2"),
            ("sensor/reading", found.reading, "1"),
            ("blows/modes", found.blow_modes, "kg^-1/2"),
            ("blows/state", found.state, "1"),
            ("blows/added", found.added, "m/N"),
        ):
            dataset = file.create_dataset(name, data=values, compression="gzip", shuffle=True, fletcher32=True)
            dataset.attrs["units"] = unit
        file["attached"].attrs["names"] = list(names)
        file["blows"].attrs["points"] = [str(point) for point in found.inputs]
        file["sensor"].attrs["point"] = str(found.response)
