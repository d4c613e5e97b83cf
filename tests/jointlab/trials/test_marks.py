"""An answer beside its truth, from documents with and without the newer keys."""

from typing import Any

from jointlab.trials.claims import Claims
from jointlab.trials.marks import Truth, accepted, marked
from jointlab.trials.summary import markdown, summary


def document(status: str, verdict_on: list[str], ranking: list[tuple[list[str], float]], **more: Any) -> dict[str, Any]:
    entries = [{"effects": each, "probability": share, "parameters": {}, "explained": 0.9} for each, share in ranking]
    gap = {"before": {"percent": 9.0, "sigma": 7.0}, "after": {"percent": 3.0}, "floor_percent": 2.9, "by_rig": {}}
    verdict = {"status": status, "effects": verdict_on}
    return {"verdict": verdict, "ranking": entries, "gap": gap, "faults": [], "seconds": 2.0} | more


def truth(kind: str, *effects: str, novel: tuple[str, ...] = (), **more: Any) -> Truth:
    names = more.pop("d_each", dict.fromkeys(effects, 50.0))
    fixed: dict[str, Any] = {"size": {}, "parameters": {}, "floor_percent": 3.0, "d": 50.0} | more
    return Truth(case="a", kind=kind, effects=effects, novel=novel, d_each=names, **fixed)


def test_inclusion_is_summed_over_the_ranking_where_the_document_has_no_effects() -> None:
    found = Claims.of(
        document(
            "explained", ["joint_mass"], [(["joint_mass"], 0.6), (["density", "joint_mass"], 0.3), (["unknown"], 0.1)]
        )
    )
    assert found.probability == 0.6
    assert {name: round(sure, 6) for name, sure in found.included.items()} == {"joint_mass": 0.9, "density": 0.3}
    assert {name: round(sure, 6) for name, sure in found.mechanisms.items()} == {"attachment": 0.9, "beam": 0.3}


def test_stated_inclusion_and_mechanisms_stand_before_the_ranking() -> None:
    listed = [{"id": "loss_law", "probability": 0.3, "parameters": {}}]
    found = Claims.of(
        document(
            "partial",
            [],
            [([], 0.4), (["unknown"], 0.6)],
            effects=listed,
            mechanisms=[{"mechanism": "joint_frequency", "probability": 0.8}],
        )
    )
    assert found.included == {"loss_law": 0.3}
    assert found.said_mechanisms == {"joint_frequency"}


def test_a_mechanism_without_a_law_is_no_known_name() -> None:
    answer = document("explained", ["joint_amplitude"], [(["joint_amplitude"], 0.9)])
    mark = marked(truth("single", "cubic_stiffness"), answer)
    assert (mark.named, mark.mechanism_right, mark.right) == ((), True, False)
    assert not accepted(marked(truth("novel", novel=("loose_cap",)), answer))


def test_an_effect_in_no_catalogue_is_accepted_where_a_known_name_gets_more_than_even_odds() -> None:
    outside = truth("novel", novel=("absorber",))
    assert accepted(marked(outside, document("partial", ["beam_damping"], [(["beam_damping"], 0.56)])))
    refused = marked(outside, document("unknown", [], [(["unknown"], 0.9), (["beam_damping"], 0.1)]))
    assert refused.right
    assert not accepted(refused)


def test_a_fault_of_the_record_is_right_where_it_is_found_and_nothing_else_is() -> None:
    fault = truth("novel", novel=("polarity",))
    answer = document("none", [], [([], 1.0)])
    assert not marked(fault, answer).right
    assert marked(fault, answer | {"faults": ["4y is upside down"]}).right


def test_the_figures_count_visible_effects_and_spurious_ones() -> None:
    three = truth("mixture", "joint_mass", "loss_law", "density", d_each={"joint_mass": 90.0, "loss_law": 9.0})
    answer = document("explained", ["frame_compliance", "joint_mass"], [(["frame_compliance", "joint_mass"], 0.95)])
    mark = marked(three, answer)
    assert (mark.found, mark.spurious, mark.surely_wrong) == (("joint_mass",), ("frame_compliance",), mark.spurious)
    found = summary([mark, marked(truth("none"), {"error": "stopped", "seconds": 9.0})])
    assert (found["mixture_recall"]["count"], found["mixture_recall"]["of"]) == (1, 2)
    assert found["mixture_recall_all"]["of"] == 3
    assert found["surely_wrong"] == {"count": 1, "of": 2, "share": 0.5}
    assert found["false_alarm"]["count"] == 1  # a case without an answer is not one that passed
    assert "failed: a: stopped" in markdown(found)


def test_a_rig_whose_gap_grows_is_counted() -> None:
    answer = document("explained", ["density"], [(["density"], 0.9)])
    rigs = {"inverse": {"before": 3.0, "after": 3.4}, "direct": {"before": 9.0, "after": 3.0}}
    answer["gap"]["by_rig"] = {name: each | {"before_sigma": 9.0} for name, each in rigs.items()}
    assert marked(truth("single", "density"), answer).worsened == ("inverse",)
