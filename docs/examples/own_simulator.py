"""A simulator of one's own: the natural frequency of a mass on a spring, as a Python function.

The function gets parameters and conditions by name, and gives a reading for each value of a curve.
"""

import numpy as np

from analysis.gap.effect import Mechanism
from analysis.gap.parameter import Parameter
from analysis.gap.structures.callable_simulator import CallableSimulator
from analysis.gap.structures.effect import StructureEffect


def natural_frequency(parameters, conditions):
    """Hz, of a mass that is stated for each value."""
    return np.sqrt(parameters["spring"] / (conditions["mass"] + parameters["own_mass"])) / (2 * np.pi)


class Warmth(StructureEffect):
    """The spring softens by a share for each kelvin above 20 degC."""

    id = "warm_spring"
    title = "the spring softens with temperature"
    mechanism = Mechanism.JOINT_STATE
    needs = frozenset({"temperature"})
    own_parameters = (Parameter("per_kelvin", "1/K", 0.0, 0.005),)

    def properties(self, given, properties, conditions):
        """Stiffness at the temperature of each value."""
        factor = 1 - given["per_kelvin"] * (conditions["temperature"] - 20.0)
        return {**properties, "spring": properties["spring"] * factor}


pendulum = CallableSimulator(
    natural_frequency,
    parameters=(
        Parameter("spring", "N/m", centre=1000.0, spread=0.05, positive=True),  # known to 5 %
        Parameter("own_mass", "kg", centre=0.1, spread=0.02),
    ),
    candidates=(Warmth(),),
    name="mass on a spring",
)
