"""Gaps on data that a fit did not see."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.gap.findings.gaps import floor_percent
from analysis.gap.fitting.fit import Fit
from analysis.gap.fitting.held_out import _by_a_step, _folds, _refitted_without, held_out
from analysis.gap.fitting.scale_estimate import with_likely_scales
from tests.analysis.gap.conftest import Made, fitted


@pytest.fixture(scope="module")
def found(made: Made) -> Fit:
    measurement = made()
    thinned = tuple(each.lines(np.arange(0, each.frequency.size, 2)) for each in measurement.sets)
    return fitted(replace(measurement, sets=thinned))


def test_leaving_a_row_out_by_a_step_is_fitting_without_it(found: Fit, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("analysis.gap.fitting.held_out.REFIT_GAIN", 1e-3)
    sets = found.likelihood.measurement.sets
    stepped = _by_a_step(found)
    for fold in _folds(sets)[::2]:
        step, again = stepped(found, fold), _refitted_without(found, fold)
        assert step.keys() == again.keys() == fold.keys()
        for number, row in fold.items():
            (stepped_to, _), (fitted_to, _) = step[number], again[number]
            left = sets[number].accelerance[row]
            assert 0 < np.linalg.norm(stepped_to - fitted_to) < 0.05 * np.linalg.norm(left - fitted_to)


def test_every_row_of_every_set_is_left_out_once_and_its_point_stays_in_another_set(found: Fit) -> None:
    sets = found.likelihood.measurement.sets
    folds = _folds(sets)
    left_out = [place for fold in folds for place in fold.items()]
    assert sorted(left_out) == [(number, row) for number, each in enumerate(sets) for row in range(len(each.inputs))]
    for fold in folds:
        points = [sets[number].inputs[row] for number, row in fold.items()]
        assert len(set(points)) == len(points)


def test_a_model_that_holds_predicts_unseen_rows_as_well_as_tolerances_allow(found: Fit) -> None:
    gap = held_out(found)
    assert gap.inverse is not None
    assert gap.direct is not None
    assert gap.overall is gap.inverse
    assert gap.direct.sigma == pytest.approx(1.0, abs=0.25)
    assert gap.inverse.percent < 3 * floor_percent(found)
    low, high = gap.ci90_percent
    assert low < gap.inverse.percent < high


def test_of_a_model_that_holds_next_to_nothing_is_the_models_own(found: Fit) -> None:
    gap = held_out(found)
    assert gap.inverse is not None
    assert gap.direct is not None
    assert gap.inverse.model_percent < 0.2 * gap.inverse.percent
    assert gap.direct.model_percent < 0.5 * gap.direct.percent


def test_smooth_errors_that_every_bench_has_do_not_count_as_remaining(found: Fit) -> None:
    measurement, random = found.likelihood.measurement, np.random.default_rng(6)
    error, sets = 0.01, []
    for each in measurement.sets:
        apart = each.frequency[:, None] - each.frequency
        smooth = np.linalg.cholesky(np.exp(-(apart**2) / (2 * 30.0**2)) + 1e-9 * np.eye(each.frequency.size))
        real, imaginary = error * random.standard_normal((2, *each.accelerance.shape)) @ smooth.T
        sets.append(replace(each, accelerance=each.accelerance * (1 + real + 1j * imaginary)))
    stated = replace(measurement.tolerances, model_error=error)
    gap = held_out(with_likely_scales(fitted(replace(measurement, sets=tuple(sets), tolerances=stated))))
    assert gap.inverse is not None
    assert gap.inverse.model_percent == pytest.approx(100 * error * np.sqrt(2), rel=0.3)
    assert gap.inverse.remaining_percent < 0.5 * gap.inverse.model_percent


def test_a_row_that_the_model_cannot_make_widens_the_gap(found: Fit) -> None:
    measurement = found.likelihood.measurement
    once = held_out(found)
    first = measurement.sets[0]
    accelerance = first.accelerance.copy()
    accelerance[2] *= 1.3
    sets = (replace(first, accelerance=accelerance), *measurement.sets[1:])
    worse = held_out(fitted(replace(measurement, sets=sets)))
    assert worse.overall.percent > once.overall.percent + 1
    assert worse.overall.model_percent > 0.8 * worse.overall.percent
    assert worse.overall.remaining_percent > 0.9 * worse.overall.model_percent
    assert worse.overall.sigma > 2 * once.overall.sigma


def test_the_tester_alone_is_left_out_in_eighths(found: Fit) -> None:
    measurement = replace(found.likelihood.measurement, sets=())
    alone = fitted(measurement)
    gap = held_out(alone)
    assert gap.inverse is None
    assert gap.overall is gap.direct
    assert gap.overall.sigma == pytest.approx(1.0, abs=0.25)


@pytest.mark.parametrize("sets", [1, 2])
@pytest.mark.parametrize("holds", [True, False])
def test_one_row_is_left_out_of_one_set_at_a_time(found: Fit, sets: int, holds: bool) -> None:
    measurement = found.likelihood.measurement
    some = tuple(each.rows(np.arange(len(each.inputs)) == 0) for each in measurement.sets[:sets])
    if not holds:
        some = tuple(replace(each, deviation=each.deviation / 10) for each in some)
    gaps = held_out(fitted(replace(measurement, sets=some)))
    assert gaps.inverse is not None
    assert 0 < gaps.inverse.percent < 30
