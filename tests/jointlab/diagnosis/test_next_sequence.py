"""The experiment that a diagnosis asks for becomes a sequence: run as it stands, and with what it asks for in it."""

from contextlib import AbstractContextManager
from importlib import resources
from pathlib import Path
from typing import Any

import pytest

from analysis.gap.experiments.catalogue import EXPERIMENTS, Experiment
from analysis.gap.experiments.next_experiment import NextExperiment
from jointlab.diagnosis.experiment_text import TEXTS, TITLES
from jointlab.diagnosis.next_sequence import PLANS, next_sequence, sequence_for_text
from rig.sequences.sequence import BlankStep, HammerStep, PromptStep, Sequence, SequenceError, SweepStep, sequence_from
from rig.sequences.sequence_file import load_sequence
from rig.sequences.steps import check_plan
from rig.sequences.sweep_plan import Order
from rig.tester.limits import TesterLimits

LIMITS = TesterLimits()


@pytest.fixture(scope="module")
def paper() -> Sequence:
    with paper_file() as path:
        return load_sequence(path)


def paper_file() -> AbstractContextManager[Path]:
    """The built-in sequence."""
    return resources.as_file(resources.files("jointlab.sequences") / "paper.yaml")


def steps_of(sequence: Sequence, kind: type) -> list[Any]:
    return [step for step in sequence.steps if isinstance(step, kind)]


def planned(experiment: Experiment, base: Sequence, limits: TesterLimits = LIMITS) -> Sequence:
    return next_sequence(NextExperiment(experiment, ("density",)), base, limits)


def sweep_of(sequence: Sequence) -> SweepStep:
    assert sequence.sweep is not None
    return sequence.sweep


@pytest.mark.parametrize("experiment", [each.id for each in EXPERIMENTS])
def test_every_experiment_has_a_sequence_that_the_rig_would_run(experiment: Experiment, paper: Sequence) -> None:
    assert experiment in PLANS
    found = planned(experiment, paper)
    check_plan(found, LIMITS)
    assert found.steps != paper.steps
    assert found.title == f"{paper.title}: {TEXTS[experiment]}"


def test_no_plan_is_for_an_experiment_that_no_diagnosis_asks_for() -> None:
    assert set(PLANS) == {*(each.id for each in EXPERIMENTS), Experiment.NEW_SET_UP}


def test_a_third_level_and_a_fourth_amplitude_lie_between_or_beside_those_that_there_are(paper: Sequence) -> None:
    found = planned(Experiment.OTHER_LEVELS, paper)
    assert [step.peak_force for step in found.hammer_steps] == [100, 200]
    assert sweep_of(found).amplitudes_pp_mm == (0.1, 0.05, 0.022, 0.01)
    hard = paper.model_dump(mode="json", exclude_none=True)
    hard["steps"].insert(1, hard["steps"][0] | {"peak_force": 400})
    levels = [step.peak_force for step in planned(Experiment.OTHER_LEVELS, sequence_from(hard)).hammer_steps]
    assert levels == [100, 400, 200]


def test_half_the_force_again_and_again_leaves_blows_that_count(paper: Sequence) -> None:
    (softer,) = planned(Experiment.HALF_FORCE, planned(Experiment.HALF_FORCE, paper)).hammer_steps
    assert (softer.peak_force, softer.weakest_peak, softer.trigger_level) == (25, 7.5, 7.5)


@pytest.mark.parametrize(
    "experiment",
    [
        Experiment.HALF_AMPLITUDE,
        Experiment.RANDOM_ORDER,
        Experiment.HIGHER_FREQUENCY,
        Experiment.ANOTHER_PRESET,
        Experiment.READ_THERMOMETERS,
    ],
)
def test_a_further_sweep_is_corrected_by_blanks_where_the_first_was(experiment: Experiment, paper: Sequence) -> None:
    """A run is corrected by its own blanks alone: without them the frame would look like what is asked about."""
    found = planned(experiment, planned(Experiment.BLANK_TEST, paper))
    assert [step.step for step in found.steps if step.step in ("blank", "sweep")] == ["blank", "blank", "sweep"]


@pytest.fixture
def hung_first(paper: Sequence) -> Sequence:
    """The paper's steps after the same beam in cords, struck more softly."""
    document = paper.model_dump(mode="json", exclude_none=True)
    points = [point for point in document["steps"][0]["points"] if point.endswith("y")]
    hung = document["steps"][0] | {"beam": "suspended", "points": points, "peak_force": 40.0}
    return sequence_from(document | {"steps": [hung, *document["steps"]]})


@pytest.mark.parametrize(
    ("experiment", "forces"),
    [
        (Experiment.HALF_FORCE, [50.0]),
        (Experiment.HEAVIER_ACCELEROMETER, [100.0]),
        (Experiment.ACCELEROMETER_MIDDLE, [100.0]),
    ],
)
def test_the_beam_on_its_joints_is_struck_where_it_was_also_measured_in_cords(
    experiment: Experiment, forces: list[float], hung_first: Sequence
) -> None:
    """A diagnosis uses no blows on a suspended beam."""
    found = planned(experiment, hung_first).hammer_steps
    assert [(step.beam, step.peak_force) for step in found] == [("supported", force) for force in forces]


@pytest.mark.parametrize("experiment", [Experiment.OTHER_LEVELS, Experiment.NEW_SET_UP])
def test_a_further_level_is_one_of_the_beam_on_its_joints(experiment: Experiment, hung_first: Sequence) -> None:
    document = hung_first.model_dump(mode="json", exclude_none=True)
    hung, supported, sweep = document["steps"]
    for steps in ([hung, supported, sweep], [supported, hung, sweep]):
        found = planned(experiment, sequence_from(document | {"steps": steps}))
        assert {step.peak_force for step in found.hammer_steps if step.beam == "supported"} >= {200.0}


@pytest.mark.parametrize(
    ("experiment", "there", "lacking"),
    [
        (Experiment.HALF_AMPLITUDE, "hammer", "sweep"),
        (Experiment.RANDOM_ORDER, "hammer", "sweep"),
        (Experiment.HIGHER_FREQUENCY, "hammer", "sweep"),
        (Experiment.ANOTHER_PRESET, "hammer", "sweep"),
        (Experiment.HALF_FORCE, "sweep", "hammer step on the beam on its joints"),
        (Experiment.HEAVIER_ACCELEROMETER, "sweep", "hammer step on the beam on its joints"),
    ],
)
def test_a_run_without_the_steps_to_repeat_is_refused(
    experiment: Experiment, there: str, lacking: str, paper: Sequence
) -> None:
    document = paper.model_dump(mode="json", exclude_none=True)
    base = sequence_from(document | {"steps": [step for step in document["steps"] if step["step"] == there]})
    with pytest.raises(SequenceError, match=f"no {lacking}"):
        planned(experiment, base)


def test_another_preset_is_not_below_the_lowest(paper: Sequence) -> None:
    document = paper.model_dump(mode="json", exclude_none=True)
    document["steps"][1]["preset_mm"] = 0.9
    limits = TesterLimits(lowest_preset=5e-4)
    found = planned(Experiment.ANOTHER_PRESET, sequence_from(document), limits)
    check_plan(found, limits)
    assert sweep_of(found).preset_mm == 0.7


def test_a_long_title_leaves_room_for_the_experiment(paper: Sequence) -> None:
    found = planned(Experiment.HALF_FORCE, paper.model_copy(update={"title": 498 * "b"}))
    assert len(found.title) == 500
    assert found.title.endswith("b: strike again at half the peak force")


def test_random_order_is_drawn_again(paper: Sequence) -> None:
    shuffled = paper.model_dump(mode="json", exclude_none=True)
    shuffled["steps"][1] |= {"order": "amplitudes", "seed": 7}
    found = planned(Experiment.RANDOM_ORDER, sequence_from(shuffled))
    assert [step.step for step in found.steps] == ["sweep"]
    assert (sweep_of(found).order, sweep_of(found).seed) == (Order.ALL, None)


@pytest.mark.parametrize(("preset", "another"), [(0.5, 0.75), (0.9, 0.45)])
def test_another_preset_is_within_the_limits_and_well_apart(paper: Sequence, preset: float, another: float) -> None:
    document = paper.model_dump(mode="json", exclude_none=True)
    document["steps"][1]["preset_mm"] = preset
    found = planned(Experiment.ANOTHER_PRESET, sequence_from(document))
    assert sweep_of(found).preset_mm == another


def test_a_blank_test_comes_before_the_sweep_that_it_corrects(paper: Sequence) -> None:
    found = planned(Experiment.BLANK_TEST, paper)
    assert [step.step for step in found.steps] == ["blank", "blank", "sweep"]
    assert [(step.piece, step.stiffness) for step in steps_of(found, BlankStep)] == [("blank", None), ("empty", 0.0)]


def test_the_sweep_goes_up_as_far_as_the_rig_lets_it(paper: Sequence) -> None:
    assert sweep_of(planned(Experiment.HIGHER_FREQUENCY, paper)).frequencies.last == LIMITS.highest_frequency
    at_the_limit = planned(Experiment.HIGHER_FREQUENCY, paper, TesterLimits(highest_frequency=200.0))
    assert sweep_of(at_the_limit).frequencies.last == 200
    assert "have it widened" in steps_of(at_the_limit, PromptStep)[0].text


def test_work_of_the_operator_is_a_prompt_before_the_blows(paper: Sequence) -> None:
    found = planned(Experiment.TURN_ACCELEROMETER, paper)
    assert [step.step for step in found.steps] == ["prompt", "hammer"]
    assert "90 degrees" in steps_of(found, PromptStep)[0].text


def test_a_free_beam_is_struck_across_only(paper: Sequence) -> None:
    (step,) = planned(Experiment.FREE_BEAM, paper).steps
    assert isinstance(step, HammerStep)
    assert step.beam == "suspended"
    assert all(point.endswith("y") for point in step.points)
    assert step.block_seconds >= 4


def test_a_gap_that_nothing_explains_asks_for_a_new_set_up_another_level_and_a_second_place(paper: Sequence) -> None:
    found = planned(Experiment.NEW_SET_UP, paper)
    assert [step.step for step in found.steps] == ["prompt", "hammer", "hammer", "sweep"]
    assert len({step.peak_force for step in found.hammer_steps}) == 2
    assert found.article.accelerometer.node == 11
    assert "move the accelerometer to 11y" in steps_of(found, PromptStep)[0].text


def test_an_effect_to_be_corrected_is_a_prompt_before_all_is_measured_again(paper: Sequence) -> None:
    found = next_sequence(NextExperiment(Experiment.CORRECT_EFFECTS, ("mesh_error",)), paper, LIMITS)
    assert steps_of(found, PromptStep)[0].text == "Repeat the measurement with mesh_error corrected"
    assert found.steps[1:] == paper.steps


def test_of_an_experiment_stored_as_text_alone_the_text_is_a_prompt_before_all_is_measured_again(
    paper: Sequence,
) -> None:
    found = sequence_for_text("listen out of the plane: expected to confirm it; earth the hammer", paper, LIMITS)
    assert steps_of(found, PromptStep)[0].text == "Listen out of the plane: expected to confirm it; earth the hammer"
    assert found.steps[1:] == paper.steps


def test_an_experiment_whose_text_is_long_has_a_short_title(paper: Sequence) -> None:
    found = planned(Experiment.NEW_SET_UP, paper)
    assert found.title == f"{paper.title}: look at the bench where the map shows the gap"
    assert all(len(title) < len(TEXTS[each]) for each, title in TITLES.items())


def test_prompts_of_the_experiment_before_are_not_asked_again(paper: Sequence) -> None:
    once = planned(Experiment.OUT_OF_PLANE, paper)
    twice = planned(Experiment.GUIDED_HAMMER, once)
    assert [step.step for step in twice.steps] == ["prompt", "hammer"]


def test_what_records_show_is_to_be_corrected_first(paper: Sequence) -> None:
    asked = NextExperiment(Experiment.GUIDED_HAMMER, ("impact_angle",), corrections=("mains_hum",))
    first, second, _ = next_sequence(asked, paper, LIMITS).steps
    assert isinstance(first, PromptStep)
    assert isinstance(second, PromptStep)
    assert first.text == "Shield the accelerometer and its cable from the mains and strike again"
    assert second.text.startswith("Guide the hammer")


def test_where_only_records_are_to_be_corrected_all_is_measured_again(paper: Sequence) -> None:
    asked = NextExperiment(Experiment.NOTHING, corrections=("double_hit", "mains_hum"))
    first, second, *others = next_sequence(asked, paper, LIMITS).steps
    assert isinstance(first, PromptStep)
    assert isinstance(second, PromptStep)
    assert first.text == "Strike again so that the hammer does not bounce"
    assert second.text.startswith("Shield the accelerometer")
    assert tuple(others) == paper.steps
