"""The steps of a sequence in words."""

import pytest

from jointlab.sequences.wording import FEW_BLOWS, step_text
from rig.sequences.sequence import HammerStep


@pytest.mark.parametrize(("blows", "warned"), [(2, True), (3, True), (4, False), (10, False)])
def test_a_plan_with_too_few_blows_to_judge_joints_by_says_so(blows: int, warned: bool) -> None:
    text = step_text(HammerStep(step="hammer", points=("1y", "3y"), blows=blows))
    assert text.startswith(f"hammer: {blows} blows at each of 1y, 3y ({2 * blows} blows of about ")
    assert text.endswith(FEW_BLOWS) is warned
