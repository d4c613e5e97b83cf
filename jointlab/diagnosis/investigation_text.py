"""An investigation in words: its steps as a table, and the answer that it waits for."""

from analysis.gap.evidence.verdict import UNKNOWN
from jointlab.diagnosis.catalogue import title_of
from jointlab.diagnosis.experiment_text import request, sentence
from jointlab.diagnosis.investigation import Asked, Data, Investigation, Probable, Readings, Refused, Step
from jointlab.diagnosis.missing_text import missing_text
from jointlab.diagnosis.reading_text import reading_words, unit_words
from jointlab.errors import JointlabError
from jointlab.report.section import Share, Table

ENDS = {
    "certain": "the verdict is certain enough",
    "nothing would help": "no experiment that is known here would tell more",
    "budget": "the budget of minutes or experiments is spent",
}
HEAD = ("step", "leading explanation", "probability", "next explanations", "experiment", "minutes", "answer")


def effects_text(effects: tuple[str, ...]) -> str:
    """The effects of an explanation by their titles."""
    if effects == UNKNOWN:
        return "a cause in no catalogue"
    return " and ".join(map(title_of, effects)) or "no effect"


def asked_text(asked: Asked) -> str:
    """A request with its purpose, for people: effects by their titles."""
    return sentence(asked.experiment, title_of)


def steps_table(state: Investigation) -> Table:
    """Each step with the leading explanation and the next probable ones, the experiment and the answer."""
    rows = tuple(
        (
            str(step.number),
            effects_text(step.effects),
            Share.of(step.probability, 1),
            ", ".join(map(_beside_text, step.beside)) or "–",
            "–" if step.asked is None else step.asked.experiment.id.value.replace("_", " "),
            "–" if step.asked is None else f"{step.asked.experiment.minutes:.0f}",
            _answer_text(step),
        )
        for step in state.steps
    )
    return Table("Steps", HEAD, rows)


def last_sentence(state: Investigation) -> str:
    """The reason why the investigation ended, or the answer that it waits for."""
    last = state.steps[-1]
    if last.ended is not None:
        made = f"{len(state.made)} experiment{'' if len(state.made) == 1 else 's'}"
        return f"ended after {made} and {state.minutes:.0f} min: {ENDS[last.ended]}"
    return "" if last.asked is None else f"asked for: {asked_text(last.asked)}"


def missing_sentences(state: Investigation) -> tuple[str, ...]:
    """For each step whose data are incomplete, what was asked for and what is missing."""
    return tuple(
        f"step {step.number}, asked for: {request(step.asked.experiment, title_of)}; measured without: "
        f"{missing_text(step.missing)}"
        for step in state.steps
        if step.asked is not None and step.missing
    )


def how_to_answer(asked: Asked) -> str:
    """The command-line options that give the answer."""
    wanted = ", ".join(f"{name} in {unit}" for name, unit in asked.readings.items())
    given = f"--reading NAME=VALUE of {wanted}" if wanted else "--data BUNDLE|RUN"
    return f"answer with {given}, or --refuse REASON, in the same command"


def read_value(text: str) -> tuple[str, float]:
    """Name and value from the text NAME=VALUE.

    Raises:
        JointlabError: the text has another form.
    """
    name, _, value = text.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError as error:
        raise JointlabError(f"a reading is NAME=VALUE, such as joint_mass.m=0.12, and not {text!r}") from error


def _beside_text(found: Probable) -> str:
    return f"{effects_text(found.effects)} {100 * found.probability:.1f} %"


def _answer_text(step: Step) -> str:
    match step.answer:
        case Data(source):
            return f"data {source}"
        case Readings(values):
            units = {} if step.asked is None else step.asked.readings
            return ", ".join(
                f"{reading_words(name)}: {value:.4g} {unit_words(units.get(name, ''))}".rstrip()
                for name, value in values.items()
            )
        case Refused(reason):
            return f"not made: {reason}"
    return "–"
