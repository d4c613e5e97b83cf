"""Benches of other layouts than the paper's, on an exact beam, as a measurement and as a bundle.

The beam of the data is the simulation's: a series from each kink to the next, which shares no mesh with the model.
"""

import json
from dataclasses import dataclass, replace
from math import radians
from pathlib import Path

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.structure.joints import Cylinder, Joint, joint_from_cylinders
from api.commands.sequences import named_sequence
from jointlab.identification.measurement import MeasuredArticle
from simlab.beam import Load, SimulatedBeam, free_modes
from simlab.coupling import CoupledBeam, block_diagonal
from store.dof import StoredDof
from store.exchange.accelerance_file import accelerance_functions
from store.exchange.bundle_setup import FORMAT, Article
from store.exchange.uff import write_uff
from store.measurements.frequency_responses import FrequencyResponseSet

NOISE = 0.002  # at every other hertz what 0.003 is at every one
FREQUENCY: Real = np.arange(20.0, 1024.0, 2.0)
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


def measured(layout: Layout, seed: int = 3, true: Article | None = None) -> MeasuredArticle:
    """Of the bench `true`, which is that of the drawing where it is not given."""
    article, inputs = article_of(layout), [StoredDof.parse(point) for point in layout.struck.split()]
    clean = exact(true or article, joints_of(article), inputs)
    parts = np.random.default_rng(seed).standard_normal((2, *clean.shape))
    struck = FrequencyResponseSet(
        number=1, response=StoredDof.parse(layout.accelerometer), inputs=tuple(inputs), frequency=FREQUENCY,
        accelerance=clean + NOISE * (parts[0] + 1j * parts[1]), averages=10, peak_force=100.0, temperature_c=23.0,
        window="none", sample_rate=5120.0, block_seconds=1.0, estimator="H1", variance=np.full(clean.shape, NOISE**2),
    )  # fmt: skip
    return MeasuredArticle("another layout", article, (struck,), (), raw=False)


def write_bundle(layout: Layout, folder: Path, true: Article | None = None) -> Path:
    """The same as a bundle with one set, whose noise is not stated."""
    measurement = measured(layout, true=true)
    (struck,) = measurement.sets
    folder.mkdir()
    write_uff(
        folder / "set.unv", accelerance_functions(struck.response, struck.inputs, struck.frequency, struck.accelerance)
    )
    entry = {"file": "set.unv"} | {
        name: getattr(struck, name)
        for name in ("averages", "peak_force", "temperature_c", "window", "sample_rate", "block_seconds")
    }
    setup = {"format": FORMAT, "title": measurement.title, "inverse": [entry]}
    setup |= measurement.article.model_dump(mode="json")
    (folder / "setup.json").write_text(json.dumps(setup), encoding="utf-8")
    return folder


def averaged(layout: Layout, averages: int, seed: int = 3) -> MeasuredArticle:
    """Blows of one force with noise in the acceleration alone; only coherence tells that noise."""
    measurement = measured(layout, seed)
    (struck,) = measurement.sets
    clean = exact(measurement.article, joints_of(measurement.article), list(struck.inputs))
    parts = np.random.default_rng(seed).standard_normal((2, averages, *clean.shape))
    blows = clean + NOISE * np.sqrt(averages) * (parts[0] + 1j * parts[1])
    mean = np.mean(blows, axis=0)
    coherence = np.abs(mean) ** 2 / np.mean(np.abs(blows) ** 2, axis=0)
    of_blows = replace(struck, accelerance=mean, coherence=coherence, variance=None, averages=averages)
    return replace(measurement, sets=(of_blows,))
