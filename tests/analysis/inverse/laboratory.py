"""A bench whose truth is known: data from a finer mesh than the model's, noise of 0.003 (m/s^2)/N a line."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.dof import Dof
from analysis.frequency_response import FrequencyResponses
from analysis.inverse.coarse_search import JointShapes
from analysis.inverse.frequency_dependent_joints import accelerance_on
from analysis.inverse.frequency_laws import LAW_PARAMETERS
from analysis.inverse.joint_fit import JointFit
from analysis.inverse.tolerances import Deviations, Tolerances
from analysis.structure.beam import FreeBeam, Mesh, assemble
from analysis.structure.joints import Joint

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

NOISE = 0.003
SENSOR = Dof.parse("3y")
FREQUENCY = np.arange(20.0, 1025.0, 2.0)
RATIOS = (0.004, 0.001, 0.001)
STATED = Tolerances(
    sensor_gain=0.005,
    youngs_modulus=0.005,
    density=0.003,
    sensor_position=0.001,
    joint_position=0.001,
    blow_position=0.0015,
    blow_lean=np.radians(1.0),
    inclination=np.radians(0.5),
)
CONSTANT = np.zeros((len(LAW_PARAMETERS), 2))
"""Laws of joints that do not follow frequency."""
DOMINANT = {"k12": (0, 1), "k22": (1, 1)}


def following(laws: Real, rows: int) -> Deviations:
    """A bench as drawn but for the laws of its joints, (4, joints) in the order of `LAW_PARAMETERS`."""
    found = Deviations.none(laws.shape[1], rows)
    found.joint_laws[:] = laws
    return found


def drawn_as_springs(name: str, node: int, free_beam: FreeBeam) -> JointShapes:
    """A joint of which nothing is drawn: a spring along the beam, one across it, and a weak one in rotation."""
    lever = free_beam.beam.height / 4
    ratios = (0.3, 1.0, 3.0)
    return JointShapes(name, node, np.array([np.diag([each, 1.0, lever**2]) / max(each, 1.0) for each in ratios]))


@dataclass(frozen=True)
class Laboratory:
    """A bench, the model of it, and its accelerances without noise at `FREQUENCY`, (inputs, lines)."""

    model: FreeBeam
    joints: tuple[Joint, Joint]
    inputs: tuple[Dof, ...]
    exact: Complex

    @property
    def nodes(self) -> Real:
        return self.model.mesh.positions[list(self.model.mesh.named)]

    def measured(self, seed: int, exact: Complex | None = None) -> FrequencyResponses:
        truth = self.exact if exact is None else exact
        parts = np.random.default_rng([seed, 1]).standard_normal((2, *truth.shape))
        noisy = truth + NOISE * (parts[0] + 1j * parts[1])
        return FrequencyResponses(
            FREQUENCY, noisy, SENSOR, self.inputs, variance=np.full(truth.shape, NOISE**2, dtype=float)
        )

    def off(self, seed: int, share: float = 0.2) -> list[Joint]:
        """The joints with each term of k and of h off by `share`, up or down."""
        rng = np.random.default_rng([seed, 2])
        found = []
        for joint in self.joints:
            up, down = (1 + share * np.sign(np.triu(rng.uniform(-1, 1, (3, 3)))) for _ in range(2))
            up, down = (np.triu(each) + np.triu(each, 1).T for each in (up, down))
            z = joint.dynamic_stiffness
            found.append(replace(joint, dynamic_stiffness=z.real * up + 1j * z.imag * down))
        return found

    def finer(
        self, *, modulus: float = 1.0, density: float = 1.0, point_masses: dict[int, float] | None = None
    ) -> FreeBeam:
        """The beam on a finer mesh than the model's, with other shares of E and density, and masses (kg by node)."""
        drawn = self.model.beam
        beam = replace(drawn, youngs_modulus=modulus * drawn.youngs_modulus, density=density * drawn.density)
        return assemble(beam, Mesh.through(self.nodes, 16), damping_ratios=RATIOS, point_masses=point_masses)

    def accelerance(self, free: FreeBeam, laws: Real = CONSTANT) -> Complex:
        """(inputs, lines) of this beam on the laboratory's joints, which follow `laws` (4, joints)."""
        follow = following(laws, len(self.inputs))
        return accelerance_on(free, self.joints, follow, FREQUENCY, SENSOR, self.inputs).accelerance

    @property
    def sum_k11(self) -> float:
        return float(sum(joint.dynamic_stiffness[0, 0].real for joint in self.joints))


def power_laws(first: float, second: float) -> Real:
    """(4, joints) laws of joints that follow powers of frequency with these exponents."""
    laws = CONSTANT.copy()
    laws[0] = first, second
    return laws


def dominant(laboratory: Laboratory, fit: JointFit) -> Real:
    """(5, 2) value less truth, and standard deviation, of k12 and k22 of each joint and of the sum of k11."""
    rows = []
    for joint in laboratory.joints:
        found = fit.joints[joint.name]
        for p, q in DOMINANT.values():
            half = np.ptp(found.k_ci95[p, q]) / 2 / 1.959964
            rows.append((found.stiffness[p, q] - joint.dynamic_stiffness[p, q].real, half))
    total, covariance, _ = fit.sum_of(0, 0)
    rows.append((total.real - laboratory.sum_k11, float(np.sqrt(covariance[0, 0]))))
    return np.array(rows)
