"""Simulators and effects with mistakes of their authors: each is told with its name, before anything is computed."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex
from analysis.gap.effect import Mechanism
from analysis.gap.parameter import Parameter
from analysis.gap.structures.callable_simulator import CallableSimulator
from analysis.gap.structures.checks import check_simulator, effects_offered_by, usable
from analysis.gap.structures.curve import Conditions, Curve
from analysis.gap.structures.diagnosis import diagnose_curves
from analysis.gap.structures.effect import StructureEffect

K = Parameter("k", "N/m", 1e5, 0.1, positive=True)

WRONG_CENTRE: dict[str, Any] = {"centre": "1000"}
WRONG_NAME: dict[str, Any] = {"name": 3}


class Heavy(StructureEffect):
    id, title, mechanism = "heavy", "a mass more", Mechanism.ATTACHMENT
    own_parameters: ClassVar[tuple[Parameter, ...]] = (Parameter("mass", "kg", 0.0, 1.0),)


class OneCondition(Heavy):
    """As if `needs` were one name."""

    id, needs = "one_condition", "load"  # type: ignore[assignment]  # wrong, to be refused


class TwoOfOneName(Heavy):
    id = "two_of_one_name"
    own_parameters = (Parameter("mass", "kg", 0.0, 1.0), Parameter("mass", "kg", 1.0, 0.1))


class NoTitle(StructureEffect):
    id, mechanism = "no_title", Mechanism.ATTACHMENT


class MechanismOfItsOwn(Heavy):
    id, mechanism = "mechanism_of_its_own", "rust"  # type: ignore[assignment]  # wrong, to be refused


class NumbersForParameters(Heavy):
    id, own_parameters = "numbers_for_parameters", (1.0,)  # type: ignore[assignment]  # wrong, to be refused


class NoList(Heavy):
    id, own_parameters = "no_list", None  # type: ignore[assignment]  # wrong, to be refused


class NoId(StructureEffect):
    title, mechanism = "no id", Mechanism.ATTACHMENT


class ListForId(Heavy):
    id = ["a"]  # type: ignore[assignment]  # noqa: RUF012  # wrong, to be refused


@dataclass(frozen=True)
class ListForField(Heavy):
    id: ClassVar[str] = "list_for_field"
    table: Any = field(default_factory=list)


class OneStart(Heavy):
    id = "one_start"
    own_parameters = (Parameter("mass", "kg", 0.0, 1.0, starts=1.0),)  # type: ignore[arg-type]  # wrong, to be refused


class NoStart(Heavy):
    id = "no_start"
    own_parameters = (Parameter("mass", "kg", 0.0, 1.0, starts=()),)


class ImpossibleStart(Heavy):
    id = "impossible_start"
    own_parameters = (Parameter("mass", "kg", 0.0, 1.0, least=0.0, starts=(-0.5,)),)


class NoParameters(Heavy):
    id, own_parameters = "no_parameters", ()


def constant(parameters: Mapping[str, Any], conditions: Conditions) -> Complex:
    return np.asarray(parameters["k"] * np.ones(conditions["mass"].size))


def simulator(**changes: Any) -> CallableSimulator:
    whole = CallableSimulator(constant, (K,), (Heavy(),), name="shed")
    return replace(whole, **changes)


def fails(curves: object) -> tuple[StructureEffect, ...]:
    raise OSError("no licence")


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"name": 5}, "the name of a simulator is 5"),
        ({"parameters": ("k",)}, "a parameter of simulator shed is 'k', not an analysis.gap.parameter.Parameter"),
        ({"parameters": 3}, "the parameters of simulator shed are 3"),
        ({"parameters": (K, K)}, "simulator shed has two parameters called 'k'; rename one"),
        ({"local": (K,)}, "simulator shed has two parameters called 'k'; rename one"),
        ({"parameters": (replace(K, centre=np.nan),)}, "parameter 'k' of simulator shed: centre is nan; .* finite"),
        ({"parameters": (replace(K, **WRONG_CENTRE),)}, "parameter 'k' of simulator shed: centre is '1000'"),
        ({"parameters": (replace(K, spread=np.inf),)}, "spread is inf"),
        ({"parameters": (replace(K, spread=-0.1),)}, "spread is -0.1; a standard deviation is not below zero"),
        ({"parameters": (replace(K, centre=0.0),)}, "centre is 0.0; one that is positive has a centre above zero"),
        ({"parameters": (replace(K, spread=1000.0),)}, "of the natural logarithm where positive"),
        ({"parameters": (replace(K, least=2e5),)}, "least is 200000.0; it is to be a number up to the centre"),
        ({"local": (replace(K, **WRONG_NAME),)}, "name and unit are 3 and 'N/m'"),
    ],
)
def test_a_simulator_with_a_mistake_in_what_it_declares_is_told_with_its_name(
    changes: dict[str, Any], said: str
) -> None:
    with pytest.raises(AnalysisError, match=said):
        check_simulator(simulator(**changes))


@pytest.mark.parametrize(
    ("effects", "said"),
    [
        (fails, "the effects of simulator shed fail: OSError: no licence"),
        (lambda curves: None, "the effects of simulator shed fail: TypeError"),
        (lambda curves: (Heavy,), r"simulator shed offers .*Heavy.*, which is no StructureEffect; .*: Heavy\(\)"),
        (lambda curves: ("heavy",), "simulator shed offers 'heavy', which is no StructureEffect"),
    ],
)
def test_a_simulator_that_gives_no_effects_is_told_with_its_name_and_the_error(
    effects: Callable[..., Any], said: str
) -> None:
    with pytest.raises(AnalysisError, match=said):
        effects_offered_by(SimpleNamespace(name="shed", effects=effects), ())


def test_a_mistake_of_a_simulator_is_told_before_the_diagnosis() -> None:
    curve = Curve("stiffness", "a", np.ones(4), np.ones(4), {"mass": np.ones(4)})
    with pytest.raises(AnalysisError, match="two parameters called 'k'"):
        diagnose_curves(simulator(parameters=(K, K)), [curve])
    with pytest.raises(AnalysisError, match="which is no StructureEffect"):
        diagnose_curves(simulator(candidates=(Heavy,)), [curve])


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        (OneCondition(), "needs is 'load'; it is to be a set of names of conditions"),
        (TwoOfOneName(), "two parameters called 'mass'"),
        (NoTitle(), "no title"),
        (MechanismOfItsOwn(), "mechanism is 'rust'"),
        (NumbersForParameters(), "is 1.0, not an analysis.gap.parameter.Parameter"),
        (NoList(), "are None"),
        (NoId(), "has no id"),
        (ListForId(), "id is ['a']; it is to be a text"),
        (ListForField(), "its fields cannot tell it from others: unhashable type: 'list'; make them tuples"),
        (ListForField(np.ones(2)), "unhashable type: 'numpy.ndarray'"),
        (OneStart(), "parameter 'mass' of the effect one_start: starts is 1.0; it is to be a tuple of scores"),
        (NoStart(), "starts is ()"),
        (ImpossibleStart(), "a start lies below least"),
        (NoParameters(), "has no parameters"),
    ],
)
def test_an_effect_with_a_mistake_in_what_it_declares_costs_itself_alone_and_is_named(
    bad: StructureEffect, said: str
) -> None:
    kept, (failure,) = usable((bad, Heavy()))
    assert [each.id for each in kept] == ["heavy"]
    assert str(getattr(bad, "id", "NoId")) in failure.effect
    assert said in failure.reason


def test_nothing_is_said_of_a_mistake_in_an_effect_that_is_left_out() -> None:
    assert usable((OneCondition(), Heavy()), frozenset({"one_condition"})) == ((Heavy(),), [])
