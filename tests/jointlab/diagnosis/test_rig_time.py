"""The time of an experiment follows from the steps of a sequence."""

from jointlab.diagnosis.rig_time import rig_time
from jointlab.sequences import BUILT_IN, built_in
from jointlab.sequences.wording import step_seconds


def test_the_paper_takes_the_time_of_its_own_steps_and_of_settling() -> None:
    time = rig_time()
    (hammer,), sweep = built_in(BUILT_IN).hammer_steps, built_in(BUILT_IN).steps[-1]
    assert time.point * len(hammer.points) == step_seconds(hammer)
    assert 720 * time.sine >= step_seconds(sweep)
