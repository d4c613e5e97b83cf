"""Values of a curve under equal properties, as the matrices of a structure are solved for one set at a time."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.gap.structures.effect import Properties


@dataclass(frozen=True, eq=False)
class EqualValues:
    """Some values of a curve.

    Attributes:
        places: (m,) indices of these values.
        properties: theirs; numbers, or (m,) for those that may differ within a group.
    """

    places: NDArray[np.intp]
    properties: Properties


def equal_values(properties: Properties, count: int, may_differ: frozenset[str] = frozenset()) -> list[EqualValues]:
    """The values of a curve in groups of equal properties.

    Args:
        properties: numbers or (count,) each; `attached` is a tuple of parts whose fields are the same.
        count: of values.
        may_differ: names of properties, and of fields of attached parts, that do not divide groups.

    Raises:
        ValueError: a property has another number of values.
    """
    own = [{each.name: getattr(part, each.name) for each in fields(part)} for part in properties["attached"]]
    plain = {name: each for name, each in properties.items() if name != "attached"}
    dividing = [
        np.broadcast_to(each, (count,))
        for group in (plain, *own)
        for name, each in group.items()
        if np.ndim(each) and name not in may_differ
    ]
    groups = [np.arange(count)]
    if dividing:
        _, of = np.unique(np.stack(dividing), axis=1, return_inverse=True)
        order = np.argsort(of.ravel(), kind="stable")
        groups = np.split(order, np.flatnonzero(np.diff(of.ravel()[order])) + 1)

    def taken(given: Mapping[str, Any], places: NDArray[np.intp]) -> dict[str, Any]:
        found = dict(given)
        for name, each in given.items():
            if np.ndim(each):
                there = np.broadcast_to(each, (count,))[places]
                found[name] = there if name in may_differ else there[0].item()
        return found

    return [
        EqualValues(
            places,
            {
                **taken(plain, places),
                "attached": tuple(
                    replace(part, **taken(each, places)) for part, each in zip(properties["attached"], own, strict=True)
                ),
            },
        )
        for places in groups
    ]
