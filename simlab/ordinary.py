"""The ordinary bench: the article of the paper, of real rubber, as a case without effects.

What a laboratory does not know better than its tolerances is drawn by seed: half a tolerance is one standard deviation.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from simlab.article import (
    INCLINATIONS_DEG,
    JOINT_NODES,
    NODE_POSITIONS,
    SENSOR_NODE,
    TOLERANCES,
    SimulatedArticle,
    SimulatedJoint,
    clipped_normal,
    off_nominal,
)
from simlab.beam import Real
from simlab.case.blows import UNIT_NOISE
from simlab.case.campaign import MEASURED, Campaign, Setup, draw_points
from simlab.case.draw import Case
from simlab.elastomer import BLOW_AMPLITUDE, REFERENCE_TEMPERATURE, ElastomerCylinder, scattered
from simlab.hammer_operator import PLACE_SCATTER, PULSE_WIDTH
from simlab.tester_frame import TesterFrame

CYLINDERS = {
    "I": ElastomerCylinder(shear=0.36e6, compression=2.30e6, rotation=18.0),
    "II": ElastomerCylinder(shear=0.49e6, compression=2.70e6, rotation=22.0),
}


@dataclass(frozen=True)
class BenchConditions:
    """How a bench behaves, apart from its seed.

    Attributes:
        peak_force: mean peak force of a blow, N; a harder hammer level softens the joints.
        double_hits: probability that an ordinary blow bounces.
        tolerances: scale of what is drawn off its nominal value (beam, positions, cylinders); 0 is the drawing itself.
        scatter: scale of the operator's scatter in place, angle, force and width; 0 is a hammer in a guide.
        gain_error: largest relative error of a sensor's gain; 0 is exact.
        force_noise, acceleration_noise: white noise of the two sensors, N and m/s^2 rms a sample.
        noise_rate: sample rate for which that is, Hz; it is as dense over frequency at any other. None: at any rate.
        cross_axis: cross-axis sensitivity of the accelerometer, through which it sees the beam bend out of plane.
        frame: what the tester adds to the specimen in it; nothing by default.
    """

    peak_force: float = 100.0
    double_hits: float = 0.03
    tolerances: float = 1.0
    scatter: float = 1.0
    gain_error: float = 0.005
    force_noise: float = 0.02
    acceleration_noise: float = 0.008
    noise_rate: float | None = None
    cross_axis: float = 0.01
    frame: TesterFrame = field(default_factory=TesterFrame)


def draw_article(seed: int, tolerances: float = 1.0) -> SimulatedArticle:
    """Build the article of `seed`; `tolerances` scales everything drawn, 0 gives the drawing itself."""
    rng = np.random.default_rng([seed, 1])

    def off(name: str, count: int = 1) -> Real:
        return clipped_normal(rng, 0.5 * tolerances * TOLERANCES[name], count)

    beam = off_nominal(rng, 0.5 * tolerances)
    joints = {}
    for name, node in JOINT_NODES.items():
        lower, upper = np.array(INCLINATIONS_DEG[name]) + off("inclination_deg", 2)
        joints[name] = SimulatedJoint(
            position=NODE_POSITIONS[node - 1] + float(off("node_position")[0]),
            inclinations_deg=(float(lower), float(upper)),
            cylinders=(scattered(CYLINDERS[name], rng, tolerances), scattered(CYLINDERS[name], rng, tolerances)),
        )
    sensor = NODE_POSITIONS[SENSOR_NODE - 1] + float(off("node_position")[0])
    return SimulatedArticle(beam, joints, sensor)


def ordinary_case(seed: int, conditions: BenchConditions) -> Case:
    """The article of `seed`, and one hammer set and the paper's sine points as `conditions` have them.

    A blow rings down; a constant amplitude of 3 um under 100 N stands for it, so that each blow meets a linear beam. It
    is about the mean logarithm, weighted by energy, of what the beam then does at the joints: 3.4 um at I and 1.8 um at
    II in y alone for a blow at node 3.
    """
    points = draw_points(np.random.default_rng([seed, 1]), "sequential", REFERENCE_TEMPERATURE)
    setup = Setup(
        peak_force=conditions.peak_force, gain=1.0, offsets=(0.0,) * len(MEASURED), temperature=REFERENCE_TEMPERATURE
    )
    campaign = Campaign(
        node_positions=NODE_POSITIONS,
        setups=(setup,),
        points=replace(points, temperature=np.full(points.order.size, REFERENCE_TEMPERATURE)),
        order_kind="sequential",
        tester_gain=1.0,
        pulse_width=0.75 * PULSE_WIDTH,  # of a half-sine with the half-height width of that sine-squared
        force_noise=conditions.force_noise * UNIT_NOISE,
        acceleration_noise=conditions.acceleration_noise * UNIT_NOISE,
        place_scatter=conditions.scatter * PLACE_SCATTER,
        direct_noise=1.0,
        joint_amplitude=BLOW_AMPLITUDE,
        amplitude_fall=0.0,
        recorded=(),
    )
    article = draw_article(seed, conditions.tolerances)
    return Case(seed, None, replace(article, cross_axis=conditions.cross_axis), campaign, ())
