"""Tolerances of the bench, and the deviations from the drawing that they allow.

A tolerance is one standard deviation of a Gaussian prior with mean zero. Zero means that the drawing is exact; the
deviation is then no parameter.

The law of frequency that a joint follows is such a deviation too; the drawing's joint is constant.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from analysis.dof import Direction, Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import Real
from analysis.inverse.frequency_law import FrequencyLaw
from analysis.inverse.frequency_laws import LAW_PARAMETERS, PRIORS, zener_like

COMMON = ("gain", "Young's modulus", "density", "sensor position")
"""Deviations of the bench as a whole; position and law of each joint, position and lean of each row's blows follow."""
OF_JOINT = 1 + len(LAW_PARAMETERS)
"""Number of deviations of each joint."""
MODULUS, DENSITY = COMMON.index("Young's modulus"), COMMON.index("density")
SENSOR = COMMON.index("sensor position")
FREEHAND_LEAN = np.radians(2.0)
"""Tolerance of the mean lean of the blows at a point for a hand-held hammer, rad. Accelerances determine the lean to
about 0.2 degrees; with a tolerance of 0.3 degrees intervals are the same."""


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
        joint_law: that every joint follows, with parameters of its own; its priors are `frequency_laws.PRIORS`.
        material_correlation: between the deviations of Young's modulus and density, from a test of the suspended beam.
    """

    sensor_gain: float = 0.0
    youngs_modulus: float = 0.0
    density: float = 0.0
    sensor_position: float = 0.0
    joint_position: float = 0.0
    blow_position: float = 0.0
    inclination: float = 0.0
    joint_law: FrequencyLaw = FrequencyLaw.CONSTANT
    material_correlation: float = 0.0
    blow_lean: float = 0.0

    def __post_init__(self) -> None:
        if not abs(self.material_correlation) < 1:
            raise AnalysisError(f"a correlation of {self.material_correlation}; it must lie between -1 and 1")
        for name, value in vars(self).items():
            if name not in ("material_correlation", "joint_law") and not (np.isfinite(value) and value >= 0):
                raise AnalysisError(f"the tolerance {name} is {value}; it must be zero or a positive number")

    def covariance(self, response: Dof, inputs: Sequence[Dof], joints: int) -> Real:
        """(4 + 5 joints + 2 rows, the same) covariance in the order of `Deviations`."""
        deviation = self.deviations(response, inputs, joints)
        found = np.diag(deviation**2)
        mutual = self.material_correlation * deviation[MODULUS] * deviation[DENSITY]
        found[MODULUS, DENSITY] = found[DENSITY, MODULUS] = mutual
        return found

    def deviations(self, response: Dof, inputs: Sequence[Dof], joints: int) -> Real:
        """(4 + 5 joints + 2 rows,) standard deviations in the order of `Deviations`.

        An accelerometer that measures along the beam has no position.
        """
        sensor = self.sensor_position if response.direction is Direction.Y else 0.0
        return np.array(
            [self.sensor_gain, self.youngs_modulus, self.density, sensor]
            + joints * [self.joint_position]
            + np.repeat(PRIORS[self.joint_law], joints).tolist()
            + len(inputs) * [self.blow_position]
            + len(inputs) * [self.blow_lean]
        )


EXACT = Tolerances()
"""A bench exactly as drawn."""


@dataclass(frozen=True, eq=False)
class Deviations:
    """How one bench and its measurement differ from the drawing.

    Attributes:
        values: (4 + 5 joints + 2 rows,) relative gain, Young's modulus and density; positions of the accelerometer and
            of each joint, m; each parameter of the law of each joint; positions of each row's blows, m, and their
            leans, rad.
        joints: number of joints.
    """

    values: Real
    joints: int

    @classmethod
    def none(cls, joints: int, rows: int) -> Deviations:
        """A bench as drawn."""
        return cls(np.zeros(len(COMMON) + OF_JOINT * joints + 2 * rows), joints)

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
        """Displacement of the accelerometer along the beam, m."""
        return float(self.values[3])

    @property
    def joint_positions(self) -> Real:
        """(joints,) m."""
        return self.values[len(COMMON) : len(COMMON) + self.joints]

    @property
    def joint_laws(self) -> Real:
        """(4, joints) parameters of their laws, in the order of `LAW_PARAMETERS`."""
        return self.values[law_places(self.joints)].reshape(-1, self.joints)

    def with_zener_for_power(self) -> Deviations:
        """These deviations with fractional Zener laws that rise in the middle of the band as the powers do."""
        found = Deviations(self.values.copy(), self.joints)
        found.joint_laws[:] = zener_like(self.joint_laws[0])
        return found

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
        return self.values[len(COMMON) + OF_JOINT * self.joints :]


def law_places(joints: int) -> slice:
    """Places of the laws of all joints among the deviations."""
    first = len(COMMON) + joints
    return slice(first, first + len(LAW_PARAMETERS) * joints)


def places_of_law(parameter: str, joints: int) -> range:
    """Place of one of `LAW_PARAMETERS` of each joint among the deviations."""
    first = law_places(joints).start + LAW_PARAMETERS.index(parameter) * joints
    return range(first, first + joints)


def places_of_leans(joints: int, rows: int) -> range:
    """Place of the lean of each row's blows among the deviations."""
    first = len(COMMON) + OF_JOINT * joints + rows
    return range(first, first + rows)


def deviation_labels(response: Dof, inputs: Sequence[Dof], joint_names: Sequence[str]) -> tuple[str, ...]:
    """(4 + 5 joints + 2 rows,) names of the deviations, in the order of `Deviations`."""
    gain, modulus, density, sensor = COMMON
    return (
        f"{gain} of {response}",
        modulus,
        density,
        f"{sensor} of {response}",
        *(f"position of joint {name}" for name in joint_names),
        *(f"{parameter} of joint {name}" for parameter in LAW_PARAMETERS for name in joint_names),
        *(f"blow position of {point}" for point in inputs),
        *(f"lean of the blows at {point}" for point in inputs),
    )
