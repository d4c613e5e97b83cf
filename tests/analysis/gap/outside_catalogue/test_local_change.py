"""Something at one place of the beam: the right response, and the answer that no effect of the catalogue caused it."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.gap.effect import Effect
from analysis.gap.effects.beam import AccelerometerMass
from analysis.gap.evidence.calibration import UNCALIBRATED
from analysis.gap.evidence.verdict import UNKNOWN, leading, weigh
from analysis.gap.findings.intervals import estimates
from analysis.gap.fitting.likelihood import Likelihood
from analysis.gap.measurement import Measurement
from analysis.gap.outside_catalogue.local_change import (
    CHANGES,
    KINDS,
    PLACES,
    SETTINGS,
    Absorber,
    FixedAcross,
    FixedTurning,
    LocalChange,
    local_changes,
)
from analysis.gap.outside_catalogue.row_change import KINDS as OF_ROWS
from analysis.gap.outside_catalogue.tester_change import KINDS as STEPS
from analysis.gap.search.forward_selection import selected
from analysis.structure.forward import accelerance
from analysis.structure.joints import Joint
from tests.analysis.gap.conftest import Made, search_among, simulation_of

NODE = 6


CATALOGUE = {"beam_damping", "accelerometer_mass"}
"""Effects that resemble what is fixed to the beam, or damps it."""


def rivals(measurement: Measurement, *kinds: type[LocalChange]) -> tuple[Effect, ...]:
    return tuple(each for each in local_changes(measurement) if isinstance(each, kinds))


@pytest.mark.parametrize(
    ("change", "own"),
    [(FixedTurning, (0.0, 0.8, 0.0, 0.3)), (Absorber, (0.5, 0.4, 0.0, 0.6))],
    ids=["damper", "absorber"],
)
def test_what_only_resembles_the_catalogue_is_unknown_and_placed(
    made: Made, empty: Measurement, change: type[LocalChange], own: tuple[float, ...]
) -> None:
    true = change.variants(empty)[2]
    search = replace(search_among(made((true,), own).thinned(42), CATALOGUE), rivals=rivals(empty, change, FixedAcross))
    none = search.fit_paper_model()
    verdict = leading(weigh(none, selected(search, none, UNCALIBRATED), UNCALIBRATED))
    assert verdict.effects == UNKNOWN
    assert type(verdict.model.effects[0]) is change
    found = estimates(verdict.model, UNCALIBRATED)[0]
    assert found["position"].value == pytest.approx(true.position.value(own[-1]), abs=0.01)


def test_what_the_catalogue_has_is_named_although_a_change_at_one_place_does_the_same(
    made: Made, empty: Measurement
) -> None:
    """A mass of the accelerometer is one at its node."""
    search = replace(
        search_among(made((AccelerometerMass(),), (1.0,)).thinned(42), CATALOGUE), rivals=rivals(empty, FixedAcross)
    )
    none = search.fit_paper_model()
    rival = search.fitted(none, search.screened(none, search.rivals), 1)
    weighed = weigh(none, [*selected(search, none, UNCALIBRATED), *rival], UNCALIBRATED)
    assert leading(weighed).effects == ("accelerometer_mass",)


@pytest.mark.parametrize(("kind", "way"), [(FixedAcross, 1), (FixedTurning, 2)])
def test_a_spring_at_a_node_is_a_further_joint_there(empty: Measurement, kind: type[LocalChange], way: int) -> None:
    """Compared with the forward model, which takes joints into the equations of motion instead of free modes."""
    change = kind.variants(empty)[3]
    simulation = simulation_of(empty, change)
    own, spring = len(simulation.baseline.parameters), np.zeros((3, 3), dtype=complex)
    scores = np.zeros(Likelihood(simulation).unknowns)
    scores[own + 2] = 0.7
    position = change.position
    scores[own + 3] = (empty.drawing.node_positions[NODE - 1] - position.centre) / position.spread
    spring[way, way] = change.parameters[2].value(0.7)
    values = simulation.values(scores[: len(simulation.shared)].tolist())
    bench = simulation.joints(values, simulation.groups[0].setting, np.zeros(1, dtype=complex), np.ones((1, 2)))
    joints = [Joint(each.name, each.node, bench[0, 0, place]) for place, each in enumerate(empty.drawing.joints)]
    free = simulation.modes.free
    undamped = replace(simulation, modes=type(simulation.modes)(free, np.zeros_like(free.squared_frequency)))
    predicted = Likelihood(undamped).predict(scores, derivatives=()).accelerances[0]
    each = empty.sets[0]
    expected = accelerance(
        free, [*joints, Joint("more", NODE, spring)], each.frequency, empty.drawing.accelerometer, each.inputs
    ).accelerance
    assert np.max(np.abs(predicted - expected)) < 1e-6 * np.max(np.abs(expected))


def test_every_kind_is_sought_along_the_whole_beam(empty: Measurement) -> None:
    length = empty.drawing.beam.length
    for kind in KINDS:
        places = [each.place * length for each in kind.variants(empty)]
        assert np.max(np.diff([0.0, *places, length])) <= 0.2 * length


def test_every_kind_at_every_place_is_one_of_the_changes_that_compete() -> None:
    assert (len(KINDS) + len(STEPS)) * PLACES + SETTINGS + len(OF_ROWS) + 1 == CHANGES  # and a common base


def test_nothing_local_is_sought_where_no_beam_was_struck(empty: Measurement) -> None:
    assert local_changes(replace(empty, sets=())) == ()
