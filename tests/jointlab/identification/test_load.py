"""Loading of measurements: the raw blows of a run show how they scatter, imported averages cannot."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.modal.estimation import ModalEstimate, estimate_modes
from jointlab.identification.bundle_blows import scatter_of_bundle
from jointlab.identification.load import measurement_of_bundle, measurement_of_run
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.pipeline import Identification, identify
from jointlab.trials.simulated_operator import SimulatedOperator
from store.catalogue import Catalogue
from store.exchange.bundle import read_bundle
from store.exchange.bundle_exchange import export_bundle, import_bundle

BAND = (20.0, 1024.0)


@pytest.fixture(scope="module")
def measurement(demo: Path) -> MeasuredArticle:
    with Catalogue.open(f"sqlite:///{demo / 'jointlab.db'}") as catalogue:
        return measurement_of_run(catalogue, 1)


def test_a_run_measured_here_knows_how_far_each_blow_moves_its_average(measurement: MeasuredArticle) -> None:
    responses = measurement.responses()
    assert responses.scatter is not None
    assert responses.variance is not None
    assert responses.scatter.shape == (11, 10, responses.frequency.size)
    # raised as a weight, of ten blows and five lines
    variance = 90 / 88 * np.sum(np.abs(responses.scatter) ** 2, axis=1) / 2
    assert np.sum(variance) == pytest.approx(np.sum(responses.variance), rel=0.02)
    # of one row a few per cent more, as a harder blow weighs more in its average
    assert np.sum(variance, axis=1) == pytest.approx(np.sum(responses.variance, axis=1), rel=0.1)


def test_intervals_of_modes_of_a_run_count_what_blows_do_to_all_lines_together(measurement: MeasuredArticle) -> None:
    responses = measurement.responses()
    counted = estimate_modes(responses, BAND)
    lines_alone = estimate_modes(replace(responses, scatter=None), BAND)
    assert np.all(counted.modes.poles == lines_alone.modes.poles)
    assert np.median(widths(counted) / widths(lines_alone)) > 1.5


def test_a_sine_point_beside_the_mains_has_the_stiffness_of_its_own_frequency_and_is_found_by_its_plan(
    measurement: MeasuredArticle,
) -> None:
    points = {point.frequency: point.result.frequency for point in measurement.points}
    # the last points are those at 0.01 mm, whose frequency beside the mains has a standard error of 6e-5
    assert points == pytest.approx({20.0: 20.0, 100.0: 98.0, 180.0: 180.0}, rel=5e-4)
    assert not any(point.result.remarks for point in measurement.points)


def widths(estimate: ModalEstimate) -> np.ndarray:
    return np.diff(estimate.frequency_ci95, axis=1).ravel()


def test_averages_of_a_bundle_have_no_scatter(exported: Path) -> None:
    assert measurement_of_bundle(read_bundle(exported)).responses().scatter is None


def test_forces_are_those_of_the_blows_that_are_averaged(measurement: MeasuredArticle) -> None:
    (struck,) = measurement.sets
    forces = measurement.forces[struck.number]
    assert tuple(map(str, (each.point for each in forces))) == tuple(map(str, struck.inputs))
    assert {each.force.shape for each in forces} == {(10, round(struck.sample_rate * struck.block_seconds))}
    peaks = [float(force.max()) for each in forces for force in each.force]
    assert np.mean(peaks) == pytest.approx(struck.peak_force, rel=0.01)


def test_forces_of_a_bundle_are_known_where_it_has_a_record_at_every_point(demo: Path, tmp_path: Path) -> None:
    folder = tmp_path / "whole"
    with Catalogue.open(f"sqlite:///{demo / 'jointlab.db'}") as catalogue:
        export_bundle(catalogue, 1, folder)
        whole = measurement_of_run(catalogue, 1)
    read = read_bundle(folder)
    found = measurement_of_bundle(read)
    assert sum(len(each.force) for each in found.forces[1]) == sum(len(each.force) for each in whole.forces[1])
    with Catalogue.open(f"sqlite:///{tmp_path / 'other.db'}") as catalogue:
        again = measurement_of_run(catalogue, import_bundle(catalogue, read))
    assert [each.point for each in again.forces[1]] == [each.point for each in found.forces[1]]
    lacking = [blow for blow in read.blows if str(blow.point) != "5y"]
    assert measurement_of_bundle(replace(read, blows=tuple(lacking))).forces == {}
    two = (read.inverse[0], replace(read.inverse[0], number=2))
    assert measurement_of_bundle(replace(read, inverse=two)).forces == {}


def test_joints_of_a_run_have_the_same_intervals_where_it_is_exported_and_imported_again(
    demo: Path, identified: Identification, tmp_path: Path
) -> None:
    with Catalogue.open(f"sqlite:///{demo / 'jointlab.db'}") as catalogue:
        export_bundle(catalogue, 1, tmp_path / "whole")
        export_bundle(catalogue, 1, tmp_path / "averages", blows=False)
    there, averages = (
        identify(replace(measurement_of_bundle(read_bundle(tmp_path / name)), points=()))
        for name in ("whole", "averages")
    )
    for name in ("I", "II"):
        own, same, lines = (
            each.inverse.likelihood.joints[name] for each in (identified, there, averages) if each.inverse
        )
        np.testing.assert_allclose(same.k_ci95[:2, :2], own.k_ci95[:2, :2], rtol=0.02)
        assert not np.allclose(lines.k_ci95[:2, :2], own.k_ci95[:2, :2], rtol=0.02)  # it is the blows that tell them


def test_blows_that_were_not_averaged_say_nothing_of_the_average(demo: Path, tmp_path: Path) -> None:
    with Catalogue.open(f"sqlite:///{demo / 'jointlab.db'}") as catalogue:
        export_bundle(catalogue, 1, tmp_path / "whole")
    read = read_bundle(tmp_path / "whole")
    (measured,) = read.inverse
    whole = scatter_of_bundle(read.inverse, read.blows)[1]
    others = (replace(measured, accelerance=1.1 * measured.accelerance),)
    assert scatter_of_bundle(others, read.blows) == {}
    assert scatter_of_bundle((replace(measured, frequency=2 * measured.frequency),), read.blows) == {}
    by_point = [[blow for blow in read.blows if blow.point == point] for point in measured.inputs]
    three = tuple(blow for blows in by_point for blow in blows[:3])
    assert scatter_of_bundle(read.inverse, three) == {}
    half = tuple(blow for blows in by_point for blow in blows[:5])
    ratio = np.linalg.norm(scatter_of_bundle(read.inverse, half)[1]) / np.linalg.norm(whole)
    assert ratio == pytest.approx(1.0, rel=0.2)  # fewer blows, and each of them stands for two
    longer = replace(read.blows[0], force=np.append(read.blows[0].force, 0.0))
    assert scatter_of_bundle(read.inverse, (longer, *read.blows[1:])) == {}


@pytest.mark.usefixtures("drive")
def test_a_blow_that_the_others_of_its_point_contradict_is_in_no_average(
    jointlab: Callable[..., CompletedProcess[str]], sequence: Callable[..., Path], tmp_path: Path,
    operator: SimulatedOperator, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    plain = operator.strike

    def strike(point: Dof, blow: int) -> None:
        plain(Dof.parse("6y") if (str(point), blow) == ("5y", 1) else point, blow)

    monkeypatch.setattr(operator, "strike", strike)
    struck = jointlab("run", sequence(hammer={"blows": 3}))
    assert struck.returncode == 0, struck.stderr
    assert "blow 1 at 5y left out: inconsistent with the others at its point" in struck.stderr
    with Catalogue.open(f"sqlite:///{tmp_path / 'jointlab.db'}") as catalogue:
        measurement = measurement_of_run(catalogue, 1)
    (left_out,) = measurement.left_out
    assert left_out.startswith("set 1, blow 1 at 5y: inconsistent with the others at its point")
    responses = measurement.responses()
    assert responses.coherence is not None
    assert np.median(responses.coherence[responses.row(Dof.parse("5y"))]) > 0.99
