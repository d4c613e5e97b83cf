"""A small bench whose measurement follows the diagnosis's own model: for the solver, not for its verdicts."""

from collections.abc import Callable, Collection
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from analysis.dof import Direction, Dof
from analysis.frequency_response import Real
from analysis.gap.catalogue import candidates
from analysis.gap.effect import Effect, Given
from analysis.gap.fitting.fit import Fit, fit
from analysis.gap.fitting.likelihood import BLOW_OF_ROW, Likelihood
from analysis.gap.fitting.stages import CLOSE
from analysis.gap.measurement import Configuration, Drawing, DrawnJoint, HammerSet, Measurement, TesterPoints
from analysis.gap.search.single_effects import Search
from analysis.gap.simulation.baseline import (
    GAIN,
    IN_TESTER,
    LEAN_IN_TESTER,
    MESH_TOLERANCE,
    SOFTENING_IN_TESTER,
    Baseline,
    baseline_of,
)
from analysis.gap.simulation.free_beam_modes import beam_modes_of
from analysis.gap.simulation.scales import HALF_NORMAL
from analysis.gap.simulation.two_rigs import Simulation
from analysis.structure.beam import Beam

INPUTS = (*(Dof(node, Direction.Y) for node in (1, 3, 4, 7, 11)), Dof(1, Direction.X))
SHEAR, COMPRESSION, LOSS = 4e5, 2.4e6, 0.1
LEAN = HALF_NORMAL.blow_lean / 2
"""Standard deviation of the leans of a measured bench's blows, rad."""
MOUNTED = tuple(f"{GAIN}({each.name.lower()} " for each in Configuration)
"""Beginnings of names of the gains of specimens as they are mounted."""
SMALL = {"local compliance": 0.2, "mesh": 5e-5 / MESH_TOLERANCE}
"""Parameters that differ from the drawing by less than others in the measured benches, and by how much less."""
Made = Callable[..., Measurement]


def drawn() -> Drawing:
    """The paper's beam, its joints a little inside the ends."""
    quarter = float(np.pi / 4)
    return Drawing(
        beam=Beam(0.914, 0.0254, 0.0507874, 207e9, 0.3, 7850.0),
        node_positions=np.array([0.0, 0.056, 0.156, 0.256, 0.357, 0.457, 0.557, 0.658, 0.758, 0.858, 0.914]),
        damping_ratios=(0.004, 0.001, 0.001),
        joints=(
            DrawnJoint("I", 2, (-quarter, 3 * quarter), 0.006),
            DrawnJoint("II", 10, (quarter, -3 * quarter), 0.006),
        ),
        accelerometer=Dof(3, Direction.Y),
    )


def blank(drawing: Drawing) -> Measurement:
    """Where and how was measured, with nothing sensible in it yet."""
    frequency = np.arange(20.0, 520.0, 4.0)
    shape = len(INPUTS), frequency.size
    sets = tuple(
        HammerSet(INPUTS, frequency, np.ones(shape, dtype=complex), np.full(shape, 2e-3), force, 23.0)
        for force in (100.0, 400.0)
    )
    grid = np.array(
        [
            (specimen, configuration, amplitude, frequency)
            for specimen in (0, 1)
            for configuration in (0, 1, 2)
            for amplitude in (5e-6, 25e-6, 50e-6)
            for frequency in (20.0, 60.0, 110.0, 180.0)
        ]
    )
    typical = np.array([COMPRESSION, 2 * SHEAR, SHEAR + COMPRESSION])[grid[:, 1].astype(int)]
    points = TesterPoints(
        order=np.random.default_rng(3).permutation(len(grid)).astype(float),
        specimen=grid[:, 0].astype(np.intp),
        configuration=grid[:, 1].astype(np.intp),
        amplitude=grid[:, 2],
        frequency=grid[:, 3],
        stiffness=typical * (1 + 1j * LOSS),
        deviation=2e-3 * typical,
        temperature=np.linspace(22.9, 23.1, len(grid)),
    )
    return Measurement(drawing, sets, points, preset=5e-4)


@pytest.fixture(scope="session")
def drawing() -> Drawing:
    return drawn()


@pytest.fixture(scope="session")
def empty(drawing: Drawing) -> Measurement:
    return blank(drawing)


@pytest.fixture(scope="session")
def points(empty: Measurement) -> TesterPoints:
    """The tester's."""
    assert empty.points is not None
    return empty.points


@pytest.fixture(scope="session")
def made(empty: Measurement) -> Made:
    """A function that measures the bench with some effects: `made(effects, own scores, seed)`."""
    return partial(measured, empty)


def measured(
    empty: Measurement, effects: tuple[Effect, ...] = (), own: tuple[float, ...] = (), seed: int = 1
) -> Measurement:
    """What is measured where and how `empty` says, with some effects at their `own` scores."""
    random = np.random.default_rng(seed)
    likelihood = Likelihood(simulation_of(empty, *effects))
    scores = drawn_scores(likelihood, own, random)
    predicted = likelihood.predict(scores, derivatives=())
    sets = tuple(
        replace(each, accelerance=accelerance + each.deviation * _noise(random, accelerance.shape))
        for each, accelerance in zip(empty.sets, predicted.accelerances, strict=True)
    )
    points = empty.points
    assert points is not None
    noise = points.deviation * _noise(random, points.order.shape)
    return replace(empty, sets=sets, points=replace(points, stiffness=predicted.stiffness + noise))


def drawn_scores(likelihood: Likelihood, own: tuple[float, ...], random: np.random.Generator) -> Real:
    """(unknowns,) true scores of a measured bench, the effects' own included."""
    simulation = likelihood.simulation
    scores, is_drawn = np.zeros(likelihood.unknowns), np.ones(likelihood.unknowns, dtype=bool)
    for place, each in enumerate(simulation.shared):
        is_drawn[place] = not each.name.startswith((LEAN_IN_TESTER, SOFTENING_IN_TESTER, *MOUNTED))
    is_drawn[slice(*likelihood.first_blow[:2])] = False  # the blows of each set have nothing in common
    scores[is_drawn] = 0.5 * random.standard_normal(np.count_nonzero(is_drawn))
    own_places = len(simulation.baseline.parameters) + np.arange(len(own))
    scores[: len(simulation.baseline.parameters)] *= [
        SMALL.get(each.name, 0.1 if each.spread > 0.5 else 1.0) for each in simulation.baseline.parameters
    ]
    scores[slice(likelihood.first_blow[1], likelihood.first_blow[-1])] /= BLOW_OF_ROW
    scores[own_places] = own
    for place, each in enumerate(simulation.shared):  # nothing differs from one set-up or configuration to another
        if each.name.startswith((IN_TESTER, f"{GAIN}(")):
            scores[place] = 0.0
    for _, *joints in likelihood.setups:
        scores[joints] = 0.0
    return scores


def simulation_of(measurement: Measurement, *effects: Effect) -> Simulation:
    """Both rigs of a measurement, with some effects."""
    return Simulation(baseline_of(measurement), beam_modes_of(measurement.drawing), effects)


def fitted(measurement: Measurement) -> Fit:
    """The paper's model, fitted closely."""
    simulation = simulation_of(measurement)
    return fit(simulation, np.zeros(Likelihood(simulation).unknowns), CLOSE, 1e-3)


def at_centre(parameters: Baseline | Effect, **other: float) -> Given:
    """All parameters at the centre of their priors but some."""
    return {each.name: each.centre for each in parameters.parameters} | other


def search_among(measurement: Measurement, ids: Collection[str]) -> Search:
    """A search that tries a part of the catalogue at all lines of a measurement."""
    tried = tuple(each for each in candidates(measurement) if each.id in ids)
    return Search(measurement, tried, beam_modes_of(measurement.drawing))


def _noise(random: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    return random.standard_normal(shape) + 1j * random.standard_normal(shape)
