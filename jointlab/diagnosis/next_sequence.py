"""The next experiment of a diagnosis as a sequence: the steps of the measured run, changed for the experiment.

Work that a sequence cannot do, such as weighing a cap or turning a sensor, becomes a prompt to the operator before the
step that needs it.
"""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from itertools import pairwise
from typing import Any

from analysis.gap.experiments.catalogue import FURTHER_MASS, Experiment
from analysis.gap.experiments.next_experiment import NextExperiment
from jointlab.diagnosis.experiment_text import CORRECTIONS, request, title_text
from rig.operator import SUPPORTED
from rig.sequences.sequence import LONGEST_PROMPT, LONGEST_TITLE, Sequence, SequenceError, sequence_from
from rig.sequences.sweep_plan import Order
from rig.tester.limits import TesterLimits

Step = dict[str, Any]
Document = dict[str, Any]
Plan = Callable[[Document, TesterLimits], Document]
"""Function that changes a sequence document, within limits of the tester."""

HAMMER, SWEEP, BLANK = "hammer", "sweep", "blank"
HARD_BLOWS = 200.0
"""Peak force in N from which a further hammer level lies between the present ones."""
LONG_BLOCK = 4.0  # s, a free beam rings that long
METRES_PER_MM = 1e-3  # m in a mm


def next_sequence(experiment: NextExperiment, base: Sequence, limits: TesterLimits) -> Sequence:
    """The sequence for an experiment; corrections come first, as prompts.

    Args:
        experiment: that a diagnosis asks for.
        base: the sequence of the run that was diagnosed.
        limits: in force for the tester.

    Raises:
        SequenceError: the planned sequence cannot be run, or `base` does not have the steps that are to be repeated.
    """
    corrections = [CORRECTIONS[effect] for effect in experiment.corrections]
    text, title = request(experiment), title_text(experiment)
    plan = PLANS.get(experiment.id) or _prompted(text)
    if experiment.id is Experiment.NOTHING and corrections:
        text, title, plan = corrections[0], corrections[0], lambda document, _: document
    return _sequence(text, title, base, limits, plan, corrections)


def sequence_for_text(text: str, base: Sequence, limits: TesterLimits) -> Sequence:
    """The sequence for an experiment of which only the text is known: all is measured again after a prompt."""
    title = text.partition(";")[0]  # older versions stored no title
    return _sequence(text, title, base, limits, _prompted(text), ())


def _sequence(
    text: str, title: str, base: Sequence, limits: TesterLimits, plan: Plan, corrections: Iterable[str]
) -> Sequence:
    """`base` by a plan, after prompts; `title` is added to its title, and errors name `text`."""
    document: Document = base.model_dump(mode="json", exclude_none=True)
    document |= {"steps": [step for step in document["steps"] if step["step"] != "prompt"]}
    planned = plan(document, limits)
    steps = [*(_prompt(each) for each in corrections), *planned["steps"]]
    end = f": {title}"
    whole = base.title[: LONGEST_TITLE - len(end)] + end
    return sequence_from(planned | {"title": whole, "steps": steps}, f"sequence to {text}")


def _prompted(text: str, *kinds: str) -> Plan:
    """A plan with a prompt before the steps of some kinds (all by default), which are measured again."""

    def plan(document: Document, _limits: TesterLimits) -> Document:
        return document | {"steps": [_prompt(text), *_of(document, kinds)]}

    return plan


def _of(document: Document, kinds: Iterable[str]) -> list[Step]:
    """The steps of some kinds; all steps where there are none."""
    wanted = set(kinds)
    return [step for step in document["steps"] if step["step"] in wanted] or list(document["steps"])


def _prompt(text: str) -> Step:
    return {"step": "prompt", "text": f"{text[:1].upper()}{text[1:LONGEST_PROMPT]}"}


def _swept(document: Document, change: Callable[[Step], Step]) -> Document:
    """The sweep with the fields that `change` gives for it, and the blanks: a run is corrected by its own alone.

    Raises SequenceError where there is no sweep.
    """
    if not any(step["step"] == SWEEP for step in document["steps"]):
        raise SequenceError("this run has no sweep to repeat; take the sequence of a run with one")
    steps = _of(document, (SWEEP, BLANK))
    return document | {"steps": [step | change(step) if step["step"] == SWEEP else step for step in steps]}


def _struck(document: Document) -> list[Step]:
    """The hammer steps on the beam on its joints: a diagnosis uses no others."""
    return [step for step in document["steps"] if step["step"] == HAMMER and step["beam"] == SUPPORTED]


def _struck_before(document: Document) -> list[Step]:
    """The same, of which there is at least one; SequenceError where there is none."""
    if not (found := _struck(document)):
        raise SequenceError(
            "this run has no hammer step on the beam on its joints; take the sequence of a run with one"
        )
    return found


def _at_one_temperature(document: Document, _limits: TesterLimits) -> Document:
    """Both rigs after a soak, with the thermometer at the elastomer."""
    places = {HAMMER: "the joints of the beam", SWEEP: "the cylinders in the tester"}
    steps = list[Step]()
    for step in _of(document, (*places, BLANK)):
        if step["step"] in places:
            steps += [_prompt(f"Put the thermometer beside {places[step['step']]}"), {"step": "soak"}]
        steps.append(step)
    return document | {"steps": steps}


def _with_blanks(document: Document, _limits: TesterLimits) -> Document:
    """Known pieces before the sweep: a stiff one, and none at all."""
    sweep = _of(document, (SWEEP,))
    pieces = [step for step in document["steps"] if step["step"] == "blank"] or [
        {"step": "blank", "piece": "blank"},
        {"step": "blank", "piece": "empty", "stiffness": 0.0, "amplitude_pp_mm": 0.1},
    ]
    return document | {"steps": [*pieces, *(step for step in sweep if step["step"] != "blank")]}


def _with_mass(document: Document, _limits: TesterLimits) -> Document:
    """A known mass before the sweep."""
    mass = {"step": "blank", "piece": "mass", "stiffness": 0.0, "mass": 0.5, "amplitude_pp_mm": 0.1}
    text = "Have a mass of 0.5 kg ready for the tester; if yours weighs something else, stop and state it in the step"
    return document | {"steps": [_prompt(text), mass, *_of(document, (SWEEP,))]}


def _with_long_records(document: Document, _limits: TesterLimits) -> Document:
    """Blows with records of twice the length."""
    steps = _of(document, (HAMMER,))
    longer = [s | {"block_seconds": 2 * s["block_seconds"]} if s["step"] == HAMMER else s for s in steps]
    return document | {"steps": longer}


def _at_another_preset(document: Document, limits: TesterLimits) -> Document:
    """The sweep halfway to the largest preset; if it is near that already, halfway to the smallest."""
    lowest, highest = limits.lowest_preset / METRES_PER_MM, limits.highest_preset / METRES_PER_MM
    preset = next((step["preset_mm"] for step in document["steps"] if step["step"] == SWEEP), 0.0)
    another = (preset + highest) / 2 if highest - preset > 0.2 * highest else (preset + lowest) / 2
    return _swept(document, lambda _: {"preset_mm": round(another, 3)})


def _shuffled(document: Document, _limits: TesterLimits) -> Document:
    """The sweep with all its points in random order; in a new random order if it was random before."""
    steps = [{name: step[name] for name in step if name != "seed"} for step in document["steps"]]
    return _swept(document | {"steps": steps}, lambda _: {"order": Order.ALL.value})


def _suspended(document: Document, _limits: TesterLimits) -> Document:
    """The beam suspended in cords, struck across."""
    hammer = next((step for step in document["steps"] if step["step"] == HAMMER), {"step": HAMMER})
    points = [point for point in hammer.get("points", ()) if point.endswith("y")]
    hung = hammer | {"beam": "suspended", "block_seconds": max(LONG_BLOCK, hammer.get("block_seconds", 0.0))}
    return document | {"steps": [hung | ({"points": points} if points else {})]}


def _at_other_levels(document: Document, _limits: TesterLimits) -> Document:
    """All steps, with a further hammer level and a further amplitude of the tester."""
    steps = list[Step]()
    for step in document["steps"]:
        if step["step"] == SWEEP:
            step |= {"amplitudes_pp_mm": sorted({*step["amplitudes_pp_mm"], _another_amplitude(step)}, reverse=True)}
        steps.append(step)
    if struck := _struck(document | {"steps": steps}):
        steps.insert(steps.index(struck[-1]) + 1, _at_another_level(struck))
    return document | {"steps": steps}


def _at_another_level(struck: list[Step]) -> Step:
    """The last hammer step at a new level: twice the hardest, or one between."""
    levels = sorted(step["peak_force"] for step in struck)
    level = 2 * levels[-1] if levels[-1] < HARD_BLOWS else _in_widest_gap([levels[0] / 2, *levels])
    return at_level(struck[-1], level)


def at_level(step: Step, level: float) -> Step:
    """A hammer step with a peak force of `level`, N; its weakest peak and trigger level are at most half of this."""
    weakest = min(step["weakest_peak"], level / 2)
    return step | {"peak_force": level, "weakest_peak": weakest, "trigger_level": min(step["trigger_level"], weakest)}


def _another_amplitude(sweep: Step) -> float:
    amplitudes = sorted(sweep["amplitudes_pp_mm"])
    return _in_widest_gap(amplitudes if len(amplitudes) > 1 else [amplitudes[0] / 4, amplitudes[0]])


def _in_widest_gap(rising: list[float]) -> float:
    """The middle, by ratio, of the two neighbours that are farthest apart; to two digits."""
    low, high = max(pairwise(rising), key=lambda pair: pair[1] / pair[0])
    return float(f"{(low * high) ** 0.5:.2g}")


def _to_a_higher_frequency(document: Document, limits: TesterLimits) -> Document:
    """The sweep as far up as the tester may be driven at these amplitudes."""
    prompts = list[Step]()

    def higher(step: Step) -> Step:
        span, largest = step["frequencies"], max(step["amplitudes_pp_mm"]) * METRES_PER_MM
        last = span["last"]
        while last + span["step"] <= limits.highest_frequency:
            if limits.largest_amplitude_pp(last + span["step"]) < largest:
                break
            last += span["step"]
        if last == span["last"]:
            prompts.append(_prompt(f"The sweep reaches the rig's limit at {last:g} Hz; have it widened first"))
        return {"frequencies": span | {"last": last}, "sample_rate": max(step["sample_rate"], 20 * last)}

    swept = _swept(document, higher)
    return swept | {"steps": [*prompts, *swept["steps"]]}


def _new_set_up(document: Document, _limits: TesterLimits) -> Document:
    """All steps after a new set-up, with a further hammer level and the accelerometer at another node."""
    article, struck = document["article"], [step for step in document["steps"] if step["step"] == HAMMER]
    sensor = article["accelerometer"]
    taken = {sensor["node"], *(joint["node"] for joint in article["joints"])}
    across = [int(point[:-1]) for step in struck for point in step["points"] if point.endswith("y")]
    places = [node for node in across if node not in taken]
    text = "Take the beam off its joints, look at them, and put it back"
    if places:
        article |= {"accelerometer": sensor | {"node": places[-1]}}
        text += f"; move the accelerometer to {places[-1]}{sensor['direction']}"
    others = [step for step in document["steps"] if step["step"] != HAMMER]
    supported = _struck(document)
    levels = [*struck, _at_another_level(supported)] if supported else struck
    return document | {"article": article, "steps": [_prompt(text), *levels, *others]}


def _at_half_the_force(document: Document, _limits: TesterLimits) -> Document:
    """The softest of the hammer steps again, with half the force."""
    softest = min(_struck_before(document), key=lambda step: float(step["peak_force"]))
    level, weakest = softest["peak_force"] / 2, softest["weakest_peak"] / 2
    return document | {"steps": [at_level(softest | {"weakest_peak": weakest}, level)]}


def _at_half_the_amplitude(document: Document, _limits: TesterLimits) -> Document:
    """The sweep at half its smallest amplitude."""
    return _swept(document, lambda sweep: {"amplitudes_pp_mm": [min(sweep["amplitudes_pp_mm"]) / 2]})


def _with_accelerometer(change: Step, text: str, document: Document) -> Document:
    """The first hammer step on the joints again, after a change of the accelerometer that the article then states."""
    article = document["article"]
    article |= {"accelerometer": article["accelerometer"] | change}
    return document | {"article": article, "steps": [_prompt(text), _struck_before(document)[0]]}


def _heavier_accelerometer(document: Document, _limits: TesterLimits) -> Document:
    mass = document["article"]["accelerometer"].get("mass", 0.0) + FURTHER_MASS
    text = f"Fix {1e3 * FURTHER_MASS:.0f} g more to the accelerometer; the article of this sequence states its mass so"
    return _with_accelerometer({"mass": mass}, text, document)


def _accelerometer_at(share: float, document: Document, _limits: TesterLimits) -> Document:
    """The accelerometer at the node nearest to a share of the length, except at joints and at its present node."""
    article = document["article"]
    positions, sensor = article["node_positions"], article["accelerometer"]
    taken = {sensor["node"], *(joint["node"] for joint in article["joints"])}
    free = [node for node in range(1, len(positions) + 1) if node not in taken]
    node = min(free, key=lambda each: abs(positions[each - 1] - share * max(positions)))
    return _with_accelerometer({"node": node}, f"Move the accelerometer to {node}{sensor['direction']}", document)


PLANS: Mapping[Experiment, Plan] = {
    Experiment.NEW_SET_UP: _new_set_up,
    Experiment.HALF_FORCE: _at_half_the_force,
    Experiment.HEAVIER_ACCELEROMETER: _heavier_accelerometer,
    Experiment.ACCELEROMETER_LEFT: partial(_accelerometer_at, 0.0),
    Experiment.ACCELEROMETER_MIDDLE: partial(_accelerometer_at, 0.5),
    Experiment.ACCELEROMETER_RIGHT: partial(_accelerometer_at, 1.0),
    Experiment.READ_THERMOMETERS: _at_one_temperature,
    Experiment.MEASURE_PLACES: _prompted(
        "Measure the places of joints and points from the left end of the beam with a ruler, and compare them with "
        "node_positions; mark again what is off",
        HAMMER,
    ),
    Experiment.WEIGH_PARTS: _prompted(
        "Weigh the accelerometer, the caps of the joints and the beam, and compare them with the article; put them "
        "back",
        HAMMER,
    ),
    Experiment.MEASURE_CYLINDERS: _prompted(
        "Measure how the cylinders lean, how far they sit beside the beam's axis and where they touch; correct what "
        "is off"
    ),
    Experiment.STRIKE_KNOWN_MASS: _prompted(
        "Strike a known free mass with this hammer and accelerometer, and correct the sensitivities in the channel "
        "table if force over acceleration is not its mass",
        HAMMER,
    ),
    Experiment.BLANK_TEST: _with_blanks,
    Experiment.MASS_IN_TESTER: _with_mass,
    Experiment.LONG_RECORDS: _with_long_records,
    Experiment.RANDOM_ORDER: _shuffled,
    Experiment.HALF_AMPLITUDE: _at_half_the_amplitude,
    Experiment.ANOTHER_PRESET: _at_another_preset,
    Experiment.TURN_ACCELEROMETER: _prompted(
        "Turn the accelerometer by 90 degrees about its own axis, at the same place, or put one of three axes there",
        HAMMER,
    ),
    Experiment.OUT_OF_PLANE: _prompted(
        "Turn the accelerometer so that it looks out of the plane, at the same place", HAMMER
    ),
    Experiment.GUIDED_HAMMER: _prompted(
        "Guide the hammer, as a pendulum or in a tube, so that it strikes along the axis", HAMMER
    ),
    Experiment.FREE_BEAM: _suspended,
    Experiment.AT_FOUNDATION: _prompted(
        "Move the accelerometer to the foundation beside a joint, looking the same way", HAMMER
    ),
    Experiment.OTHER_LEVELS: _at_other_levels,
    Experiment.HIGHER_FREQUENCY: _to_a_higher_frequency,
}
"""Plans by experiment; the text of any other experiment is a prompt, and all steps are measured again."""
