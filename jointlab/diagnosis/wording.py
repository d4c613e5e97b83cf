"""A diagnosis in sentences for technicians; terminal, report and page use the same."""

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

from jointlab.diagnosis.document import UNKNOWN, probability
from jointlab.diagnosis.experiment_text import experiment_of, sentence
from jointlab.diagnosis.law_text import law_sentences
from jointlab.diagnosis.parameter_words import parameter_words
from jointlab.quantities import suited
from jointlab.report.section import number

RIGS = {"inverse": "beam rig", "direct": "elastomer tester"}
MECHANISMS = {
    "joint_amplitude": "joints depend on amplitude",
    "joint_frequency": "joints depend on frequency",
    "joint_state": "joints differ with temperature, preload or history",
    "joint_geometry": "where and how joints hold the beam",
    "attachment": "something fixed to or under the joints",
    "beam": "the beam and what rides on it",
    "blow": "how the hammer strikes",
    "measuring_chain": "sensors, cables and windows",
    "tester": "the elastomer tester itself",
}
RIG_OF = {
    "attachment": "inverse",
    "beam": "inverse",
    "blow": "inverse",
    "measuring_chain": "inverse",
    "tester": "direct",
}
"""The rig at which a mechanism acts; those of joints act at both."""
NUISANCES = {
    "setup_scatter": "joints from one set-up to the next",
    "configuration_gain": "the tester from one configuration to another",
    "model_error": "smooth error of accelerances",
}
MOST_PLACES = 2
MANY_VERSIONS = 3
"""Number of versions from which they are counted and no longer named."""
RECORD_EFFECTS = frozenset({"double_hit", "mains_hum"})
"""Effects that are faults of records and do not change accelerances."""
MAP_WARNING = (
    "A map shows where simulation and measurement differ, not why. With one accelerometer, a joint, the sensor or the "
    "beam may cause the same difference. A cause is named only if the simulation with this cause fits both rigs."
)

CURVES_NOTE = (
    "The model has seen these data, so these gaps are not the ones above. Those with the largest gap come first. "
    "Before is the paper's model without any effect, after the verdict's."
)


def percent(value: float | None) -> str:
    """A gap in per cent, as text."""
    return "–" if value is None else f"{_tenths(value)} %"


def named(effects: Sequence[str], titles: Mapping[str, str]) -> str:
    """Effects in words with their ids: "channel delay (channel_delay)"."""
    return " and ".join(f"{titles.get(effect, effect)} ({effect})" for effect in effects)


def verdict_sentence(document: Mapping[str, Any]) -> str:
    """The result of the diagnosis, in one sentence."""
    gap, verdict = document["gap"], document["verdict"]
    before, after, floor = gap["before"]["percent"], gap["after"]["percent"], percent(gap["floor_percent"])
    effects = named(verdict["effects"], document["titles"])
    interval = _interval(gap["after_ci90_percent"])
    fall = f"add {effects}: the gap falls from {percent(before)} to {percent(after)}{interval}, floor {floor}"
    match verdict["status"]:
        case "none":
            return f"nothing beyond noise and stated tolerances: the gap is {percent(before)}{interval}, floor {floor}"
        case "explained" if set(verdict["effects"]) <= RECORD_EFFECTS:
            return (
                f"{effects} in the records of blows; nothing else beyond noise and stated tolerances: the gap is "
                f"{percent(before)}{interval}, floor {floor}"
            )
        case "explained":
            return fall
        case "partial":
            return f"{fall}; something remains that the catalogue does not explain"
        case _:
            return (
                f"a gap of {percent(before)}, floor {floor}, most of which no effect that was tried explains; "
                "the places of the gap show where it lies"
            )


def rigs_sentence(document: Mapping[str, Any]) -> str:
    """The gap of each rig before and after."""
    rigs = document["gap"]["by_rig"].items()
    each = [f"{RIGS[rig]} {percent(gap['before'])} to {percent(gap['after'])}" for rig, gap in rigs]
    return f"gap on held-out data: {', '.join(each)}"


def remainder_sentence(document: Mapping[str, Any]) -> str:
    """The remainder of the verdict beyond noise; empty for diagnoses of earlier versions."""
    remainder = document.get("remainder")
    if remainder is None:
        return ""
    size = f"{percent(remainder['percent'])} of the response, {number(remainder['sigma'])} times noise"
    if not remainder["significant"]:
        return f"remainder: no more than measuring again would show ({size})"
    where = [f"{place_words(place)}, {band_words(place)}" for place in remainder["where"][:MOST_PLACES]]
    found = f"remainder: {size}, more than noise" + (f"; most at {'; '.join(where)}" if where else "")
    return found + _acting(remainder.get("acts_at"))


def _acting(found: Mapping[str, Any] | None) -> str:
    """What a cause in no catalogue looks like, where it is one change of the beam or of the tester."""
    if found is None:
        return ""
    own = dict(found["parameters"])
    if "position" in own:
        where = f"at {own.pop('position')['value']:.3f} m from the left end"
    else:
        begins = own.pop("from")
        unit = "of the test" if begins["unit"] == "1" else begins["unit"]
        where = f"from {number(begins['value'])} {unit} on"
    sizes = ", ".join(f"{name} {number(each['value'])} {each['unit']}" for name, each in own.items())
    return f". It acts like {found['kind']} {where} ({sizes})"


MOTIONS = {"y": "across the beam", "x": "along the beam", "r": "against turning", "bending": "against bending"}
"""Words for the direction of a function at one place of the beam."""


def shape_of(document: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """The function that would take up what a verdict leaves; None where there is none."""
    found: Mapping[str, Any] | None = (document.get("remainder") or {}).get("curve")
    return found


def shape_title(curve: Mapping[str, Any]) -> str:
    """A title, such as "dynamic stiffness at joint I, across the beam, over frequency"."""
    place = curve["place"]
    if place["rig"] == "direct":
        where = f"of the tester{', ' + place['configuration'] if 'configuration' in place else ''}"
    elif place["at"] == "channel":
        where = f"of the accelerometer over the hammer{', set ' + str(place['set']) if 'set' in place else ''}"
    elif "position" not in place:
        where = f"of {place['at']}"
    else:
        at = "" if place["at"] == "beam" else f" ({place['at']})"
        where = f"at {place['position']:.3f} m{at}, {MOTIONS[place['motion']]}"
    return f"{curve['quantity']} {where}, over {curve['over']}"


def shape_sentence(document: Mapping[str, Any]) -> str:
    """The function that would take up most of what the verdict leaves; empty where there is none."""
    curve = shape_of(document)
    if curve is None:
        return ""
    before, after = (percent(curve["gap_percent"][moment]) for moment in ("before", "after"))
    like = f"it resembles: {curve['resembles']}" if curve["resembles"] else "it resembles nothing simple"
    gap = f"{before} to {after} on held-out data"
    return f"a smooth function that would explain most of it: {shape_title(curve)}: {gap}; {like}"


def mechanism_sentence(document: Mapping[str, Any]) -> str:
    """The mechanisms that are likely; empty where none is."""
    likely = [each for each in document.get("mechanisms", ()) if each["probability"] > 0.5]
    words = [f"{MECHANISMS[each['mechanism']]} ({probability_text(each['probability'])})" for each in likely]
    return f"mechanism: {', '.join(words)}" if words else ""


def beside(document: Mapping[str, Any]) -> list[str]:
    """Sentences on what stands beside the verdict: mechanisms, laws, remainder, smooth function, nuisances, set-ups."""
    found = (
        mechanism_sentence(document),
        *law_sentences(document),
        remainder_sentence(document),
        shape_sentence(document),
        nuisance_sentence(document),
        *set_up_sentences(document),
    )
    return [each for each in found if each]


def nuisance_sentence(document: Mapping[str, Any]) -> str:
    """The scales of the nuisances that were found; empty for diagnoses of earlier versions."""
    scales = document.get("nuisances")
    if scales is None:
        return ""
    found = [f"{words} {100 * scales[name]:.2g} %" for name, words in NUISANCES.items()]
    if "blow_lean" in scales:
        found.append(f"blows that lean from point to point {math.degrees(scales['blow_lean']):.2g} degrees")
    return f"estimated scatter, besides the effects: {', '.join(found)}"


def set_up_sentences(document: Mapping[str, Any]) -> list[str]:
    """A sentence on each joint that differs between hammer sets; none for diagnoses of earlier versions."""
    return [
        f"joint {each['joint']} was {each['percent']:.2g} % stiffer in set {each['stiffest']} than in set "
        f"{each['softest']} (standard error {each['error_percent']:.1g} %), more than set-ups usually make; look at "
        "its mounting, and at what happened between these sets"
        for each in document.get("set_up_changes", ())
    ]


def probability_text(probability: float) -> str:
    """A probability in per cent, with no more digits than its accuracy allows."""
    return f"{100 * probability:.0f} %"


def law_words(effect: Mapping[str, Any]) -> str:
    """The law of an effect, or that it is only the closest one that is known."""
    beyond = effect.get("out_of_range", ())
    words = effect["law"] if effect["law_is_known"] else f"no known law fits; as found: {effect['law']}"
    return f"{words}; beyond its plausible range: {', '.join(beyond)}" if beyond else words


def probability_sentence(document: Mapping[str, Any]) -> str:
    """The probability of the verdict, and how often similar verdicts were right in trials."""
    claim = f"probability {probability_text(probability(document))}"
    trial = document["trial"]
    if trial is None:
        return f"{claim}; this catalogue has no published trial yet"
    whole = f"in sealed trials of {trial['cases']} cases ({_answered_by(trial.get('versions') or ())})"
    confidence = trial["confidence"]
    claims = (
        f"verdicts that claimed about this probability were right {confidence['right']} of {confidence['named']} times"
    )
    if not trial["named"]:
        return f"{claim}; {whole} none had this verdict at a {trial['strength']} gap; {claims}"
    right = f"was right {trial['right']} of {trial['named']} times"
    return f"{claim}; {whole} this verdict at a {trial['strength']} gap {right}; {claims}"


def _answered_by(versions: Sequence[str]) -> str:
    """The versions of the software that answered in trials; documents have them all."""
    if len(versions) < MANY_VERSIONS:
        return f"software: {', '.join(versions) or 'an unknown version'}"
    return f"by {len(versions)} versions of the software"


def confounded_sentence(document: Mapping[str, Any]) -> str:
    """The effects that these data cannot tell apart; empty where there are none."""
    titles = document["titles"]
    groups = [", ".join(titles.get(each, each) for each in group) for group in document["verdict"]["twins"]]
    return f"these data cannot tell apart: {'; '.join(groups)}" if groups else ""


def place_words(place: Mapping[str, Any]) -> str:
    """Where a part of the gap lies, such as beam rig, blow at 1x, set 1."""
    if place["rig"] == "inverse":
        where = [f"blow at {place.get('input', '?')}"]
        where += [f"set {_plain(place['level'])}"] if "level" in place else []
    else:
        where = [str(place[name]) for name in ("specimen", "configuration") if name in place]
        where += [f"{_plain(place['amplitude_pp_mm'])} mm"] if "amplitude_pp_mm" in place else []
    return ", ".join([RIGS[place["rig"]], *where])


def places_caption(document: Mapping[str, Any]) -> str:
    """Caption of the places; where they name another rig than the verdict's cause, why that is no contradiction."""
    caption = "Places where the model without any effect misses, the largest share of the misfit first"
    named = [each for each in document.get("effects", ()) if each["id"] in document["verdict"]["effects"]]
    at = {RIG_OF.get(each["mechanism"], "") for each in named}
    shown = [place["rig"] for place in document["where"][:1]]
    if len(at) != 1 or "" in at or not set(shown) - at:
        return caption
    return (
        f"{caption}. The cause is at the {RIGS[at.pop()]}: through the joints, a model without it takes its error to "
        f"the {RIGS[shown[0]]}"
    )


def curve_words(curve: Mapping[str, Any]) -> str:
    """A row or series with its gap before and after, such as beam rig, blow at 1x, set 1: 41.2 % to 2.9 %."""
    before, after = (percent(curve["gap"][moment]["percent"]) for moment in ("before", "after"))
    return f"{place_words(curve)}: {before} to {after}"


def band_words(place: Mapping[str, Any]) -> str:
    """A band, such as "300 to 360 Hz"."""
    low, high = place["band_hz"]
    return f"{low:.0f} to {high:.0f} Hz"


def next_experiment_words(document: Mapping[str, Any]) -> str:
    """What is asked for next, effects by their titles; empty where nothing is stored."""
    verdict, titles = document["verdict"], document["titles"]
    experiment = experiment_of(verdict)
    if experiment is None:  # of an older version, which stored the text alone
        return str(verdict.get("next_experiment") or "")
    return sentence(experiment, lambda effect: titles.get(effect, effect))


def ranked_name(effects: Sequence[str], titles: Mapping[str, str] = MappingProxyType({})) -> str:
    """An entry of the ranking: effects by their titles, or by their ids without `titles`; none, or unknown."""
    if list(effects) == [UNKNOWN]:
        return "unknown: in no catalogue"
    return " + ".join(titles.get(each, each) for each in effects) if effects else "none: noise and tolerances"


def parameter_lines(document: Mapping[str, Any]) -> list[tuple[str, str, str, str]]:
    """Effect by its title, parameter in words, value and 90 % interval of the verdict's effects."""
    effects, titles = document["verdict"]["effects"], document["titles"]
    entry = next((each for each in document["ranking"] if sorted(each["effects"]) == sorted(effects)), None)
    if entry is None or not effects:
        return []
    return [
        (
            titles.get(effect, effect),
            parameter_words(effect, name),
            *estimate_with_unit(found),
        )
        for effect in effects
        for name, found in entry["parameters"].get(effect, {}).items()
    ]


def estimate_with_unit(found: Mapping[str, Any]) -> tuple[str, str]:
    """An estimated value and its 90 % interval, both in the unit that suits the largest of them."""
    value, (low, high) = found["value"], found["ci90"]
    scale, unit = suited(found["unit"], value, low, high)
    return "–" if value is None else f"{value / scale:.4g}{_unit(unit)}", _range_in(scale, unit, low, high)


def interval_with_unit(interval: Sequence[float | None], unit: str) -> str:
    """Both ends of an interval, in the unit that suits the larger one."""
    low, high = interval
    return _range_in(*suited(unit, low, high), low, high)


def _range_in(scale: float, unit: str, low: float | None, high: float | None) -> str:
    return "–" if low is None or high is None else f"{low / scale:.3g} … {high / scale:.3g}{_unit(unit)}"


def _unit(unit: str) -> str:
    return "" if unit in ("1", "") else f" {unit}"


def _interval(interval: Sequence[float | None]) -> str:
    low, high = interval
    return "" if low is None or high is None else f" [{_tenths(low)}, {_tenths(high)}]"


def _tenths(value: float) -> str:
    return f"{value:.1f}" if value >= 1 else number(value, 2)


def _plain(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:g}" if math.isfinite(value) else "?"
