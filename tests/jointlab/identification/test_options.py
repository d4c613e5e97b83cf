"""Averaging of blows by each estimator and through windows, which leave modes and joints unchanged."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.inverse.frequency_law import FrequencyLaw
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.modal.estimation import estimate_modes
from analysis.modal.estimator import Estimator
from jointlab.identification.inverse import LOWEST_LINE, Inverse, inverse_of
from jointlab.identification.load import measurement_of_bundle, measurement_of_run
from jointlab.identification.measurement import MeasuredArticle
from jointlab.identification.options import AS_MEASURED, Options
from store.catalogue import Catalogue
from store.exchange.blow_window import BlowWindow
from store.exchange.bundle import read_bundle
from tests.api.conftest import Command
from tests.jointlab.identification.test_inverse import measured as measured_through

WINDOW = BlowWindow(time_constant=0.5)
COARSE = Options(elements=2)
QUICK = ("--elements", 1, "--joint-law", "constant")
K12, K22 = (0, 1), (1, 1)
TRUE_LOSS_FACTOR = 0.1


def read(demo: Path, options: Options) -> MeasuredArticle:
    with Catalogue.open(f"sqlite:///{demo / 'jointlab.db'}") as catalogue:
        return measurement_of_run(catalogue, 1, options)


@pytest.fixture(scope="module")
def plain(demo: Path) -> Inverse:
    return inverse_of(read(demo, AS_MEASURED), options=COARSE)


@pytest.fixture(scope="module")
def windowed(demo: Path) -> MeasuredArticle:
    return read(demo, Options(exponential_window=WINDOW.time_constant))


def test_modes_seen_through_an_exponential_window_are_damped_as_without_it(
    plain: Inverse, windowed: MeasuredArticle
) -> None:
    found = estimate_modes(windowed.responses(), (LOWEST_LINE, 1024.0))
    low, high = found.loss_factor_ci95.T
    assert np.all((low < plain.modal.modes.loss_factor) & (plain.modal.modes.loss_factor < high))


def test_joints_seen_through_a_window_have_their_damping_where_it_is_stated_and_too_much_where_not() -> None:
    stated = measured_through(1.0, WINDOW)
    found = inverse_of(stated, options=COARSE)
    assert found.measured.decay == found.likelihood.responses.decay == 2.0
    start = [joint.joint for joint in found.fit.joints.values()]
    unstated = replace(stated.responses(), decay=0.0)
    wrong = identify_from_responses(found.free_beam, unstated, start, tolerances=found.tolerances)
    for name, joint in found.fit.joints.items():
        for at in (K12, K22):
            low, high = joint.loss_factor_ci95[at]
            assert low < TRUE_LOSS_FACTOR < high
        assert wrong.joints[name].loss_factor_ci95[K22][0] > TRUE_LOSS_FACTOR


def test_estimator_and_windows_are_chosen_told_stored_and_taken_along_in_a_bundle(
    jointlab: Command, measured: int, tmp_path: Path, plain: Inverse
) -> None:
    chosen = ("--estimator", "Hv", "--force-window", 0.05, "--exponential-window", 0.5)
    answer = jointlab("identify", measured, *chosen, *QUICK, "--json", "found.json")
    assert answer.returncode == 0, answer.stderr
    told = json.loads((tmp_path / "found.json").read_text(encoding="utf-8"))["averaging"]
    assert (told["estimator"], told["window"]) == ("Hv", "force 0.05 s, exponential 0.5 s")
    taken_out = 2.0 / (np.pi * plain.modal.modes.frequency)
    assert told["loss_factor_taken_out"] == pytest.approx(taken_out, rel=1e-2)

    assert jointlab("export", measured, "bundle", "--no-blows").returncode == 0
    bundle = read_bundle(tmp_path / "bundle")
    assert [each.window for each in bundle.setup.inverse] == ["force 0.05 s, exponential 0.5 s"]
    measurement = measurement_of_bundle(bundle)
    found = inverse_of(measurement, options=COARSE)
    assert found.modal.modes.loss_factor == pytest.approx(plain.modal.modes.loss_factor, rel=1e-2)


@pytest.mark.parametrize("choice", [("--estimator", "H2"), ("--exponential-window", 0.5)])
def test_a_bundle_has_no_blows_to_average_again(jointlab: Command, exported: Path, choice: tuple[str, object]) -> None:
    answer = jointlab("identify", exported, *choice)
    assert answer.returncode == 3
    assert "holds accelerances, not blows" in answer.stderr


def test_an_estimator_that_there_is_not_is_refused(jointlab: Command) -> None:
    answer = jointlab("identify", 1, "--estimator", "H3")
    assert answer.returncode == 2
    assert "H1" in answer.stderr


def test_each_estimator_is_that_of_its_average(demo: Path) -> None:
    of_scatter = Estimator.H1, Estimator.H2, Estimator.HV
    h1, h2, hv = (read(demo, Options(estimator=each)).sets[0] for each in of_scatter)
    assert [each.estimator for each in (h1, h2, hv)] == ["H1", "H2", "Hv"]
    lines = h1.frequency > 20
    size = [np.abs(each.accelerance[:, lines]) for each in (h1, h2, hv)]
    assert np.all(size[0] <= size[1])
    np.testing.assert_allclose(size[2] ** 2, size[0] * size[1], rtol=1e-9)


@pytest.mark.parametrize(("exponent", "law"), [(0.0, FrequencyLaw.CONSTANT), (0.1, FrequencyLaw.POWER)])
def test_options_that_an_older_version_stored_mean_what_they_did(exponent: float, law: FrequencyLaw) -> None:
    assert Options.of_settings({"elements": 4, "joint_exponent": exponent}) == Options(elements=4, joint_law=law)
    assert Options.of_settings({}).joint_law is FrequencyLaw.AUTO
