"""The diagnosis of any structure, on simulated ones whose truth comes from formulas of this file."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.gap.diagnosis_step import DiagnosisStep, Stage
from analysis.gap.effect import Given, Mechanism
from analysis.gap.evidence.verdict import Status
from analysis.gap.parameter import Parameter
from analysis.gap.structures.callable_simulator import CallableSimulator
from analysis.gap.structures.curve import Conditions, Curve
from analysis.gap.structures.diagnosis import CurveDiagnosis, diagnose_curves
from analysis.gap.structures.effect import Properties, StructureEffect
from tests.analysis.gap.structures.warm_spring import (
    NOISE,
    Lag,
    Warmth,
    bends,
    four,
    late_and_warm,
    measured,
    simulator,
    spring,
    still,
    warm,
)


class Fails(StructureEffect):
    id, title, mechanism = "fails", "an error of its author", Mechanism.BEAM
    own_parameters = (Parameter("any", "1", 0.0, 1.0),)

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        raise ZeroDivisionError("three by nothing")


class NotFinite(Fails):
    id, title = "not_finite", "gives what is no number"

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        return {**properties, "k": np.nan}


class WrongShape(Fails):
    id, title = "wrong_shape", "gives another number of readings"

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        return properties

    def reading(self, given: Given, values: Complex, curve: Curve) -> Complex:
        return values[:-1]


class FailsFurtherOn(Warmth):
    """As warmth, but for an error halfway to where the data are."""

    id = "fails_further_on"

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        if given["per_kelvin"] > 0.003:
            raise KeyError("k of a warm spring")
        return super().properties(given, properties, conditions)


class NotFiniteFurtherOn(Warmth):
    id = "not_finite_further_on"

    def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
        found = super().properties(given, properties, conditions)
        return found if given["per_kelvin"] < 0.003 else {**found, "k": np.nan}


class NoParameters(Fails):
    id, title = "no_parameters", "cannot say what its parameters are"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        raise RuntimeError("no licence")


def test_an_effect_that_is_there_is_named_and_the_gap_of_parts_left_out_falls() -> None:
    found = diagnose_curves(simulator(), measured(warm))
    assert (found.status, found.effects) == (Status.EXPLAINED, ("warmth",))
    assert found.after < 0.2 * found.before
    estimate = found.ranking[0].parameters["warmth"]["per_kelvin"]
    assert estimate.ci90[0] < 0.006 < estimate.ci90[1]


def test_a_first_answer_after_single_effects_is_refined_before_the_last_one() -> None:
    steps = list[DiagnosisStep]()
    diagnose_curves(simulator(), measured(late_and_warm), progress=steps.append)
    stages, shares = [each.stage for each in steps], [each.share for each in steps]
    assert stages == sorted(stages, key=list(Stage).index)
    assert shares == sorted(shares)
    assert (shares[0], stages[-1], shares[-1]) == (0.0, Stage.DONE, 1.0)
    searched = stages.index(Stage.FURTHER_EFFECTS)
    assert [each.first for each in steps[:searched]] == [None] * searched
    first, refined = steps[searched].first, steps[stages.index(Stage.HELD_OUT)].first
    assert first is not None
    assert refined is not None
    assert len(first.effects) == 1
    assert set(first.effects) < set(refined.effects) == {"warmth", "lag"}
    assert 0.0 < first.explained < refined.explained


def test_two_effects_at_once_are_both_named() -> None:
    found = diagnose_curves(simulator(), measured(late_and_warm))
    assert set(found.effects) == {"warmth", "lag"}


@pytest.mark.parametrize("seed", range(5))
def test_nothing_is_named_where_only_parameters_differ(seed: int) -> None:
    found = diagnose_curves(simulator(), measured(still, seed))
    assert (found.status, found.effects) == (Status.NONE, ())


def test_a_cause_in_no_catalogue_is_unknown() -> None:
    def resonant(frequency: Real, temperature: float) -> Complex:
        return still(frequency, temperature) * (1 + 0.3 / (1 - (frequency / 52.0) ** 2 + 0.1j))

    assert diagnose_curves(simulator(), measured(resonant)).status is Status.UNKNOWN


def test_parts_that_are_held_out_are_seen_by_no_fit() -> None:
    curves = measured(warm)
    spoiled = (*curves[:3], Curve("stiffness", "30 degC", 2 * curves[3].values, curves[3].deviation,
                                  curves[3].conditions))  # fmt: skip
    found = [diagnose_curves(simulator(), each, hold_out=("30 degC",)) for each in (curves, spoiled)]
    assert found[0].ranking[0].parameters == found[1].ranking[0].parameters
    assert found[0].never_shown is not None
    assert found[0].never_shown[1] < 0.2 * found[0].never_shown[0]
    assert found[1].never_shown is not None
    assert found[1].never_shown[1] > 40.0


@pytest.mark.parametrize(
    ("bad", "said"),
    [
        (Fails(), "ZeroDivisionError: three by nothing"),
        (NotFinite(), "not finite"),
        (WrongShape(), "shape"),
        (NoParameters(), "RuntimeError: no licence"),
    ],
)
def test_an_effect_with_an_error_is_named_and_costs_nothing_but_itself(bad: StructureEffect, said: str) -> None:
    found: CurveDiagnosis = diagnose_curves(simulator(Warmth(), bad), measured(warm))
    assert found.effects == ("warmth",)
    (failure,) = found.failures
    assert bad.id in failure.effect
    assert said in failure.reason
    assert bad.id in failure.reason


@pytest.mark.parametrize("bad", [FailsFurtherOn(), NotFiniteFurtherOn()])
def test_an_effect_whose_error_shows_only_in_the_search_costs_nothing_but_itself(bad: StructureEffect) -> None:
    found = diagnose_curves(simulator(Warmth(), bad), measured(warm))
    assert (found.status, found.effects) == (Status.EXPLAINED, ("warmth",))


def test_a_law_that_predicts_no_part_that_was_left_out_gives_way_to_another_law_of_its_effect() -> None:
    class Stepwise(Warmth):
        """Fits better than the law of warmth, and knows nothing of temperatures between those that were measured."""

        law = "a step for each temperature"
        own_parameters = tuple(Parameter(f"at_{warm}", "1", 0.5, 0.3) for warm in (15, 20, 25, 30))

        def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
            factor = 1 + given[f"at_{conditions['temperature'][0]:.0f}"]
            return {**properties, "k": properties["k"] * factor}

    def uneven(frequency: Real, temperature: float) -> Complex:
        return np.asarray(warm(frequency, temperature) * (1.006 if temperature == 25 else 1.0))

    found = diagnose_curves(simulator(Warmth(), Stepwise()), measured(uneven))
    assert found.effects == ("warmth",)
    assert found.ranking[0].laws == ("the only one",)


def test_the_simulation_as_it_is_may_have_been_fitted_to_some_parts_alone() -> None:
    every, one = (
        diagnose_curves(simulator(), measured(warm), hold_out=("30 degC",), fitted_to=parts)
        for parts in ((), ("15 degC",))
    )
    assert one.effects == every.effects == ("warmth",)
    assert one.never_shown is not None
    assert every.never_shown is not None
    shift = 1 - np.exp(-0.006 * 15)  # from 15 to 30 degC
    assert one.never_shown[0] == pytest.approx(100 * shift / (1 - shift), abs=1.0)
    assert one.never_shown[0] > every.never_shown[0]
    assert one.never_shown[1] == every.never_shown[1]
    assert one.by_part["15 degC"][0] < 1.0
    with pytest.raises(AnalysisError, match="cannot be held out and fitted"):
        diagnose_curves(simulator(), measured(warm), hold_out=("30 degC",), fitted_to=("30 degC",))


def test_a_name_that_is_used_twice_is_told_with_both_places_and_costs_the_second() -> None:
    class Other(Warmth):
        pass

    found = diagnose_curves(simulator(Warmth(), Other()), measured(warm))
    assert found.effects == ("warmth",)
    (failure,) = found.failures
    assert "Warmth and" in failure.reason
    assert "Other" in failure.reason


def test_an_effect_that_cannot_predict_a_part_that_was_left_out_loses_and_the_diagnosis_goes_on() -> None:
    class OnlyWarm(Warmth):
        id = "only_warm"

        def properties(self, given: Given, properties: Properties, conditions: Conditions) -> Properties:
            if np.max(conditions["temperature"]) > 25 and given["per_kelvin"]:
                raise AnalysisError("not so warm")
            return super().properties(given, properties, conditions)

    found = diagnose_curves(simulator(OnlyWarm()), measured(warm), hold_out=("30 degC",))
    assert found.never_shown is not None
    assert found.never_shown[1] == np.inf


def test_an_effect_that_does_not_exist_cannot_be_left_out() -> None:
    with pytest.raises(AnalysisError, match="no effect is called 'warm'; there are lag, warmth"):
        diagnose_curves(simulator(), measured(warm), without=frozenset({"warm"}))


def test_a_complex_prediction_of_real_values_is_an_error_of_the_simulator() -> None:
    real = [
        Curve("stiffness", each.part, np.abs(each.values), each.deviation, each.conditions) for each in measured(still)
    ]
    with pytest.raises(AnalysisError, match="simulator callable gives complex values for stiffness of part '15 degC'"):
        diagnose_curves(simulator(), real)


@pytest.mark.parametrize("changes", [(0.2, -0.1, -0.1, 0.2), (0.05, 0.02, 0.0, 0.3)])
def test_an_effect_with_as_many_parameters_as_data_is_not_judged_and_a_plain_gap_stays_unknown(
    changes: tuple[float, ...],
) -> None:
    found = diagnose_curves(bends(4), four(*changes))
    assert (found.status, found.effects) == (Status.UNKNOWN, ())
    (failure,) = found.failures
    assert (failure.effect, "4 parameters for 4 measured values" in failure.reason) == ("bends (the only one)", True)


def test_a_gap_is_not_explained_where_most_of_it_is_left_on_data_that_were_left_out() -> None:
    found = diagnose_curves(bends(3), four(0.05, 0.02, 0.05, 0.3))
    assert found.effects == ("bends",)
    assert found.after > 0.5 * found.before
    assert found.status is Status.PARTIAL
    assert diagnose_curves(bends(3), four(0.2, -0.1, -0.1, 0.2)).status is Status.EXPLAINED


@pytest.mark.parametrize("seed", range(5))
def test_nothing_is_named_where_four_values_scatter_as_stated(seed: int) -> None:
    scatter = 1e-3 * np.random.default_rng(seed).standard_normal(4)
    found = diagnose_curves(bends(2), four(*scatter.tolist()))
    assert (found.status, found.effects) == (Status.NONE, ())


def test_too_few_values_are_refused() -> None:
    one = Curve("stiffness", "a", np.ones(1), np.ones(1), {"frequency": np.ones(1)})
    with pytest.raises(AnalysisError, match="needs 2"):
        diagnose_curves(simulator(), [one])


def test_a_part_that_does_not_exist_cannot_be_held_out() -> None:
    with pytest.raises(AnalysisError, match="no part is called '31'"):
        diagnose_curves(simulator(), measured(warm), hold_out=("31",))


@pytest.mark.parametrize("count", [3, 4, 5, 6])
def test_nothing_is_named_and_nothing_remains_where_curves_of_few_real_values_scatter_as_stated(count: int) -> None:
    def stiffness(parameters: Mapping[str, Any], conditions: Conditions) -> Complex:
        return np.asarray(parameters["k"] * np.ones(conditions["temperature"].size))

    plain = CallableSimulator(stiffness, (Parameter("k", "N/m", 1e5, 0.1, positive=True),), (Warmth(),))
    for seed in range(6):
        random, curves = np.random.default_rng([count, seed]), []
        for temperature in (15.0, 20.0, 25.0, 30.0):
            values = 1.02e5 * (1 + NOISE * random.standard_normal(count))
            conditions = {"temperature": np.full(count, temperature)}
            curves.append(
                Curve("stiffness", f"{temperature:g} degC", values, np.full(count, NOISE * 1.02e5), conditions)
            )
        found = diagnose_curves(plain, curves)
        assert (found.status, found.effects, found.remainder_significant) == (Status.NONE, (), False)


def in_kilonewtons(parameters: Mapping[str, Any], conditions: Conditions) -> Complex:
    return spring(parameters, conditions) * 1e3


def test_a_simulation_in_another_unit_names_no_cause_and_is_told_by_the_factor() -> None:
    wrong = CallableSimulator(in_kilonewtons, simulator().parameters, (Warmth(), Lag()), name="bridge")
    found = diagnose_curves(wrong, measured(warm))
    assert (found.status, found.effects, found.confounded, found.alike) == (Status.UNKNOWN, (), (), {})
    assert found.after == found.before > 1000
    (sentence,) = found.does_not_fit
    assert "stiffness fit far better when they are divided by about 0.00" in sentence


def test_a_simulation_of_something_else_does_not_fit_at_all_and_names_no_cause() -> None:
    def alternating(frequency: Real, temperature: float) -> Complex:
        return still(frequency, temperature) * np.where(np.arange(frequency.size) % 2, 1.0, -1.0)

    wrong = CallableSimulator(spring, simulator().parameters, (Warmth(), Lag()), name="bridge")
    found = diagnose_curves(wrong, measured(alternating))
    assert (found.status, found.effects, found.confounded, found.alike) == (Status.UNKNOWN, (), (), {})
    (sentence,) = found.does_not_fit
    assert "Simulator bridge does not fit at all" in sentence
    assert "check units" in sentence
    assert diagnose_curves(simulator(), measured(warm)).does_not_fit == ()


def test_noise_that_is_larger_than_the_values_is_no_model_that_does_not_fit() -> None:
    random, conditions = np.random.default_rng(5), {"frequency": np.linspace(10.0, 100.0, 15)}
    curves = [
        Curve("stiffness", str(part), 1e7 * random.standard_normal(15), np.full(15, 1e7), conditions)
        for part in range(4)
    ]
    lossless = CallableSimulator(lambda p, c: np.real(spring({**p, "loss": 0.0}, c)), simulator().parameters[:1], ())
    found = diagnose_curves(lossless, curves)
    assert (found.status, found.does_not_fit) == (Status.NONE, ())
    assert found.before > 90


def test_a_prediction_too_large_to_be_squared_is_told_with_the_simulator_and_what_to_check() -> None:
    far = CallableSimulator(lambda p, c: spring(p, c) * 1e200, simulator().parameters, (Warmth(),), name="bridge")
    with pytest.raises(AnalysisError, match=r"simulator bridge is infinitely far from .* check the units"):
        diagnose_curves(far, measured(warm))


def test_a_function_that_gives_text_is_told_with_its_name() -> None:
    text = CallableSimulator(lambda p, c: ["1.0"] * 15, simulator().parameters, (), name="bridge")  # type: ignore[arg-type,return-value]  # wrong, to be refused
    with pytest.raises(AnalysisError, match="simulator bridge gives values of type <U3 for stiffness"):
        diagnose_curves(text, measured(warm))
