"""What a fit says of the blows behind it, against the blows that the simulated operator really struck."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.dof import Dof
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.joint_likelihood import identify_from_responses
from analysis.inverse.tolerances import FREEHAND_LEAN, Tolerances
from analysis.modal.spectra import responses_from_blows
from analysis.structure.beam import Beam, Mesh
from analysis.structure.converged import assemble_converged
from analysis.structure.joints import Joint
from jointlab.identification.statements import fit_statements
from simlab.article import JOINT_NODES, NODE_POSITIONS
from simlab.bench import SimulatedBench, ordinary_bench
from simlab.clock import Clock

RATE, SAMPLES, BEFORE, BLOWS = 4096.0, 8192, 205, 6
POINTS = tuple(map(Dof.parse, ["1y", "4y", "5y", "7y", "9y", "11y", "1x", "11x"]))
TOLERANCES = Tolerances(0.005, 0.005, 0.003, 0.001, 0.001, 0.0015, blow_lean=FREEHAND_LEAN)


@pytest.fixture(scope="module")
def bench() -> SimulatedBench:
    """Struck at every point; its blows are in the order of the points."""
    bench = ordinary_bench(4, Clock())
    for number in range(BLOWS * len(POINTS)):
        point = POINTS[number // BLOWS]
        bench.strike(point.node, str(point.direction), at=1.0 + 5.0 * number, what="clean")
    return bench


@pytest.fixture(scope="module")
def fit(bench: SimulatedBench) -> JointFit:
    starts = [round((1.0 + 5.0 * number) * RATE - BEFORE) / RATE for number in range(BLOWS * len(POINTS))]
    records = [bench.hammer_signals(start, RATE, SAMPLES) for start in starts]
    force, acceleration = (
        np.array([record[name] for record in records]).reshape(len(POINTS), BLOWS, SAMPLES)
        for name in ("hammer", "accelerometer")
    )
    responses = responses_from_blows(
        list(force), list(acceleration), RATE, Dof.parse("3y"), POINTS, 1024.0, pre_trigger=BEFORE // 2
    )
    drawn = Beam(0.914, 0.0254, 0.0507874, youngs_modulus=207e9, poisson_ratio=0.3, density=7850.0)
    model = assemble_converged(drawn, Mesh.through(NODE_POSITIONS, 8), damping_ratios=(0.004, 0.001, 0.001))
    truth = bench.truth()["inverse"]
    start = [
        Joint(name, node, 1.05 * np.array(truth[name]["k"]) + 1j * np.array(truth[name]["h"]))
        for name, node in JOINT_NODES.items()
    ]
    return identify_from_responses(model, responses, start, tolerances=TOLERANCES)


def test_the_lean_of_the_blows_at_each_point_is_found(bench: SimulatedBench, fit: JointFit) -> None:
    loads, off = [blow.load for blow in bench.blows], []
    for row, point in enumerate(POINTS):
        struck = loads[BLOWS * row : BLOWS * (row + 1)]
        true = np.mean([load.y / load.x if str(point.direction) == "x" else load.x / load.y for load in struck])
        found = fit.leans[str(point)]
        assert found.standard_error < 0.5 * FREEHAND_LEAN
        off.append(found.value - float(true))
    assert np.sqrt(np.mean(np.square(off))) < np.radians(0.25)  # a single blow leans by a degree


def test_the_point_where_blows_lean_most_is_named(fit: JointFit) -> None:
    leaning = fit.values.copy()
    for point, degrees in (("4y", 2.0), ("11x", -3.0)):
        leaning[list(map(str, POINTS)).index(point) - len(POINTS)] = np.radians(degrees)  # leans come last
    (text,) = fit_statements(replace(fit, values=leaning))
    half = np.degrees(fit.leans["11x"].half_width())
    assert text.startswith(f"Blows lean most at 11x, by 3.0 ± {half:.1f} degrees (95 %")


def test_straight_blows_are_not_mentioned(fit: JointFit) -> None:
    assert fit_statements(replace(fit, values=np.zeros_like(fit.values))) == []
    tolerance = fit.likelihood.tolerance.copy()
    tolerance[-len(POINTS) :, -len(POINTS) :] = 0.0
    assert fit_statements(replace(fit, likelihood=replace(fit.likelihood, tolerance=tolerance))) == []
