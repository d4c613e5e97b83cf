"""The noise of accelerances where their coherence is all that is known of it."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.inverse.frequency_law import FrequencyLaw
from jointlab.identification.measurement import responses_of
from jointlab.identification.options import Options
from jointlab.identification.pipeline import identify
from tests.jointlab.identification.layouts import LAYOUTS, averaged

CONSTANT = Options(joint_law=FrequencyLaw.CONSTANT)
NINE = LAYOUTS["nine nodes"]


@pytest.mark.parametrize("averages", [2, 3])
def test_a_good_bench_passes_with_two_or_three_averages(averages: int) -> None:
    found = identify(averaged(NINE, averages), CONSTANT)
    assert found.inverse is not None
    assert found.inverse.fit.passed, [check.finding for check in found.inverse.fit.all_checks if not check.passed]
    assert found.inverse.fit.noise_scale < 1.02


@pytest.mark.parametrize("decimals", [2, 3])
def test_a_good_bench_passes_where_its_coherence_is_rounded_to_one_on_many_lines(decimals: int) -> None:
    measurement = averaged(NINE, 10)
    (struck,) = measurement.sets
    assert struck.coherence is not None
    rounded = np.round(struck.coherence, decimals)
    assert 0.3 < np.mean(rounded == 1) < 1.0
    found = identify(replace(measurement, sets=(replace(struck, coherence=rounded),)), CONSTANT)
    assert found.inverse is not None
    assert found.inverse.fit.passed, [check.finding for check in found.inverse.fit.all_checks if not check.passed]


def test_a_coherence_of_one_on_all_lines_does_not_state_the_noise() -> None:
    (struck,) = averaged(NINE, 10).sets
    assert responses_of(struck).variance is not None
    assert responses_of(replace(struck, coherence=np.ones(struck.accelerance.shape))).variance is None
