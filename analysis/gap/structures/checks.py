"""Checks of simulators and effects that others wrote, before a diagnosis begins: errors name what they are in."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from numbers import Real
from typing import Any

from analysis.errors import AnalysisError
from analysis.gap.effect import Mechanism
from analysis.gap.parameter import Parameter
from analysis.gap.structures.curve import Curve
from analysis.gap.structures.effect import StructureEffect
from analysis.gap.structures.likelihood import FARTHEST
from analysis.gap.structures.search import Failure
from analysis.gap.structures.simulator import Simulator

MOST_SPREAD = 20.0
"""Largest spread of a positive parameter: within `FARTHEST` of it, its values are still numbers."""


def check_simulator(simulator: Simulator) -> None:
    """Check name and parameters.

    Raises:
        AnalysisError: one cannot be read or is of another kind, or two parameters have one name.
    """
    name = _given(simulator, "name", "the simulator")
    if not isinstance(name, str):
        raise AnalysisError(f"the name of a simulator is {name!r}; give it a text")
    who = f"simulator {name}"
    shared, local = (_given(simulator, each, who) for each in ("parameters", "local"))
    _check_parameters((*_parameters(shared, who), *_parameters(local, who)), who)


def effects_offered_by(simulator: Simulator, curves: Sequence[Curve]) -> tuple[StructureEffect, ...]:
    """Candidates that a simulator brings.

    Raises:
        AnalysisError: it fails to give them, or gives something else, with its name and the error.
    """
    who = f"simulator {simulator.name}"
    try:
        found = tuple(simulator.effects(curves))
    except AnalysisError:
        raise
    except Exception as error:  # code of users may raise anything
        raise AnalysisError(f"the effects of {who} fail: {type(error).__name__}: {error}") from error
    for each in found:
        if not isinstance(each, StructureEffect):
            hint = f"; make an object of it: {each.__name__}()" if isinstance(each, type) else ""
            raise AnalysisError(f"{who} offers {each!r}, which is no StructureEffect{hint}")
    return found


def check_declared(effect: StructureEffect, name: str) -> None:
    """Check what an effect says about itself, but for its parameters.

    Raises:
        AnalysisError: something is missing or of another kind; it begins with the `name` by which the user knows it.
    """
    who = f"the effect {name}"
    for attribute in ("id", "title", "law"):
        if not isinstance(given := _given(effect, attribute, who), str):
            raise AnalysisError(f"{who}: {attribute} is {given!r}; it is to be a text")
    if not isinstance(mechanism := _given(effect, "mechanism", who), Mechanism):
        raise AnalysisError(f"{who}: mechanism is {mechanism!r}; it is to be an analysis.gap.effect.Mechanism")
    needs = _given(effect, "needs", who)
    if not isinstance(needs, (set, frozenset)) or not all(isinstance(each, str) for each in needs):
        raise AnalysisError(f"{who}: needs is {needs!r}; it is to be a set of names of conditions, such as {{'force'}}")


def known_ids(effects: Sequence[StructureEffect], failed: Sequence[Failure] = ()) -> list[str]:
    """Names by which candidates can be left out, sorted: ids of effects, and the names in `Failure.effect`."""
    ids = [_id_of(each) for each in effects]
    return sorted({*(each for each in ids if each is not None), *(each.effect for each in failed)})


def usable(
    effects: Sequence[StructureEffect], without: frozenset[str] = frozenset()
) -> tuple[tuple[StructureEffect, ...], list[Failure]]:
    """Effects that are as the protocol says, each id and law of one class only; and the failures of all others.

    Nothing is said of effects whose ids are among `without`.
    """
    first, kept, failures = dict[tuple[str, str], type[StructureEffect]](), list[StructureEffect](), list[Failure]()
    for each in effects:
        if _id_of(each) in without:
            continue
        own = type(each)
        try:
            check_declared(each, own.__qualname__)
            who = f"the effect {each.id}"
            _check_fields(each, who)
            parameters = _parameters(_given(each, "parameters", who), who)
            if not parameters:
                raise AnalysisError(f"{who} has no parameters, so nothing of it can be found")
            _check_parameters(parameters, who)
        except AnalysisError as error:
            failures.append(Failure(_label(each), str(error)))
            continue
        other = first.setdefault((each.id, each.law), own)
        if other is own:
            kept.append(each)
        else:
            where = f"{other.__module__}.{other.__qualname__} and {own.__module__}.{own.__qualname__}"
            failures.append(Failure(_label(each), f"the name is used twice, by {where}; rename one"))
    return tuple(kept), failures


def _id_of(effect: StructureEffect) -> str | None:
    try:
        return str(effect.id)
    except Exception:  # noqa: BLE001 - code of users may raise anything; its failure is reported by `_given`
        return None


def _label(effect: StructureEffect) -> str:
    """Id and law, or the name of the class where it has no id."""
    try:
        return f"{effect.id} ({effect.law})"
    except Exception:  # noqa: BLE001 - code of users may raise anything; its failure is reported by `_given`
        return _id_of(effect) or type(effect).__qualname__


def _given(owner: Any, attribute: str, who: str) -> Any:
    try:
        return getattr(owner, attribute)
    except AttributeError as error:
        raise AnalysisError(f"{who} has no {attribute}: {error}") from error
    except Exception as error:  # code of users may raise anything
        raise AnalysisError(f"{attribute} of {who} fails: {type(error).__name__}: {error}") from error


def _parameters(given: Any, who: str) -> tuple[Parameter, ...]:
    try:
        found = tuple(given)
    except TypeError as error:
        raise AnalysisError(f"the parameters of {who} are {given!r}; they are to be a tuple of Parameters") from error
    for each in found:
        if not isinstance(each, Parameter):
            raise AnalysisError(f"a parameter of {who} is {each!r}, not an analysis.gap.parameter.Parameter")
    return found


def _check_fields(effect: StructureEffect, who: str) -> None:
    """The search tells effects apart by their fields, which a list or an array does not allow."""
    try:
        hash(effect)
    except TypeError as error:
        raise AnalysisError(f"{who}: its fields cannot tell it from others: {error}; make them tuples") from error


def _check_parameters(found: Sequence[Parameter], who: str) -> None:
    """Check each prior; two of one name would get one value, and the other prior would count nothing."""
    for each in found:
        _check_prior(each, f"parameter {each.name!r} of {who}")
    names = [each.name for each in found]
    twice = next((each for each in names if names.count(each) > 1), None)
    if twice is not None:
        raise AnalysisError(f"{who} has two parameters called {twice!r}; rename one")


def _check_prior(own: Parameter, what: str) -> None:
    """Check that the names are texts, and that a search can begin at the centre and at every start."""
    if not isinstance(own.name, str) or not isinstance(own.unit, str):
        raise AnalysisError(f"{what}: name and unit are {own.name!r} and {own.unit!r}; they are to be texts")
    for name in ("centre", "spread"):
        if not _is_number(given := getattr(own, name)) or not isfinite(given):
            raise AnalysisError(f"{what}: {name} is {given!r}; it is to be a finite number")
    if not _is_number(own.least) or own.least > own.centre:
        raise AnalysisError(f"{what}: least is {own.least!r}; it is to be a number up to the centre, {own.centre!r}")
    if own.spread < 0:
        raise AnalysisError(f"{what}: spread is {own.spread!r}; a standard deviation is not below zero")
    if own.positive and own.centre <= 0:
        raise AnalysisError(f"{what}: centre is {own.centre!r}; one that is positive has a centre above zero")
    if own.positive and own.spread > MOST_SPREAD:
        raise AnalysisError(
            f"{what}: spread is {own.spread!r}; it is of the natural logarithm where positive, {MOST_SPREAD:g} at most"
        )
    starts = own.starts
    if not isinstance(starts, (tuple, list)) or not starts or not all(map(_is_number, starts)):
        raise AnalysisError(f"{what}: starts is {starts!r}; it is to be a tuple of scores, such as (0.0,)")
    if not all(abs(each) <= FARTHEST and own.value(each) >= own.least for each in starts):
        raise AnalysisError(f"{what}: starts is {starts!r}; a start lies below least, or beyond {FARTHEST:g} spreads")


def _is_number(given: Any) -> bool:
    return isinstance(given, Real) and not isinstance(given, bool)
