"""The paper's bench as its tables have it, and what the unmodelled effects do to its nine frequencies."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from analysis.frequency_response import Complex, Real
from analysis.gap.effects.attachment import JointMass
from analysis.gap.effects.beam import AccelerometerMass, Density, MeshError, YoungsModulus
from analysis.gap.effects.joint_frequency import SpringPot
from analysis.gap.effects.joint_geometry import CylinderAngle, SupportPosition, VerticalOffset
from analysis.gap.effects.joint_state import SOFTENING, PreloadStiffening, TemperatureShift
from analysis.gap.parameter import Parameter
from analysis.gap.simulation.free_beam_modes import BeamModes
from analysis.structure.beam import Beam, FreeBeam, Mesh, assemble
from analysis.structure.setup import RIGID_MODES

BEAM = Beam(0.914, 0.0254, 1290e-6 / 0.0254, youngs_modulus=207e9, poisson_ratio=0.3, density=7850.0)
SUPPORTED = np.array([77.4, 79.5, 204.0, 266.0, 469.0, 865.0])  # Hz, the experiment of Table 4
PUBLISHED_THEORY = np.array([79.0, 82.4, 202.0, 265.0, 474.0, 870.0])  # Hz, Timoshenko, Table 4
FREE = np.array([161.0, 441.0, 858.0])  # Hz, the experiment of Table 1
MEASURED = np.concatenate([SUPPORTED, FREE])
LAST_DIGIT = np.array([0.1, 0.1, *7 * [1.0]])  # Hz
ERROR = (LAST_DIGIT / 2 + 0.002 * MEASURED) / MEASURED
"""(9,) standard deviation of the logarithm of a published frequency: half its last digit, and 0.2 % of estimation."""

JOINTS = ("I", "II")
NODES = (2, 10)
INTERVALS = {  # Table 2, in units of EI/L^3, EI/L^2 and EI/L; the two prints of a mutual term one after the other
    "I": {
        "k11": ((129, 153),),
        "k12": ((97, 109), (97, 109)),
        "k13": ((2, 8), (-28, 10)),
        "k22": ((124, 135),),
        "k23": ((-2.1, 1.9), (-10, 4)),
        "k33": ((-2, 4),),
    },
    "II": {
        "k11": ((170, 180),),
        "k12": ((-123, -115), (-123, -115)),
        "k13": ((7, 11), (-6, 8)),
        "k22": ((165, 175),),
        "k23": ((-5, -1), (-5, 9)),
        "k33": ((-2.9, 3.1),),
    },
}
LOSS_FACTORS = {"I": (0.11, 0.07, 0.035), "II": (0.12, 0.16, 0.16)}  # of k11, k12, k22: midpoints of Table 3
SPRING_POT_POWER = 0.35
SPRING_POT_REFERENCE = 100.0  # Hz, amid the modes that Table 2 was identified on


@dataclass(frozen=True)
class PaperBench:
    """The model: how far the joint nodes lie from the ends (m), and elements between the nodes."""

    inset: float
    elements_between: int = 2

    def frequencies(self, given: Mapping[str, float]) -> Real:
        """(9,) Hz: six of the supported beam, three of the free one.

        Args:
            given: parameters that are not at their centre, by the names of `joint_terms` and `effect_parameters`.
        """
        sensor = {3: given.get("m_sensor", 0.0)}
        free = self._bar(given, sensor)
        caps = {node: given.get("m_joint", 0.0) for node in NODES}
        held = self._bar(given, sensor | caps) if any(caps.values()) else free
        return np.concatenate([_supported(held, given), free.frequency[RIGID_MODES : RIGID_MODES + FREE.size]])

    def _bar(self, given: Mapping[str, float], masses: Mapping[int, float]) -> FreeBeam:
        beam = replace(
            BEAM,
            youngs_modulus=BEAM.youngs_modulus * (1 + given.get("modulus", 0.0)),
            density=BEAM.density * (1 + given.get("density", 0.0)),
        )
        inset = self.inset + given.get("inset", 0.0)
        left, right = inset + given.get("dx_I", 0.0), BEAM.length - inset + given.get("dx_II", 0.0)
        mesh = Mesh.through([0.0, *np.linspace(left, right, 9), BEAM.length], self.elements_between)
        free = assemble(beam, mesh, point_masses=masses)
        stiffened = free.squared_frequency * (
            1 + given.get("third_mode", 0.0) * BeamModes(free, free.damping_rate).mesh_share
        )
        return replace(free, squared_frequency=stiffened)


def joint_terms() -> dict[str, tuple[float, Parameter]]:
    """Midpoint and prior of each term of Table 2, in its units: a 95 % interval spans 3.92 standard deviations."""
    found = {}
    for name, terms in INTERVALS.items():
        for term, prints in terms.items():
            middle = float(np.mean(prints))
            spread = float(np.mean([high - low for low, high in prints])) / 3.92
            found[f"{term}({name})"] = (middle, Parameter(f"{term}({name})", "1", 0.0, spread))
    return found


def effect_parameters() -> dict[str, Parameter]:
    """Priors of the effects, the catalogue's own where six frequencies can carry its law.

    Temperature, preload and amplitude are one logarithm of a common stiffness factor each. Two laws are cut down to
    one number: a spread of stiffness enters by its square, a foundation by its static compliance across the bar.
    """
    kelvin, per_mm = TemperatureShift().parameters[0].spread, PreloadStiffening().parameters[0].spread
    angle = CylinderAngle().parameters[0].spread
    found = [
        *SupportPosition(JOINTS).parameters,
        *VerticalOffset(JOINTS).parameters,
        replace(JointMass().parameters[0], name="m_joint"),
        replace(AccelerometerMass().parameters[0], name="m_sensor"),
        Parameter("length_squared", "m2", 0.0, 0.03**2, least=0.0),
        MeshError().parameters[0],
        Parameter("g", "1", 0.0, SpringPot().parameters[0].spread),
        replace(YoungsModulus().parameters[0], name="modulus"),
        replace(Density().parameters[0], name="density"),
        *(Parameter(f"c_{name}", "m/N", 0.0, 1 / 1.5e7, least=0.0) for name in JOINTS),
        *(Parameter(f"delta_{name}", "deg", 0.0, angle) for name in JOINTS),
        Parameter("temperature", "1", 0.0, SOFTENING.centre * kelvin),
        Parameter("preload", "1", 0.0, 0.5 * per_mm),  # the tester's preset is 0.5 mm
        Parameter("amplitude", "1", 0.0, 0.35),
    ]
    return {parameter.name: parameter for parameter in found}


def joint_matrix(name: str, given: Mapping[str, float]) -> Complex:
    """(3, 3) k + i h of a joint, N/m, N, N m."""
    own = {term: middle + given.get(term, 0.0) for term, (middle, _) in joint_terms().items()}
    (k11, k12, k13, k22, k23, k33) = (own[f"{term}({name})"] for term in INTERVALS[name])
    loss11, loss12, loss22 = (1 + 1j * factor for factor in LOSS_FACTORS[name])
    table = np.array([[k11 * loss11, k12 * loss12, k13], [k12 * loss12, k22 * loss22, k23], [k13, k23, k33]])
    matrix = table * BEAM.stiffness_unit * np.exp(sum(given.get(each, 0.0) for each in COMMON_FACTORS))

    turn = np.radians(given.get(f"delta_{name}", 0.0))
    turned = np.array([[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    shifted = np.eye(3)
    shifted[2, 0] = -given.get(f"shift_{name}", 0.0)  # Eq. (10): all cylinders of the joint off the axis
    matrix = shifted @ turned.T @ matrix @ turned @ shifted.T
    matrix[2, 2] += matrix[1, 1] * given.get("length_squared", 0.0) / 12

    compliance = given.get(f"c_{name}", 0.0)  # in series, across the bar
    return np.asarray(matrix - np.outer(matrix[:, 1], matrix[1]) * compliance / (1 + compliance * matrix[1, 1]))


COMMON_FACTORS = ("temperature", "preload", "amplitude")


def _supported(free: FreeBeam, given: Mapping[str, float]) -> Real:
    """(6,) Hz; a stiffness that follows frequency is taken at each published mode."""
    strength = given.get("g", 0.0)
    if not strength:
        return _six(free, given, 1.0)
    factors = (1 + strength * (1j * SUPPORTED / 100.0) ** SPRING_POT_POWER) / (
        1 + strength * (1j * SPRING_POT_REFERENCE / 100.0) ** SPRING_POT_POWER
    )
    return np.array([_six(free, given, complex(factor))[mode] for mode, factor in enumerate(factors)])


def _six(free: FreeBeam, given: Mapping[str, float], factor: complex) -> Real:
    """(6,) Hz, in all free modes of the mesh; the bar's own damping moves none by 1e-5."""
    squared = np.diag(free.squared_frequency).astype(complex)
    for name, node in zip(JOINTS, NODES, strict=True):
        shapes = free.shapes[free.mesh.node_degrees(node)]
        squared += factor * shapes.T @ joint_matrix(name, given) @ shapes
    found = np.sort(np.linalg.eigvals(squared).real)[: SUPPORTED.size]
    return np.asarray(np.sqrt(found) / (2 * np.pi))
