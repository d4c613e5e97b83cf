"""Pairs of effects on benches that follow the search's own model."""

import numpy as np

from analysis.gap.effects.attachment import FoundationCompliance, JointMass
from analysis.gap.effects.beam import AccelerometerMass
from analysis.gap.effects.tester import FilteredDisplacement, FrameCompliance
from analysis.gap.fit import fit
from analysis.gap.model import Model, best_by_id
from analysis.gap.search import Search
from analysis.gap.two_effect_search import pairs
from analysis.gap.verdict import weigh
from tests.analysis.gap.conftest import Made, search_among

TRIED = {"accelerometer_mass", "frame_compliance", "joint_mass", "temperature_shift", "beam_damping", "sensor_gain"}


def alone(search: Search, effect: AccelerometerMass | FrameCompliance, none: Model) -> Model:
    """An effect by itself, wherever its fit ends."""
    start = np.insert(none.fit.scores, len(search.baseline.parameters), 0.1)
    return Model((effect,), fit(search.simulation((effect,)), start))


def test_both_of_a_pair_are_named(made: Made) -> None:
    search = search_among(made((JointMass(), FrameCompliance()), (1.0, 0.6)), TRIED)
    none = search.without_effects()
    singles = search.singles(none)
    weighed = weigh(none, [*singles, *pairs(search, singles)])
    assert set(weighed[0].effects) == {"joint_mass", "frame_compliance"}


def test_a_single_effect_gets_no_second(made: Made) -> None:
    search = search_among(made((FrameCompliance(),), (0.6,)), TRIED)
    singles = search.singles(search.without_effects())
    best = best_by_id(singles)[0]
    assert best.ids == ("frame_compliance",)
    assert all(pair.log_evidence < best.log_evidence + 6.0 for pair in pairs(search, singles))


def test_what_hides_behind_a_wrong_effect_becomes_the_first_of_others(made: Made) -> None:
    """To the foundation, which no single fit showed, the frame is tried only when a pair has shown it."""
    measurement = made((FoundationCompliance(1), FrameCompliance()), (0.8, 0.0, 0.5, 0.4))
    search = search_among(measurement, {"accelerometer_mass", "foundation_compliance", "frame_compliance"})
    wrong = alone(search, AccelerometerMass(), search.without_effects())
    assert not wrong.clean
    found = pairs(search, [wrong])
    assert set(found[0].ids) == {"foundation_compliance", "frame_compliance"}
    assert found[0].clean
    assert any(each.ids == ("foundation_compliance",) for each in found)


def test_of_the_second_effect_every_law_is_tried(made: Made) -> None:
    search = search_among(
        made((FrameCompliance(), FilteredDisplacement()), (0.6, 0.8)), {"frame_compliance", "transducer_lag"}
    )
    first = alone(search, FrameCompliance(), search.without_effects())
    found = pairs(search, [first])
    assert {each.effects[1].law for each in found if len(each.effects) == 2} == {"delay", FilteredDisplacement.law}
    assert found[0].effects[1].law == FilteredDisplacement.law
