"""The effects of the catalogue by laws that are drawn from spaces of functions, so that no law of a diagnosis is exact.

Effects without rival laws, such as a position or a modulus, are those of `simlab.case.effects`.
"""

from simlab.case.effects import CATALOGUE, NOVELTIES, SimulatedEffect, effects_by_name
from simlab.case.random_laws import chain, joints, outside, structure, tester

RANDOM_LAWS: dict[str, type[SimulatedEffect]] = CATALOGUE | effects_by_name(joints, structure, chain, tester)
OUTSIDE: dict[str, type[SimulatedEffect]] = NOVELTIES | effects_by_name(outside)

__all__ = ["OUTSIDE", "RANDOM_LAWS"]
