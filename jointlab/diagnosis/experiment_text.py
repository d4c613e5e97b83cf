"""The next experiment of a diagnosis: in sentences for people, and as it is stored in a document."""

from collections.abc import Callable, Mapping
from typing import Any

from analysis.gap.experiments.catalogue import FURTHER_MASS, Experiment
from analysis.gap.experiments.next_experiment import NextExperiment

TEXTS: Mapping[Experiment, str] = {
    Experiment.NOTHING: "nothing is asked for: simulation and measurement agree within noise and tolerances",
    Experiment.NEW_SET_UP: (
        "look at the bench where the map shows the gap; repeat the measurement after a new set-up, at another level "
        "and with the accelerometer at a second place, to see what moves with it"
    ),
    Experiment.READ_THERMOMETERS: "read the thermometers of both rigs",
    Experiment.MEASURE_PLACES: "measure the places of joints and points with a ruler",
    Experiment.WEIGH_PARTS: "weigh the accelerometer, the caps and the beam",
    Experiment.MEASURE_CYLINDERS: "measure how the cylinders lean and sit",
    Experiment.STRIKE_KNOWN_MASS: "strike a known free mass",
    Experiment.BLANK_TEST: "take a blank test of the tester",
    Experiment.MASS_IN_TESTER: "test a known mass in the tester",
    Experiment.HALF_FORCE: "strike again at half the peak force",
    Experiment.HEAVIER_ACCELEROMETER: f"strike again with {1e3 * FURTHER_MASS:.0f} g more on the accelerometer",
    Experiment.ACCELEROMETER_LEFT: "strike again with the accelerometer at the left end",
    Experiment.ACCELEROMETER_MIDDLE: "strike again with the accelerometer in the middle",
    Experiment.ACCELEROMETER_RIGHT: "strike again with the accelerometer at the right end",
    Experiment.LONG_RECORDS: "take records of twice the length",
    Experiment.RANDOM_ORDER: "repeat the tester's points in random order",
    Experiment.HALF_AMPLITUDE: "repeat the tester's points at half the smallest amplitude",
    Experiment.ANOTHER_PRESET: "repeat the tester's points at another preset",
    Experiment.TURN_ACCELEROMETER: "turn the accelerometer, or use one of three axes",
    Experiment.OUT_OF_PLANE: "measure the acceleration out of the plane",
    Experiment.GUIDED_HAMMER: "strike with a guided hammer",
    Experiment.FREE_BEAM: "suspend the beam and measure it free",
    Experiment.AT_FOUNDATION: "measure the acceleration at the foundation",
    Experiment.OTHER_LEVELS: "strike at a third level and test at a fourth amplitude",
    Experiment.HIGHER_FREQUENCY: "test to a higher frequency",
}
"""Text of each experiment; that of `Experiment.CORRECT_EFFECTS` depends on the effects."""

TITLES: Mapping[Experiment, str] = {
    Experiment.NEW_SET_UP: "look at the bench where the map shows the gap",
}
"""Titles of experiments whose text is too long for one."""

CORRECTIONS: Mapping[str, str] = {
    "double_hit": "strike again so that the hammer does not bounce",
    "mains_hum": "shield the accelerometer and its cable from the mains and strike again",
}
"""Requests that remove the cause of an effect that records show, by its id."""


def request(experiment: NextExperiment, named: Callable[[str], str] = str) -> str:
    """The experiment as a request, without its purpose.

    Args:
        experiment: that is asked for.
        named: the name of an effect by its id: data have the id itself, people see its title.
    """
    if experiment.id is Experiment.CORRECT_EFFECTS:
        return f"repeat the measurement with {' and '.join(map(named, experiment.effects))} corrected"
    return TEXTS[experiment.id]


def title_text(experiment: NextExperiment) -> str:
    """The experiment in the title of its sequence."""
    return TITLES.get(experiment.id) or request(experiment)


def sentence(experiment: NextExperiment, named: Callable[[str], str] = str) -> str:
    """The request, its expected result, and the corrections; for the arguments see `request`."""
    corrections = [CORRECTIONS[effect] for effect in experiment.corrections]
    if experiment.id is Experiment.NOTHING and corrections:
        return "; ".join(corrections)
    said, effects = request(experiment, named), list(map(named, experiment.effects))
    if experiment.information:
        purpose = f"tell {' from '.join(effects)}" if experiment.tells_apart else f"confirm {' and '.join(effects)}"
        share = min(1.0, experiment.information / experiment.doubt)
        said += (
            f": expected to {purpose}, {100 * share:.0f} % of the uncertainty removed in {experiment.minutes:.0f} min"
        )
    return "; ".join([said, *corrections])


def experiment_of(verdict: Mapping[str, Any]) -> NextExperiment | None:
    """The experiment in the ``verdict`` of a diagnosis document; None where an older version stored the text alone."""
    stored = verdict.get("experiment")
    if stored is None:
        return None
    return NextExperiment(
        id=Experiment(stored["id"]),
        effects=tuple(stored["effects"]),
        tells_apart=stored["tells_apart"],
        **{name: stored[name] for name in ("information", "doubt", "minutes") if name in stored},
        corrections=tuple(stored["corrections"]),
    )
