"""A gap that only parameters of the simulation itself take up, far from their priors."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.frequency_response import Complex, Real
from analysis.gap.evidence.verdict import Status
from analysis.gap.parameter import Parameter
from analysis.gap.structures.diagnosis import diagnose_curves
from tests.analysis.gap.structures.warm_spring import measured, simulator, still, warm

KNOWN = (Parameter("k", "N/m", 1.04e5, 0.01, positive=True), Parameter("loss", "1", 0.12, 0.01, positive=True))


def stiffer(share: float) -> tuple[float, ...]:
    found = diagnose_curves(replace(simulator(), parameters=KNOWN), measured(lambda *at: still(*at) * (1 + share)))
    assert found.effects == ()
    assert found.status is (Status.UNKNOWN if share > 0.05 else Status.NONE)
    return tuple(each.deviations for each in found.pulls)


def test_a_simulation_that_is_far_outside_of_its_own_tolerance_is_not_called_sound() -> None:
    (pull,) = stiffer(0.15)
    assert pull == pytest.approx(np.log(1.15) / 0.01, abs=0.3)


def test_a_parameter_is_told_beyond_three_standard_deviations() -> None:
    assert stiffer(0.02) == ()
    (pull,) = stiffer(0.04)
    assert pull == pytest.approx(3.9, abs=0.2)


def test_an_effect_does_not_explain_what_a_parameter_far_off_takes_up() -> None:
    def warm_and_stiff(frequency: Real, temperature: float) -> Complex:
        return warm(frequency, temperature) * 1.15

    found = diagnose_curves(replace(simulator(), parameters=KNOWN), measured(warm_and_stiff))
    assert (found.status, found.effects) == (Status.PARTIAL, ("warmth",))
    (pull,) = found.pulls
    assert (pull.parameter, pull.part, pull.unit, pull.centre) == ("k", None, "N/m", 1.04e5)
    assert pull.value == pytest.approx(1.15 * 1.04e5, rel=1e-3)
    assert pull.implausible


def test_a_parameter_of_one_part_is_told_with_its_part() -> None:
    local = (Parameter("gain", "1", 1.0, 0.01),)
    curves = measured(lambda frequency, temperature: still(frequency, temperature) * (1.2 if temperature == 25 else 1))
    base = simulator()
    gained = replace(base, parameters=KNOWN, local=local, function=lambda p, c: p["gain"] * base.function(p, c))
    found = diagnose_curves(gained, curves)
    assert found.status is Status.UNKNOWN
    assert (found.pulls[0].parameter, found.pulls[0].part) == ("gain", "25 degC")
