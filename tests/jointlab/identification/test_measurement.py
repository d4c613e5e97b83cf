"""The noise of accelerances where their coherence is all that is known of it."""

import pytest

from analysis.inverse.frequency_law import FrequencyLaw
from jointlab.identification.options import Options
from jointlab.identification.pipeline import identify
from tests.jointlab.identification.layouts import LAYOUTS, averaged

CONSTANT = Options(joint_law=FrequencyLaw.CONSTANT)
NINE = LAYOUTS["nine nodes"]


@pytest.mark.parametrize("averages", [2, 3])
def test_a_good_bench_passes_with_two_or_three_averages(averages: int) -> None:
    found = identify(averaged(NINE, averages), CONSTANT)
    assert found.inverse is not None
    assert found.inverse.fit.passed, [check.text for check in found.inverse.fit.all_checks if not check.passed]
    assert found.inverse.fit.noise_scale < 1.02
