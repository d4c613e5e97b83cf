"""Benches that are laid out in another way than the paper's, on an exact beam: identified, and no reason is false.

The beam of the data is the simulation's: a series from each kink to the next, which shares no mesh with the model.
"""

import json
from dataclasses import dataclass
from math import radians
from pathlib import Path

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.structure.joints import Cylinder, Joint, joint_from_cylinders
from api.commands.sequences import named_sequence
from jointlab.identification.document import identification_document
from jointlab.identification.measurement import Measurement
from jointlab.identification.options import Options
from jointlab.identification.pipeline import Identification, identify
from jointlab.report.page import write_report
from jointlab.report.summary import summary_sections
from simlab.beam import Load, SimulatedBeam, free_modes
from simlab.coupling import CoupledBeam, block_diagonal
from store.bundle_setup import Article
from store.dof import StoredDof
from store.frequency_responses import FrequencyResponseSet

NOISE = 0.003
FREQUENCY: Real = np.arange(20.0, 1024.0, 1.0)
CYLINDERS = {  # shear and compression in MN/m, loss factor, and which way the joint leans
    "I": (0.36, 2.30, 0.12, -1),
    "II": (0.49, 2.70, 0.09, 1),
    "III": (0.25, 1.20, 0.11, -1),
    "IV": (0.60, 3.40, 0.07, 1),
}


@dataclass(frozen=True)
class Layout:
    """Where joints stand, the accelerometer sits and the hammer strikes."""

    nodes: int
    joints: tuple[int, ...]
    accelerometer: str
    struck: str


LAYOUTS = {
    "nine nodes": Layout(9, (2, 8), "3y", "1y 3y 4y 5y 6y 7y 9y 1x 9x"),
    "interior joints": Layout(11, (4, 8), "6y", "1y 2y 3y 5y 6y 7y 9y 10y 11y 1x 11x"),
    "three joints": Layout(11, (2, 6, 10), "3y", "1y 3y 4y 5y 7y 8y 9y 11y 1x 11x"),
    "no driving point": Layout(11, (2, 10), "3y", "1y 5y 7y 9y 11y 1x 11x"),
}
FURTHER = {
    "one joint": Layout(7, (3,), "5y", "1y 2y 4y 5y 6y 7y 1x"),
    "four joints": Layout(12, (2, 5, 8, 11), "4y", "1y 3y 4y 6y 7y 9y 10y 12y 1x 12x"),
    "five rows": Layout(11, (2, 10), "3y", "1y 3y 6y 11y 11x"),
}


def article_of(layout: Layout) -> Article:
    """The paper's beam on other joints, each of two cylinders, without added masses."""
    drawn = named_sequence("paper").article
    places = (0.0, *np.linspace(0.055, drawn.beam.length - 0.055, layout.nodes - 2).tolist(), drawn.beam.length)
    joints = tuple(
        drawn.joints[0].model_copy(
            update={
                "name": name,
                "node": node,
                "added_mass": 0.0,
                "inclinations_deg": (45.0 * leaning, -135.0 * leaning),
            }
        )
        for (name, (*_, leaning)), node in zip(CYLINDERS.items(), layout.joints, strict=False)
    )
    at = StoredDof.parse(layout.accelerometer)
    sensor = drawn.accelerometer.model_copy(update={"node": at.node, "direction": at.direction, "mass": 0.0})
    beam = drawn.beam.model_copy(update={"free_damping_ratios": (0.001,)})
    return drawn.model_copy(update={"beam": beam, "node_positions": places, "joints": joints, "accelerometer": sensor})


def joints_of(article: Article) -> tuple[Joint, ...]:
    """The true ones."""
    found = []
    for drawn in article.joints:
        shear, compression, loss, _ = CYLINDERS[drawn.name]
        lossy = 1e6 * (1 + 1j * loss)
        cylinder = Cylinder(shear * lossy, compression * lossy, 2e-5 * lossy)
        angles = [radians(angle) for angle in drawn.inclinations_deg]
        found.append(joint_from_cylinders(drawn.name, drawn.node, (cylinder, cylinder), angles, drawn.eccentricity))
    return tuple(found)


def exact(article: Article, joints: tuple[Joint, ...], inputs: list[StoredDof]) -> Complex:
    """(rows, lines) accelerances by the simulation's beam, (m/s^2)/N."""
    places, drawn, sensor = article.node_positions, article.beam, article.accelerometer
    kinks = sorted({places[node - 1] for node in (sensor.node, *(joint.node for joint in joints))} - {0.0, places[-1]})
    beam = SimulatedBeam(
        drawn.length, drawn.height, drawn.width, drawn.youngs_modulus, drawn.poisson_ratio, drawn.density,
        drawn.free_damping_ratios, terms=24, kinks=tuple(kinks),
    )  # fmt: skip
    modes = free_modes(beam)
    shapes = np.array([modes.shape(way, places[joint.node - 1]) for joint in joints for way in "xyr"])
    coupled = CoupledBeam(modes, shapes, np.asarray(2 * np.pi * FREQUENCY, dtype=complex))
    held = block_diagonal([joint.dynamic_stiffness for joint in joints], FREQUENCY.size)
    loads = np.array([Load(places[point.node - 1], **{point.direction: 1.0}).in_plane(modes) for point in inputs])
    return coupled.accelerance(modes.shape(sensor.direction, places[sensor.node - 1]), loads, held)


def measured(layout: Layout, seed: int = 3) -> Measurement:
    article, inputs = article_of(layout), [StoredDof.parse(point) for point in layout.struck.split()]
    clean = exact(article, joints_of(article), inputs)
    parts = np.random.default_rng(seed).standard_normal((2, *clean.shape))
    struck = FrequencyResponseSet(
        number=1, response=StoredDof.parse(layout.accelerometer), inputs=tuple(inputs), frequency=FREQUENCY,
        accelerance=clean + NOISE * (parts[0] + 1j * parts[1]), averages=10, peak_force=100.0, temperature_c=23.0,
        window="none", sample_rate=5120.0, block_seconds=1.0, estimator="H1", variance=np.full(clean.shape, NOISE**2),
    )  # fmt: skip
    return Measurement("another layout", article, (struck,), (), raw=False)


def holds(found: Identification, most: float = 0.05) -> None:
    """All gates passed, and k12 and k22 of each joint within 1.5 times their intervals, these narrower than `most`."""
    assert found.inverse is not None
    assert found.inverse.fit.passed, [check.text for check in found.inverse.fit.all_checks if not check.passed]
    for true in joints_of(found.measurement.article):
        joint = found.inverse.likelihood.joints[true.name]
        for at in ((1, 1), (0, 1)):
            (low, high), k = joint.k_ci95[at], true.dynamic_stiffness[at].real
            assert low - 0.25 * (high - low) < k < high + 0.25 * (high - low), (true.name, at)
            assert high - low < most * abs(k), (true.name, at)


@pytest.mark.parametrize("name", LAYOUTS)
def test_a_layout_that_is_not_the_papers_is_identified(name: str) -> None:
    found = identify(measured(LAYOUTS[name]))
    holds(found)
    document = json.loads(json.dumps(identification_document(found)))
    assert set(document["inverse"]) == {*list(CYLINDERS)[: len(LAYOUTS[name].joints)], "weak_directions"}
    assert (document["inverse_paper"] is None) == bool(document["inverse_paper_left_out"])


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("three joints", "1y, 3y, 4y, 5y, 7y, 8y, 9y, 11y, 1x, 11x do not determine the motion of joints at nodes"),
        ("five rows", "2 joints need 6 shape components or more, of which 1y, 3y, 6y, 11y, 11x were measured"),
    ],
)
def test_the_papers_method_is_left_out_with_the_reason(name: str, said: str, tmp_path: Path) -> None:
    found = identify(measured({**LAYOUTS, **FURTHER}[name]))
    holds(found)
    assert found.inverse is not None
    assert said in found.inverse.paper_left_out
    (left_out,) = [each for each in summary_sections(found)[1].content if isinstance(each, str)]
    assert left_out == f"{found.inverse.paper_left_out}."
    write_report(found, tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert said in page
    assert "Fig. 5" not in page
    assert "Fig. 7" in page


def test_terms_are_not_held_about_a_method_that_is_left_out() -> None:
    with pytest.raises(AnalysisError, match=r"about those of the paper's method.*left out.*strike more points"):
        identify(measured(FURTHER["five rows"]), Options(regularise=0.3))
