"""The next experiment in a sentence, and in a document."""

from dataclasses import asdict

import pytest

from analysis.gap.catalogue import laws
from analysis.gap.evidence.verdict import UNKNOWN
from analysis.gap.experiments.catalogue import CHECKS, Experiment
from analysis.gap.experiments.next_experiment import NextExperiment
from jointlab.diagnosis.catalogue import title_of
from jointlab.diagnosis.experiment_text import CORRECTIONS, TEXTS, experiment_of, sentence
from jointlab.diagnosis.investigation_text import effects_text
from jointlab.diagnosis.reading_text import reading_label, reading_words


def test_every_experiment_has_a_text_and_every_effect_that_records_show_a_correction() -> None:
    assert set(TEXTS) == set(Experiment) - {Experiment.CORRECT_EFFECTS}
    assert set(CORRECTIONS) == {law.id for law in laws() if law.law == "found in records"}


@pytest.mark.parametrize(
    ("experiment", "expected"),
    [
        (
            NextExperiment(
                Experiment.GUIDED_HAMMER,
                ("impact_angle",),
                information=0.09,
                doubt=0.3,
                minutes=19.6,
                corrections=("mains_hum",),
            ),
            "strike with a guided hammer: expected to confirm impact_angle, 30 % of the uncertainty removed in 20 min; "
            "shield the accelerometer and its cable from the mains and strike again",
        ),
        (
            NextExperiment(Experiment.WEIGH_PARTS, ("density", "joint_mass"), True, 0.9, 0.9, 10.0),
            "weigh the accelerometer, the caps and the beam: expected to tell density from joint_mass, 100 % of the "
            "uncertainty removed in 10 min",
        ),
        (
            NextExperiment(Experiment.CORRECT_EFFECTS, ("density", "mesh_error")),
            "repeat the measurement with density and mesh_error corrected",
        ),
        (
            NextExperiment(Experiment.NOTHING),
            "nothing is asked for: simulation and measurement agree within noise and tolerances",
        ),
        (
            NextExperiment(Experiment.NOTHING, corrections=("double_hit",)),
            "strike again so that the hammer does not bounce",
        ),
    ],
)
def test_a_sentence_says_what_to_do_what_it_tells_and_what_to_correct(
    experiment: NextExperiment, expected: str
) -> None:
    assert sentence(experiment) == expected


def test_people_see_titles_of_effects_where_data_have_ids() -> None:
    experiment = NextExperiment(Experiment.WEIGH_PARTS, ("density", "joint_mass"), True, 0.9, 0.9, 10.0)
    assert "expected to tell density off from mass at the joints, " in sentence(experiment, title_of)
    assert effects_text(("channel_delay", "density")) == "delay between the channels and density off"
    assert effects_text(UNKNOWN) == "a cause in no catalogue"


def test_every_reading_that_may_be_asked_for_has_words_and_a_unit() -> None:
    asked = {f"{each.effect}.{each.parameter}" for check in CHECKS.values() for each in check.readings}
    # those of each joint or point end with its name
    assert [name for name in asked if all(reading_words(each) == each for each in (name, f"{name}_II"))] == []
    assert reading_label("channel_delay.tau", "s") == "delay of the acceleration after the force (s)"
    assert reading_label("joint_mass.m_II", "kg") == "mass of caps and bolts at joint II (kg)"
    assert reading_label("impact_position.shift_3", "m") == (
        "distance of the blows from mark 3, positive to the right (m)"
    )
    assert reading_label("density.relative", "1").endswith("less one (a ratio)")
    assert reading_words("of_a_plug_in.x") == "of_a_plug_in.x"


def test_a_document_holds_the_experiment_and_older_ones_only_its_text() -> None:
    experiment = NextExperiment(Experiment.WEIGH_PARTS, ("density",), True, 0.8, 0.9, 10.0, ("mains_hum",))
    assert experiment_of({"experiment": asdict(experiment)}) == experiment
    assert experiment_of({"next_experiment": "weigh the accelerometer"}) is None
    before = {"id": "weigh_parts", "effects": ["density"], "tells_apart": False, "separation": 9.0, "corrections": []}
    assert experiment_of({"experiment": before}) == NextExperiment(Experiment.WEIGH_PARTS, ("density",))
