"""The catalogue of effects for tables."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

from analysis.dof import Dof
from analysis.gap.catalogue import laws
from analysis.gap.measurement import Configuration, HammerSet, Measurement, TesterPoints
from analysis.gap.parameter import Parameter
from jointlab.diagnosis.load import drawing_of
from store.exchange.bundle_setup import Article

LEVELS = (100.0, 400.0)
AMPLITUDES_PP_MM = (0.01, 0.05, 0.1)


@dataclass(frozen=True)
class CatalogueEntry:
    """One law of one effect.

    Attributes:
        effect: id.
        title, law: in words.
        parameters: with their priors.
    """

    effect: str
    title: str
    law: str
    parameters: tuple[Parameter, ...]


def entries(measurement: Measurement) -> Iterator[CatalogueEntry]:
    """Every law of every effect for a measurement; of laws with a variant for each joint or row, the first.

    A law that this measurement could not show has no parameters.
    """
    for law in laws():
        variants = law.variants(measurement)
        yield CatalogueEntry(law.id, law.title, law.law, variants[0].parameters if variants else ())


def blank_measurement(article: Article, struck: tuple[Dof, ...]) -> Measurement:
    """Both experiments on an article without data: enough to list the effects that could be diagnosed.

    Args:
        article: as drawn.
        struck: points of each hammer set.
    """
    rows = (len(struck), 1)
    sets = [HammerSet(struck, np.ones(1), np.ones(rows, dtype=complex), np.ones(rows), level) for level in LEVELS]
    count = len(AMPLITUDES_PP_MM)
    points = TesterPoints(
        order=np.arange(count, dtype=float),
        specimen=np.zeros(count, dtype=np.intp),
        configuration=np.full(count, Configuration.SHEAR, dtype=np.intp),
        amplitude=0.5e-3 * np.array(AMPLITUDES_PP_MM),
        frequency=np.full(count, 100.0),
        stiffness=np.ones(count, dtype=complex),
        deviation=np.ones(count),
        temperature=np.full(count, 23.0),
    )
    return Measurement(drawing_of(article), tuple(sets), points)


@cache
def _titles() -> dict[str, str]:
    return {law.id: law.title for law in laws()}


def title_of(effect: str) -> str:
    """The title of an effect; its id in words where the catalogue does not have it."""
    return _titles().get(effect, effect.replace("_", " "))


def range_of(parameter: Parameter) -> tuple[float, float]:
    """The range that holds nineteen of twenty values of a parameter."""
    low, high = (parameter.value(score) for score in (-2.0, 2.0))
    return max(low, parameter.least), high
