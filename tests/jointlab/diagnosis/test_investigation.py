"""An investigation asks, takes the answer, weighs all data and readings, and goes on where it was interrupted."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from shutil import copytree

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.gap.diagnosis import Diagnosis
from analysis.gap.effect import Effect
from analysis.gap.effects.beam import AccelerometerMass, YoungsModulus
from analysis.gap.effects.tester import FrameResonance
from analysis.gap.evidence.verdict import UNKNOWN, Status, Weighed
from analysis.gap.experiments.catalogue import CHANGES_THE_BENCH, CHECKS, EXPERIMENTS, Experiment
from analysis.gap.experiments.missing_condition import MissingCondition
from analysis.gap.experiments.next_experiment import NextExperiment
from analysis.gap.experiments.requested_data import Missing, Mounting
from analysis.gap.fitting.fit import fit
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.fitting.model import Model
from analysis.gap.measurement import Configuration, Measurement
from analysis.gap.search.single_effects import search_of
from analysis.gap.simulation.free_beam_modes import beam_modes_of
from jointlab.diagnosis.investigation import (
    Answer,
    Asked,
    Budget,
    Data,
    Investigation,
    Readings,
    Refused,
    Step,
    all_data,
    next_step,
    step_after_refusal,
    with_step,
    without_answer,
)
from jointlab.diagnosis.investigation_folder import answered, begun, investigate, save, stored
from jointlab.diagnosis.investigation_text import how_to_answer, last_sentence, missing_sentences, steps_table
from jointlab.diagnosis.load import Subject, subject_of_bundle
from jointlab.diagnosis.missing_text import missing_text
from jointlab.diagnosis.reading_text import reading_label
from jointlab.errors import JointlabError
from store.exchange.bundle import read_bundle
from tests.analysis.gap.conftest import blank, drawn
from tests.bench.sealed_bench import SealedBench
from tests.investigations import DELAY, case_of, small, small_further, struck_harder, with_few_lines

READ = {"accelerometer_mass.m": 0.0135}


def load(source: str) -> Subject:
    return subject_of_bundle(read_bundle(Path(source)))


def fitted(measurement: Measurement, *effects: Effect) -> Model:
    simulation = replace(
        search_of(measurement, ()).simulation(), modes=beam_modes_of(measurement.drawing), effects=effects
    )
    start = np.zeros(Likelihood(simulation).unknowns)
    return Model(effects, fit(simulation, start))


@pytest.fixture(scope="module")
def explanations() -> tuple[Weighed[Model], ...]:
    """Two that are as good as each other on a bench with 13.5 g too much at the accelerometer."""
    empty = blank(drawn())
    simulation = replace(
        search_of(empty, ()).simulation(), modes=beam_modes_of(empty.drawing), effects=(AccelerometerMass(),)
    )
    likelihood = Likelihood(simulation)
    scores = np.zeros(likelihood.unknowns)
    scores[Model((AccelerometerMass(),), fit(simulation, scores, most_steps=0)).places(0)] = 0.5
    seen = likelihood.predict(scores, ())
    assert empty.points is not None
    measured = replace(
        empty,
        sets=tuple(replace(e, accelerance=a) for e, a in zip(empty.sets, seen.accelerances, strict=True)),
        points=replace(empty.points, stiffness=seen.stiffness),
    )
    models = fitted(measured, AccelerometerMass()), fitted(measured, YoungsModulus())
    weighed = [Weighed(m.ids, m, 0.0, p) for m, p in zip(models, (0.4, 0.5), strict=True)]
    return (weighed[1], weighed[0], Weighed(UNKNOWN, weighed[1].model, 0.0, 0.1))


@pytest.fixture
def found(diagnosis: Callable[..., Diagnosis], explanations: tuple[Weighed[Model], ...]) -> Diagnosis:
    return diagnosis(explanations=explanations)


def test_a_doubtful_verdict_asks_for_what_tells_most_and_a_reading_decides(found: Diagnosis) -> None:
    state = Investigation("first", Budget())
    first = next_step(state, found)
    assert (first.effects, first.probability, first.ended) == (("youngs_modulus",), 0.5, None)
    assert first.asked is not None
    assert first.asked.experiment.id is Experiment.WEIGH_PARTS
    assert first.asked.readings == {"accelerometer_mass.m": "kg"}
    assert first.asked.experiment.information > 0.5
    state = replace(state, steps=(replace(first, answer=Readings(READ)),))
    second = next_step(state, found)
    assert (second.effects, second.ended) == (("accelerometer_mass",), "certain")
    assert second.probability > 0.99


def test_an_effect_that_an_instrument_does_not_find_is_left_out(found: Diagnosis) -> None:
    asked = next_step(Investigation("first", Budget()), found)
    for value, absent in ((0.0135, frozenset()), (4e-4, {"accelerometer_mass"})):
        answer = Readings({"accelerometer_mass.m": value})
        assert Investigation("first", Budget(), (replace(asked, answer=answer),)).absent == absent


def test_an_effect_of_which_a_part_was_not_read_is_not_left_out() -> None:
    """Joint I is where it was drawn; nobody measured joint II."""
    wanted = {"support_position.dx_I": "m", "support_position.dx_II": "m"}
    asked = Asked(NextExperiment(Experiment.MEASURE_PLACES, information=1.0, doubt=1.0, minutes=5.0), "ruler", wanted)
    for values, absent in (
        ({"support_position.dx_I": 1e-4}, frozenset()),
        ({"support_position.dx_I": 1e-4, "support_position.dx_II": -2e-4}, {"support_position"}),
        ({"support_position.dx_I": 1e-4, "support_position.dx_II": 8e-3}, frozenset()),
    ):
        step = Step(1, Status.EXPLAINED, ("support_position",), 0.6, asked, Readings(values))
        assert Investigation("first", Budget(), (step,)).absent == absent


def test_an_effect_that_nothing_tested_is_not_certain(found: Diagnosis) -> None:
    asked = next_step(Investigation("first", Budget()), found)
    read = Investigation("first", Budget(), (replace(asked, answer=Readings(READ)),))
    assert read.untested(("accelerometer_mass",)) == frozenset()
    assert read.untested(("accelerometer_mass", "cubic_stiffness")) == {"cubic_stiffness"}
    both = replace(read, steps=(*read.steps, replace(asked, answer=Data("second"))))
    assert both.untested(("accelerometer_mass", "cubic_stiffness")) == frozenset()


def test_one_over_a_resonance_is_asked_for_in_the_unit_that_is_weighed(
    found: Diagnosis, explanations: tuple[Weighed[Model], ...]
) -> None:
    """A blank test reads 1 / f_r, which is zero for a rigid frame; 450 typed in Hz would be 4.5 million deviations."""
    measurement = explanations[0].model.fit.likelihood.measurement
    frame = fitted(measurement, FrameResonance())
    two = (Weighed(frame.ids, frame, 0.0, 0.5), replace(explanations[0], probability=0.5))
    others = [each.id for each in EXPERIMENTS if each.id is not Experiment.BLANK_TEST]
    refused = [Step(1, Status.EXPLAINED, (), 0.5, Asked(NextExperiment(each), ""), Refused("no")) for each in others]
    state = Investigation("first", Budget(), tuple(refused))
    step = next_step(state, replace(found, explanations=two))
    assert step.asked is not None
    assert step.asked.readings == {"frame_resonance.f_r": "1/Hz"}
    assert "frame_resonance.f_r in 1/Hz" in how_to_answer(step.asked)
    assert reading_label("frame_resonance.f_r", "1/Hz") == "1 over the resonance of the tester's frame (1/Hz)"
    assert reading_label("foundation_compliance.k_f", "m/N") == "1 over the stiffness of the foundation (m/N)"
    for value, leads in ((1 / frame.fit.value("f_r"), ("frame_resonance",)), (0.0, ("youngs_modulus",))):
        read = replace(state, steps=(*refused, replace(step, answer=Readings({"frame_resonance.f_r": value}))))
        assert next_step(read, replace(found, explanations=two)).effects == leads


def test_a_refused_experiment_costs_nothing_and_is_not_asked_for_again(found: Diagnosis) -> None:
    state = Investigation("first", Budget())
    for _ in range(3):
        step = next_step(state, found)
        assert step.asked is not None
        assert step.asked.experiment.id not in CHANGES_THE_BENCH
        state = with_step(state, replace(step, answer=Refused("no scales")))
        assert step_after_refusal(state) == next_step(state, found)  # the same, without a diagnosis
    assert len({each.asked.experiment.id for each in state.steps if each.asked}) == 3
    assert (state.minutes, state.made) == (0, ())
    assert [bool(each.otherwise) for each in state.steps] == [False, False, True]  # of the last step alone
    of_older_version = replace(state, steps=(replace(state.steps[-1], otherwise=()),))
    assert step_after_refusal(of_older_version) is None
    read = replace(state, steps=(replace(state.steps[-1], answer=Readings(READ)),))
    assert step_after_refusal(read) is None


def test_it_ends_where_the_budget_is_spent_or_nothing_would_help(found: Diagnosis) -> None:
    for poor in (Budget(minutes=1.0), Budget(experiments=0)):
        assert next_step(Investigation("first", poor), found).ended == "budget"
    alone = replace(found, explanations=(replace(found.explanations[0], probability=1.0),))
    assert next_step(Investigation("first", Budget()), alone).ended == "nothing would help"
    none = replace(alone, status=Status.NONE)
    assert next_step(Investigation("first", Budget()), none).ended == "nothing would help"


def test_where_the_most_informative_experiment_is_too_long_a_shorter_one_is_asked_for() -> None:
    long, short, shorter, last = (
        Asked(NextExperiment(each, ("density",), information=bits, doubt=1.0, minutes=minutes), each.value)
        for each, bits, minutes in (
            (Experiment.FREE_BEAM, 0.9, 40.0),
            (Experiment.WEIGH_PARTS, 0.4, 10.0),
            (Experiment.MEASURE_PLACES, 0.1, 5.0),
            (Experiment.CORRECT_EFFECTS, 0.0, 0.0),
        )
    )
    step = Step(1, Status.EXPLAINED, ("density",), 0.6, short, Refused("no"), otherwise=(long, short, shorter, last))
    asked = step_after_refusal(Investigation("first", Budget(minutes=20.0), (step,)))
    assert asked is not None
    assert (asked.asked, asked.otherwise, asked.ended) == (short, (long, shorter, last), None)
    spent = step_after_refusal(Investigation("first", Budget(minutes=2.0), (step,)))
    assert spent is not None
    assert (spent.asked, spent.ended) == (None, "budget")
    useless = replace(step, otherwise=(last,))
    nothing = step_after_refusal(Investigation("first", Budget(minutes=2.0), (useless,)))
    assert nothing is not None
    assert nothing.ended == "nothing would help"


def test_a_first_verdict_alone_is_never_certain(found: Diagnosis) -> None:
    sure = replace(found, explanations=tuple(
        replace(each, probability=p) for each, p in zip(found.explanations, (0.98, 0.01, 0.01), strict=True)
    ))  # fmt: skip
    assert next_step(Investigation("first", Budget()), sure).ended is None


def test_a_stored_investigation_is_read_as_it_was_and_shown(found: Diagnosis, tmp_path: Path) -> None:
    step = next_step(Investigation("first", Budget()), found)
    state = Investigation("first", Budget(), (step,))
    save(tmp_path, state)
    assert stored(tmp_path) == state
    assert stored(tmp_path / "elsewhere") is None
    assert step.asked is not None
    assert how_to_answer(step.asked).startswith("answer with --reading NAME=VALUE of accelerometer_mass.m in kg")
    assert last_sentence(state).startswith("asked for: weigh the accelerometer")
    assert steps_table(state).rows[0][1] == "Young's modulus off"
    (tmp_path / "investigation.json").write_text("{}")
    with pytest.raises(JointlabError, match="not a stored investigation"):
        stored(tmp_path)


def test_a_wrong_answer_is_refused_and_the_step_stays_open(found: Diagnosis, tmp_path: Path) -> None:
    state = Investigation("first", Budget(), (next_step(Investigation("first", Budget()), found),))
    save(tmp_path, state)
    with pytest.raises(JointlabError, match=r"give accelerometer_mass\.m"):
        answered(tmp_path, state, Readings({"joint_mass.m": 0.1}), load)
    assert stored(tmp_path) == state
    after = answered(tmp_path, state, Readings(READ), load)
    assert stored(tmp_path) == after
    with pytest.raises(JointlabError, match="has no open question; continue"):
        answered(tmp_path, after, Readings(READ), load)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_reading_that_is_no_number_is_refused(found: Diagnosis, tmp_path: Path, value: float) -> None:
    state = Investigation("first", Budget(), (next_step(Investigation("first", Budget()), found),))
    save(tmp_path, state)
    with pytest.raises(JointlabError, match=r"accelerometer_mass\.m is .*, which is no number"):
        answered(tmp_path, state, Readings({"accelerometer_mass.m": value}), load)
    assert stored(tmp_path) == state
    assert "NaN" not in (tmp_path / "investigation.json").read_text()


def test_data_that_are_there_already_do_not_count_twice(found: Diagnosis, tmp_path: Path) -> None:
    """A bundle that has grown: the blows at half the force stand beside what was diagnosed before."""
    first, grown = small(5, tmp_path / "first"), copytree(tmp_path / "first", tmp_path / "grown")
    softer = small_further(5, tmp_path / "further")
    state = Investigation(str(first), Budget(), (next_step(Investigation("first", Budget()), found),))
    state = replace(state, steps=(asked_for_data(state),))
    by_source = {str(first): load(str(first)), str(softer): load(str(softer))}
    before, new = (by_source[str(each)].measurement for each in (first, softer))
    for kept in (
        replace(before, points=None, sets=(*before.sets, *new.sets)),
        replace(before, sets=new.sets),
    ):
        by_source[str(grown)] = replace(by_source[str(first)], measurement=kept)
        with pytest.raises(AnalysisError, match=r"are among the data already; give .* without"):
            answered(tmp_path / "folder", state, Data(str(grown)), by_source.__getitem__)
        with pytest.raises(AnalysisError, match="are among the data already"):
            all_data(replace(state, steps=(replace(state.steps[0], answer=Data(str(grown))),)), by_source.__getitem__)
    assert stored(tmp_path / "folder") is None
    assert answered(tmp_path / "folder", state, Data(str(softer)), by_source.__getitem__).steps[0].answer


class Measuring:
    """Answers each request for readings with the true values."""

    def __init__(self, true: Mapping[str, float]) -> None:
        self.true, self.asked = true, list[Asked]()

    def carry_out(self, asked: Asked) -> Answer | None:
        self.asked.append(asked)
        return Readings({name: self.true[name] for name in asked.readings})


class Scripted:
    """Answers what it was told to, and notes what it was asked."""

    def __init__(self, *answers: Answer | None) -> None:
        self.answers, self.asked = list(answers), list[Asked]()

    def carry_out(self, asked: Asked) -> Answer | None:
        self.asked.append(asked)
        return self.answers.pop(0) if self.answers else None


def test_a_bundle_is_investigated_until_a_reading_confirms_the_verdict(tmp_path: Path) -> None:
    first, folder = str(small(5, tmp_path / "first")), tmp_path / "investigation"
    laboratory = Measuring({"channel_delay.tau": DELAY, "contact_patch.length": 0.0})
    state = investigate(folder, first, laboratory, load, workers=1)
    assert {each.effects for each in state.steps} == {("channel_delay",)}
    assert laboratory.asked[-1].readings == {"channel_delay.tau": "s"}
    assert len(laboratory.asked) < 3
    assert state.steps[-1].ended == "certain"
    answered_by = [f"diagnosis_{number}.json" for number in range(1, len(state.steps))]
    assert [each.name for each in sorted(folder.iterdir())] == [*answered_by, "investigation.json"]
    assert investigate(folder, first, Scripted(), load) == stored(folder) == state
    with pytest.raises(JointlabError, match="name a new folder"):
        investigate(folder, "other", laboratory, load)


def test_a_folder_that_cannot_be_written_is_told_before_anything_is_read(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("notes")

    def read(source: str) -> Subject:
        raise AssertionError(f"{source} was read, and a diagnosis would follow that takes minutes")

    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(JointlabError, match="cannot be written"):
            investigate(folder, "first", Scripted(), read)
    assert (tmp_path / "file").read_text() == "notes"


def test_an_investigation_of_another_format_is_refused(tmp_path: Path) -> None:
    save(tmp_path, replace(Investigation("first", Budget()), format="jointlab-investigation/2"))
    with pytest.raises(JointlabError, match=r"jointlab-investigation/2.*jointlab-investigation/1"):
        stored(tmp_path)


def test_a_larger_budget_opens_an_investigation_again(found: Diagnosis, tmp_path: Path) -> None:
    spent = Investigation("first", Budget(experiments=0))
    save(tmp_path, replace(spent, steps=(next_step(spent, found),)))
    assert begun(tmp_path, "first", None).steps[-1].ended == "budget"
    assert begun(tmp_path, "first", Budget()) == Investigation("first", Budget())


def test_all_data_of_an_investigation_are_one_measurement(found: Diagnosis, tmp_path: Path) -> None:
    first = str(small(5, tmp_path / "first"))
    state = Investigation(first, Budget(), (next_step(Investigation(first, Budget()), found),))
    state = replace(state, steps=(asked_for_data(state),))
    further = str(small_further(5, tmp_path / "further"))
    both = all_data(answered(tmp_path, state, Data(further), load), load)
    once = load(first).measurement
    assert len(both.measurement.sets) == len(once.sets) + 1
    assert both.measurement.points is not None
    assert once.points is not None
    assert both.measurement.points.order.size == once.points.order.size
    with pytest.raises(JointlabError, match=r"among the data of .* already"):
        answered(tmp_path, state, Data(first), load)


def test_incomplete_data_are_taken_and_nothing_of_what_was_asked_for_is_refused(
    found: Diagnosis, tmp_path: Path
) -> None:
    first = str(small(5, tmp_path / "first"))
    state = Investigation(first, Budget(), (next_step(Investigation(first, Budget()), found),))
    state = replace(state, steps=(asked_for_data(state),))
    again = str(small(5, tmp_path / "again"))
    with pytest.raises(
        JointlabError, match=r"again has nothing .*: strike again at half .* about 50 N \(nearest measured: 100 N"
    ):
        answered(tmp_path, state, Data(again), load)
    further = struck_harder(small_further(5, tmp_path / "further"), 1.36)
    after = answered(tmp_path, state, Data(str(further)), load)
    assert stored(tmp_path) == after
    assert after.steps[-1].missing == (Missing(MissingCondition.FORCE, 50.0, 68.0),)
    assert missing_sentences(after) == (
        "step 1, asked for: strike again at half the peak force; measured without: a peak force of about 50 N "
        "(nearest measured: 68 N)",
    )
    assert without_answer(after) == state


def test_whatever_is_missing_has_words() -> None:
    for what in MissingCondition:
        missing = Missing(what, 5e-6, 1e-5, (Dof.parse("3y"),), (Mounting("II", Configuration.SHEAR),))
        assert missing_text([missing])
    assert missing_text([missing, replace(missing, what=MissingCondition.MOUNTINGS)]).endswith("; II in shear")
    amplitude = replace(missing, what=MissingCondition.AMPLITUDE)
    assert missing_text([amplitude]) == "an amplitude of about 0.01 mm peak to peak (nearest measured: 0.02 mm)"
    for what in (MissingCondition.FORCE, MissingCondition.AMPLITUDE):
        assert "is new" in missing_text([Missing(what)])


@pytest.mark.parametrize(
    "experiment", [each.id for each in EXPERIMENTS if each.id not in {*CHECKS, *CHANGES_THE_BENCH}]
)
def test_what_a_simulated_laboratory_measures_lacks_nothing(experiment: Experiment, tmp_path: Path) -> None:
    first = str(small(5, tmp_path / "first"))
    step = Step(1, Status.UNKNOWN, (), 0.5, Asked(NextExperiment(experiment), ""))
    (tmp_path / "further").mkdir()
    assert step.asked is not None
    answer = SealedBench(case_of(5), tmp_path / "further").carry_out(step.asked)
    assert isinstance(answer, Data)
    with_few_lines(Path(answer.source))
    after = answered(tmp_path / "folder", Investigation(first, Budget(), (step,)), answer, load)
    assert after.steps[0].missing == ()


def asked_for_data(state: Investigation) -> Step:
    """The last step, asking for half the force."""
    return replace(
        state.steps[-1], asked=Asked(NextExperiment(Experiment.HALF_FORCE, information=1.0, doubt=1.0), "softer")
    )


def test_data_of_another_bench_are_refused(found: Diagnosis, tmp_path: Path) -> None:
    first = str(small(5, tmp_path / "first"))
    other = str(small(6, tmp_path / "other"))
    state = Investigation(first, Budget(), (next_step(Investigation(first, Budget()), found),))
    state = replace(state, steps=(asked_for_data(state),))
    with pytest.raises(AnalysisError, match="node_positions"):
        answered(tmp_path, state, Data(other), load)
