"""Tolerances of the bench, and the deviations from the drawing that they allow.

A tolerance is one standard deviation of a Gaussian prior with mean zero. Zero means that the drawing is exact; the
deviation is then no parameter.

The dependence of joints on frequency is such a deviation too: k + i h = (k + i h at 100 Hz) (f / 100 Hz)^beta. That is
the spring-pot (i w / w0)^beta, the power law of rubber far from its glass (R. L. Bagley, P. J. Torvik, J. Rheology 27,
1983), whose constant loss angle is in the terms at 100 Hz. The drawing's joint has beta = 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.dof import Direction, Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Real

COMMON = ("gain", "Young's modulus", "density", "sensor position")
"""Deviations of the bench as a whole; position and exponent of each joint, position and lean of each row's blows
follow."""
MODULUS, DENSITY = COMMON.index("Young's modulus"), COMMON.index("density")
SENSOR = COMMON.index("sensor position")
FREEHAND_LEAN = np.radians(2.0)
"""Tolerance of the mean lean of the blows at a point for a hand-held hammer, rad. Accelerances determine the lean to
about 0.2 degrees; with a tolerance of 0.3 degrees intervals are the same."""
REFERENCE_FREQUENCY = 100.0  # Hz, at which the terms of joints that follow frequency are stated


@dataclass(frozen=True)
class Tolerances:
    """Standard deviations of the stated bench.

    Attributes:
        sensor_gain: relative, of hammer and accelerometer together.
        youngs_modulus: relative.
        density: relative; known point masses share it.
        sensor_position: of the accelerometer along the beam, m.
        joint_position: of each joint along the beam, m.
        blow_position: of each row's blows, m: along the beam, on an end face above or below its middle.
        blow_lean: of each row's blows, rad: how far they point along the beam, on an end face across it.
        inclination: of each cylinder, rad; used by the cylinder parameters only.
        joint_exponent: of the power law of each joint; rubber has 0.02 to 0.2. Zero means that joints are constant.
        material_correlation: between the deviations of Young's modulus and density, from a test of the suspended beam.
    """

    sensor_gain: float = 0.0
    youngs_modulus: float = 0.0
    density: float = 0.0
    sensor_position: float = 0.0
    joint_position: float = 0.0
    blow_position: float = 0.0
    inclination: float = 0.0
    joint_exponent: float = 0.0
    material_correlation: float = 0.0
    blow_lean: float = 0.0

    def __post_init__(self) -> None:
        if not abs(self.material_correlation) < 1:
            raise AnalysisError(f"a correlation of {self.material_correlation}; it must lie between -1 and 1")
        for name, value in vars(self).items():
            if name != "material_correlation" and not (np.isfinite(value) and value >= 0):
                raise AnalysisError(f"the tolerance {name} is {value}; it must be zero or a positive number")

    def covariance(self, response: Dof, inputs: Sequence[Dof], joints: int) -> Real:
        """(4 + 2 joints + 2 rows, the same) covariance in the order of `Deviations`."""
        deviation = self.deviations(response, inputs, joints)
        found = np.diag(deviation**2)
        mutual = self.material_correlation * deviation[MODULUS] * deviation[DENSITY]
        found[MODULUS, DENSITY] = found[DENSITY, MODULUS] = mutual
        return found

    def deviations(self, response: Dof, inputs: Sequence[Dof], joints: int) -> Real:
        """(4 + 2 joints + 2 rows,) standard deviations in the order of `Deviations`.

        An accelerometer that measures along the beam has no position.
        """
        sensor = self.sensor_position if response.direction is Direction.Y else 0.0
        return np.array(
            [self.sensor_gain, self.youngs_modulus, self.density, sensor]
            + joints * [self.joint_position]
            + joints * [self.joint_exponent]
            + len(inputs) * [self.blow_position]
            + len(inputs) * [self.blow_lean]
        )


EXACT = Tolerances()
"""A bench exactly as drawn."""


@dataclass(frozen=True, eq=False)
class Deviations:
    """How one bench and its measurement differ from the drawing.

    Attributes:
        values: (4 + 2 joints + 2 rows,) relative gain, Young's modulus and density; positions of the accelerometer and
            of each joint, m; exponent of each joint; positions of each row's blows, m, and their leans, rad.
        joints: number of joints.
    """

    values: Real
    joints: int

    @classmethod
    def none(cls, joints: int, rows: int) -> Deviations:
        """A bench as drawn."""
        return cls(np.zeros(len(COMMON) + 2 * joints + 2 * rows), joints)

    @classmethod
    def following(cls, exponents: Sequence[float], rows: int) -> Deviations:
        """A bench as drawn but for the exponents of its joints."""
        found = cls.none(len(exponents), rows)
        found.joint_exponents[:] = exponents
        return found

    @classmethod
    def labelled(
        cls, values: Mapping[str, float], response: Dof, inputs: Sequence[Dof], joint_names: Sequence[str]
    ) -> Deviations:
        """From values by their `deviation_labels`; those that are not named are zero."""
        labels = deviation_labels(response, inputs, joint_names)
        return cls(np.array([values.get(label, 0.0) for label in labels]), len(joint_names))

    @property
    def gain(self) -> float:
        """Reading of hammer and accelerometer over the true value, less one."""
        return float(self.values[0])

    @property
    def youngs_modulus(self) -> float:
        """Relative."""
        return float(self.values[MODULUS])

    @property
    def density(self) -> float:
        """Relative."""
        return float(self.values[DENSITY])

    @property
    def sensor_position(self) -> float:
        """Of the accelerometer, m."""
        return float(self.values[3])

    @property
    def joint_positions(self) -> Real:
        """(joints,) m."""
        return self.values[len(COMMON) : len(COMMON) + self.joints]

    @property
    def joint_exponents(self) -> Real:
        """(joints,)."""
        return self.values[len(COMMON) + self.joints : len(COMMON) + 2 * self.joints]

    @property
    def blow_positions(self) -> Real:
        """(rows,) m."""
        return self._of_rows[: self._of_rows.size // 2]

    @property
    def blow_leans(self) -> Real:
        """(rows,) rad."""
        return self._of_rows[self._of_rows.size // 2 :]

    @property
    def _of_rows(self) -> Real:
        return self.values[len(COMMON) + 2 * self.joints :]


def deviation_labels(response: Dof, inputs: Sequence[Dof], joint_names: Sequence[str]) -> tuple[str, ...]:
    """(4 + 2 joints + 2 rows,) names of the deviations, in the order of `Deviations`."""
    gain, modulus, density, sensor = COMMON
    return (
        f"{gain} of {response}",
        modulus,
        density,
        f"{sensor} of {response}",
        *(f"position of joint {name}" for name in joint_names),
        *(f"exponent of joint {name}" for name in joint_names),
        *(f"blow position of {point}" for point in inputs),
        *(f"lean of the blows at {point}" for point in inputs),
    )
