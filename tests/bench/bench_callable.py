"""A black box with six parameters and three effects: how often is the effect of a drawn case named, and how fast?

The black box is two masses on springs with dampers; cases are drawn as `jointlab gap trial --model` draws them, with
inexact laws and smooth errors, and the diagnosis sees curves alone.
"""

from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

from analysis.frequency_response import Complex
from analysis.gap.effect import Given, Mechanism
from analysis.gap.parameter import Parameter
from analysis.gap.structures.callable_simulator import CallableSimulator
from analysis.gap.structures.chain_effects import Delay
from analysis.gap.structures.curve import Conditions, Curve
from analysis.gap.structures.effect import Properties, StructureEffect
from analysis.gap.structures.likelihood import CurveLikelihood
from jointlab.structures.trial import STRONG, trial_document, try_cases

CASES = 100
NOISE = 0.01
"""Of a reading, over the rms of its curve."""


class Warmth(StructureEffect):
    """The upper spring softens with temperature."""

    id, title, mechanism = "warmth", "softer when warm", Mechanism.JOINT_STATE
    needs = frozenset({"temperature"})
    own_parameters = (Parameter("per_kelvin", "1/K", 0.0, 0.005),)

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        """Exactly as stated where the law of a case is exact."""
        factor = 1 - given["per_kelvin"] * (conditions["temperature"] - 20.0)
        return {**properties, "upper_spring": properties["upper_spring"] * factor}


class LooseLeaf(StructureEffect):
    """A leaf spring with a mass of its own on the upper mass."""

    id, title, mechanism = "loose_leaf", "a leaf that resonates on the upper mass", Mechanism.ATTACHMENT
    form_is_known = True
    own_parameters = (
        Parameter("mass", "kg", 0.0, 0.05, least=0.0, starts=(0.3, 0.3, 0.3)),
        Parameter("tuned", "Hz", 35.0, 0.3, positive=True, starts=(-1.0, 0.0, 1.0)),
    )

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        """Its dynamic mass, with a loss factor of 3 %."""
        ratio = (conditions["frequency"] / given["tuned"]) ** 2 / (1 + 0.03j)
        return {**properties, "upper_mass": properties["upper_mass"] + given["mass"] / (1 - ratio)}


def receptance(parameters: Mapping[str, Any], conditions: Conditions) -> Complex:
    """Of the upper mass."""
    s = 2j * np.pi * conditions["frequency"]
    upper = parameters["upper_spring"] + s * parameters["upper_damper"]
    lower = parameters["lower_spring"] + s * parameters["lower_damper"]
    first, second = upper + s**2 * parameters["upper_mass"], upper + lower + s**2 * parameters["lower_mass"]
    return np.asarray(second / (first * second - upper**2))


BOX = CallableSimulator(
    receptance,
    (
        *(Parameter(f"{name}_mass", "kg", 1.0, 0.02, positive=True) for name in ("upper", "lower")),
        *(Parameter(f"{name}_spring", "N/m", 4e4, 0.05, positive=True) for name in ("upper", "lower")),
        *(Parameter(f"{name}_damper", "N s/m", 8.0, 0.3, positive=True) for name in ("upper", "lower")),
    ),
    (Warmth(), LooseLeaf(), Delay()),
    name="two masses",
)


def template() -> list[Curve]:
    """Four temperatures."""
    frequency, curves = np.linspace(5.0, 80.0, 60), []
    for warm in (10.0, 20.0, 30.0, 40.0):
        conditions = {"frequency": frequency, "temperature": np.full(60, warm)}
        blank = Curve("receptance", f"{warm:g} degC", np.ones(60, dtype=complex), np.ones(60), conditions)
        likelihood = CurveLikelihood(BOX, (), (blank,))
        values = likelihood.predict(np.zeros(likelihood.unknowns), blank)
        deviation = np.full(60, NOISE * float(np.sqrt(np.mean(np.abs(values) ** 2))))
        curves.append(Curve("receptance", blank.part, values, deviation, conditions))
    return curves


def main() -> None:
    """Print the score, and what went wrong."""
    found = try_cases(BOX, template(), CASES, 2026)
    print(trial_document(found, BOX, BOX.candidates, 2026))
    right = [each.answer == ((each.truth,) if each.truth else ()) for each in found]
    print(f"right in {sum(right)} of {len(found)}; {np.median([each.seconds for each in found]):.2f} s in the median")
    weak = sum(bool(each.truth) and each.strength < STRONG for each in found)
    pairs = zip(found, right, strict=True)
    missed = [(each.truth or "none", each.answer, each.status.value) for each, ok in pairs if not ok]
    print(f"weak cases: {weak}; wrong: {dict(Counter(missed))}")


if __name__ == "__main__":
    main()
