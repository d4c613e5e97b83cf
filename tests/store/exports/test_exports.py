"""A run in the forms of other programs: read back by their own libraries, with values, units and intervals equal."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import h5py
import numpy as np
import pytest
import pyuff
from scipy.io import loadmat

from store.catalogue import Catalogue
from store.dof import StoredDof
from store.errors import NotFoundError, StoreError
from store.exchange.accelerance_file import read_in_plane
from store.exchange.uff_modes import UffMode, mode_dataset, read_uff_modes
from store.exports.content import content_of
from store.exports.formats import FORMS
from store.exports.hdf5 import export_hdf5
from store.exports.mat import export_mat, field_name
from store.exports.parquet import export_parquet
from store.exports.uff import export_uff
from store.measurements.frequency_responses import add_frequency_responses
from store.measurements.runs import list_runs, start_run
from store.results.analyses import add_analysis
from store.results.joint_matrices import add_joint_matrix
from store.results.modes import add_modes
from store.states import AnalysisKind


def structure(value: Any) -> Any:
    """A structure of MATLAB as dictionaries; others as they are."""
    if isinstance(value, np.ndarray) and value.dtype.names:
        return {name: structure(value[name][()]) for name in value.dtype.names}
    return value


def read_mat(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = structure(loadmat(path, squeeze_me=True)["jointlab"])
    return found


@pytest.fixture
def sweep(catalogue: Catalogue, filled: int) -> int:
    """The number of the sweep beside the hammer run."""
    with catalogue.reading() as session:
        return list_runs(session, kind="sweep")[0].id


def test_matlab_has_every_array_with_unit_interval_and_provenance(
    catalogue: Catalogue, filled: int, tmp_path: Path, samples: SimpleNamespace
) -> None:
    assert export_mat(catalogue, filled, tmp_path / "run.mat") == 4
    found = read_mat(tmp_path / "run.mat")
    assert (found["format"], found["article"], found["run"]) == ("jointlab-mat/1", "beam 3", filled)
    assert json.loads(str(found["setup"])) == samples.setup
    ((_, responses),), ((_, modes),), ((_, joints),) = (
        found[kind].items() for kind in ("frequency_responses", "modes", "joint_matrices")
    )
    expected, one = samples.frequency_responses(), responses["set1"]
    np.testing.assert_array_equal(one["accelerance"]["values"], expected.accelerance)
    np.testing.assert_array_equal(one["variance"]["values"], expected.variance)
    np.testing.assert_array_equal(one["frequency"]["values"], expected.frequency)
    assert (one["accelerance"]["units"], list(one["accelerance"]["dims"])) == ("(m/s^2)/N", ["input", "frequency"])
    assert list(one["input"]["values"]) == ["1y", "4y"]
    np.testing.assert_array_equal(modes["frequency_ci95"]["values"], samples.modes().frequency_ci95)
    np.testing.assert_array_equal(modes["shapes"]["values"], samples.modes().shapes)
    assert modes["frequency_ci95"]["units"] == "Hz"
    matrix = samples.joint_matrix("I", 2)
    for name in ("stiffness", "stiffness_ci95", "damping_ci95", "loss_factor", "covariance", "observable"):
        np.testing.assert_array_equal(joints["I"][name]["values"], getattr(matrix, name))
    assert (joints["I"]["joint"], joints["I"]["node"]) == ("I", 2)
    assert json.loads(str(joints["settings"])) == {"order": 20}
    assert f"analysis_{joints['parents']}" in found["modes"]
    ((_, compared),) = found["comparisons"].items()
    assert list(compared["verdict"]["values"]) == [each.verdict for each in samples.comparisons]
    np.testing.assert_array_equal(compared["direct_ci95"]["values"], [each.direct for each in samples.comparisons])


def test_matlab_has_sine_points_with_texts(
    catalogue: Catalogue, sweep: int, tmp_path: Path, samples: SimpleNamespace
) -> None:
    export_mat(catalogue, sweep, tmp_path / "run.mat")
    ((_, points),) = read_mat(tmp_path / "run.mat")["dynamic_stiffness"].items()
    for name, unit in (("stiffness", "N/m"), ("stiffness_se", "N/m"), ("frequency", "Hz"), ("thd_percent", "%")):
        expected = [getattr(each, name) for each in samples.dynamic_stiffness()]
        np.testing.assert_array_equal(points[name]["values"], expected)
        assert points[name]["units"] == unit
    assert list(points["specimen"]["values"]) == ["I"] * 4


@pytest.mark.parametrize(("text", "name"), [("I", "I"), ("2 b/c", "n_2_b_c"), ("é", "n__"), ("x" * 99, "x" * 63)])
def test_names_are_made_fit_for_matlab(text: str, name: str) -> None:
    assert field_name(text) == name


def test_parquet_has_a_row_for_each_place_with_units_and_provenance(
    catalogue: Catalogue, filled: int, tmp_path: Path, samples: SimpleNamespace
) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    assert export_parquet(catalogue, filled, tmp_path / "run") == 4
    tables = {path.stem: parquet.read_table(path) for path in (tmp_path / "run").iterdir()}
    assert {"frequency_responses", "modes", "modes_by_mode_dof", "joint_matrices"} <= set(tables)
    responses, expected = tables["frequency_responses"], samples.frequency_responses()
    lines = expected.frequency.size
    assert responses.column("input").to_pylist() == ["1y"] * lines + ["4y"] * lines
    np.testing.assert_array_equal(responses.column("frequency"), np.tile(expected.frequency, 2))
    np.testing.assert_array_equal(responses.column("accelerance_real"), expected.accelerance.real.ravel())
    np.testing.assert_array_equal(responses.column("accelerance_imaginary"), expected.accelerance.imag.ravel())
    np.testing.assert_array_equal(responses.column("variance"), expected.variance.ravel())
    assert responses.schema.field("accelerance_real").metadata == {b"unit": b"(m/s^2)/N"}
    modes, joints = tables["modes"], tables["joint_matrices"]
    for side, name in enumerate(("low", "high")):
        limits = samples.modes().frequency_ci95[:, side]
        np.testing.assert_array_equal(modes.column(f"frequency_ci95_{name}"), limits)
    of_first = joints.filter(parquet_equal(joints, "joint", "I"))
    matrix = samples.joint_matrix("I", 2)
    np.testing.assert_array_equal(of_first.column("stiffness"), matrix.stiffness.ravel())
    np.testing.assert_array_equal(of_first.column("damping_ci95_high"), matrix.damping_ci95[..., 1].ravel())
    assert of_first.column("row").to_pylist() == [each for each in ("x", "y", "rotation") for _ in range(3)]
    compared = tables["comparisons"]
    for name in ("joint", "element", "verdict"):
        assert compared.column(name).to_pylist() == [getattr(each, name) for each in samples.comparisons]
    inverse = [(each.inverse or (np.nan, np.nan))[0] for each in samples.comparisons]
    np.testing.assert_array_equal(compared.column("inverse_ci95_low"), inverse)
    provenance = json.loads(joints.schema.metadata[b"jointlab"])
    assert (provenance["title"], provenance["setup"]) == ("beam 3, roving hammer", samples.setup)
    (origin,) = [each for path, each in provenance["parts"].items() if path.endswith("/I")]
    assert json.loads(origin["settings"]) == {"order": 20}


def parquet_equal(table: Any, column: str, value: str) -> Any:
    """Which rows of a table have a value."""
    from pyarrow import compute

    return compute.equal(table.column(column), value)


def test_parquet_has_sine_points_and_fits_into_a_zip(
    catalogue: Catalogue, sweep: int, tmp_path: Path, samples: SimpleNamespace
) -> None:
    parquet, zipfile = pytest.importorskip("pyarrow.parquet"), pytest.importorskip("zipfile")
    export_parquet(catalogue, sweep, tmp_path / "run.zip")
    with zipfile.ZipFile(tmp_path / "run.zip") as packed:
        packed.extractall(tmp_path / "run")
    table = parquet.read_table(tmp_path / "run" / "dynamic_stiffness.parquet")
    for name in ("stiffness", "damping", "stiffness_se", "frequency"):
        np.testing.assert_array_equal(table.column(name), [getattr(each, name) for each in samples.dynamic_stiffness()])
    assert table.schema.field("stiffness").metadata == {b"unit": b"N/m"}


def test_uff_has_accelerances_coherence_variance_modes_and_the_beam(
    catalogue: Catalogue, filled: int, tmp_path: Path, samples: SimpleNamespace
) -> None:
    assert export_uff(catalogue, filled, tmp_path / "run.unv") == 2
    file = pyuff.UFF(str(tmp_path / "run.unv"))
    kinds = [int(each) for each in file.get_set_types()]
    assert kinds[:4] == [151, 164, 15, 82]
    datasets = [file.read_sets(index) for index in range(len(kinds))]
    functions = [each for each in datasets if each["type"] == 58]
    expected, modes = samples.frequency_responses(), samples.modes()
    responses = [each for each in functions if each["func_type"] == 4]
    np.testing.assert_array_equal([each["data"] for each in responses], expected.accelerance)
    np.testing.assert_allclose(responses[0]["x"], expected.frequency, rtol=1e-11)
    assert [(each["ref_node"], each["ref_dir"]) for each in responses] == [(1, 2), (4, 2)]
    assert {each["ordinate_axis_units_lab"] for each in responses} == {"m/s^2"}
    variances = [each["data"] for each in functions if each["id1"].startswith("variance")]
    np.testing.assert_array_equal(variances, expected.variance)
    shapes = [each for each in datasets if each["type"] == 55]
    np.testing.assert_allclose([each["freq"] for each in shapes], modes.frequency, rtol=1e-9)
    np.testing.assert_allclose([each["modal_damp_his"] for each in shapes], modes.loss_factor, rtol=1e-9)
    np.testing.assert_allclose([each["r2"] for each in shapes], modes.shapes, rtol=1e-5)
    assert {each["modal_m"] for each in shapes} == {0.0}  # the point of the accelerometer, 3y, was not struck
    low, high = modes.frequency_ci95[0]
    assert shapes[0]["id3"] == f"frequency 95 %: {low:.10g} to {high:.10g}"
    assert shapes[0]["id2"].startswith("analysis ")
    read = read_in_plane(tmp_path / "run.unv")
    assert len([each for each in read.functions if each.name == "accelerance set 1"]) == 2
    assert set(read.nodes) == {1, 2, 3, 4, 5, 6}


def test_shapes_have_unit_modal_mass_where_the_point_of_the_accelerometer_was_struck(
    catalogue: Catalogue, tmp_path: Path, samples: SimpleNamespace
) -> None:
    with catalogue.writing() as session:
        run = start_run(session, kind="hammer", title="a hammer", article="beam 4", setup=samples.setup).id
        responses = add_analysis(session, kind=AnalysisKind.FREQUENCY_RESPONSES, method="H1", settings={}, runs=(run,))
        driven = replace(samples.frequency_responses(), response=StoredDof(1, "y"))
        add_frequency_responses(session, responses, run, driven)
        modes = add_analysis(session, kind=AnalysisKind.MODES, method="LSCF", settings={}, runs=(run,))
        add_modes(session, modes, samples.modes())
    export_uff(catalogue, run, tmp_path / "run.unv")
    found = read_uff_modes(tmp_path / "run.unv")
    at = [found.dofs.index(each) for each in ("1y", "4y")]
    # the modal constants are products of the shapes at blow and accelerometer
    np.testing.assert_allclose((found.shapes[at] * found.shapes[at[0]]).T, samples.modes().shapes, rtol=1e-4)


def test_a_mode_is_read_as_it_was_without_its_rotations(tmp_path: Path) -> None:
    shape = {
        StoredDof(2, "y"): -1.25e-7 + 3j,
        StoredDof(2, "r"): 0.5 - 0.125j,
        StoredDof(7, "x"): 4 + 0j,
        StoredDof(9, "r"): 1j,
    }
    (tmp_path / "mode.unv").write_bytes(mode_dataset(UffMode(3, 123.456789, 0.0625, shape, ["a mode"])))
    found = pyuff.UFF(str(tmp_path / "mode.unv")).read_sets(0)
    assert (found["mode_n"], found["freq"], found["modal_damp_his"]) == (3, 123.456789, 0.0625)
    assert list(found["node_nums"]) == [2, 7]
    assert list(found["r2"]) == [-1.25e-7 + 3j, 0]
    assert list(found["r1"]) == [0, 4]


def test_a_run_without_accelerances_and_modes_is_no_uff_file(catalogue: Catalogue, sweep: int, tmp_path: Path) -> None:
    with pytest.raises(NotFoundError, match="neither accelerances nor modes; identify it first"):
        export_uff(catalogue, sweep, tmp_path / "run.unv")
    assert not list(tmp_path.glob("run.unv*"))


@pytest.mark.parametrize("form", FORMS)
def test_no_form_overwrites_a_file(form: str, catalogue: Catalogue, filled: int, tmp_path: Path) -> None:
    suffix, write = FORMS[form]
    taken = tmp_path / f"taken{suffix}"
    taken.write_text("")
    with pytest.raises(StoreError, match="exists already"):
        write(catalogue, filled, taken)
    with pytest.raises(NotFoundError, match="no run 77"):
        write(catalogue, 77, tmp_path / f"other{suffix}")


def test_a_joint_tells_why_a_term_is_not_observable(
    catalogue: Catalogue, filled: int, samples: SimpleNamespace
) -> None:
    settings = {"not_observable": {"I": {"k12": "no blow along x"}}}
    with catalogue.writing() as session:
        analysis = add_analysis(
            session, kind=AnalysisKind.JOINT_MATRICES, method="another", settings=settings, runs=[filled]
        )
        add_joint_matrix(session, analysis, samples.joint_matrix("I", 2))
    with catalogue.reading() as session:
        parts = content_of(session, filled, ("joint_matrices",)).parts
    (part,) = [part for part in parts if part.labels["method"] == "another"]
    assert part.variables["reason"].values.tolist() == [["", "no blow along x", ""], ["", "", ""], ["", "", ""]]


@pytest.mark.parametrize("names", [("α", "β"), ("a/b", "a_b"), ("x" * 70 + "1", "x" * 70 + "2"), ("runs", "I")])
def test_joints_whose_names_look_the_same_in_a_format_are_all_there(
    catalogue: Catalogue, filled: int, tmp_path: Path, samples: SimpleNamespace, names: tuple[str, str]
) -> None:
    with catalogue.writing() as session:
        analysis = add_analysis(session, kind=AnalysisKind.JOINT_MATRICES, method="another", settings={}, runs=[filled])
        for name in names:
            add_joint_matrix(session, analysis, samples.joint_matrix(name, 2))
    export_mat(catalogue, filled, tmp_path / "run.mat")
    matlab = read_mat(tmp_path / "run.mat")["joint_matrices"][f"analysis_{analysis}"]
    assert sorted(each["joint"] for each in matlab.values() if isinstance(each, dict)) == sorted(names)
    assert matlab["runs"] == filled
    export_hdf5(catalogue, filled, tmp_path / "run.h5")
    with h5py.File(tmp_path / "run.h5") as file:
        groups = file[f"results/joint_matrices/analysis_{analysis}"]
        assert sorted(each.attrs["joint"] for each in groups.values()) == sorted(names)


def test_the_newest_analysis_of_each_method_is_exported(catalogue: Catalogue, filled: int) -> None:
    with catalogue.writing() as session:
        run = start_run(session, kind="hammer", title="t", article="a", setup={}).id
    with catalogue.reading() as session:
        assert content_of(session, run).parts == ()
        kinds = {part.kind for part in content_of(session, filled).parts}
    assert kinds == {"frequency_responses", "modes", "joint_matrices", "comparisons"}


def test_a_comparison_of_older_joints_is_not_exported(
    catalogue: Catalogue, filled: int, samples: SimpleNamespace
) -> None:
    with catalogue.reading() as session:
        before = {part.kind for part in content_of(session, filled).parts}
    with catalogue.writing() as session:
        newer = add_analysis(session, kind="joint_matrices", method="modal", settings={}, runs=[filled])
        add_joint_matrix(session, newer, samples.joint_matrix("I", 2))
    with catalogue.reading() as session:
        after = {part.kind for part in content_of(session, filled).parts}
    assert before - after == {"comparisons"}
