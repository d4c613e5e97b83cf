"""Shifts of frequency by temperature and their derivatives."""

import numpy as np
import pytest

from analysis.direct.shift_law import ShiftLaw
from analysis.direct.time_temperature import Shift
from analysis.errors import AnalysisError

TEMPERATURE = np.array([-10.0, 5.0, 23.0, 60.0])


@pytest.mark.parametrize("law", list(ShiftLaw))
def test_slopes_are_those_of_the_shift(law: ShiftLaw) -> None:
    shift = Shift(law, reference=23.0, coldest=-10.0)
    logarithms = np.log([median for median, _ in shift.priors]) + 0.1
    found, slopes = shift.at(logarithms, TEMPERATURE)
    assert found[2] == 0
    assert np.all(np.diff(found) < 0)  # warmer is slower
    for column in range(len(logarithms)):
        step = np.zeros(len(logarithms))
        step[column] = 1e-6
        up, down = (shift.at(logarithms + sign * step, TEMPERATURE)[0] for sign in (1, -1))
        assert slopes[:, column] == pytest.approx((up - down) / 2e-6, abs=1e-6)


def test_universal_constants_give_the_known_shift() -> None:
    shift = Shift(ShiftLaw.WLF, reference=0.0, coldest=0.0, constants=(17.44, 51.6))
    found, _ = shift.at(np.empty(0), np.array([50.0]))
    assert found[0] / np.log(10) == pytest.approx(-17.44 * 50 / 101.6)


def test_wlf_does_not_go_below_where_it_ends() -> None:
    with pytest.raises(AnalysisError, match="measure colder, or take Arrhenius"):
        Shift(ShiftLaw.WLF, reference=23.0, coldest=-40.0, constants=(9.0, 50.0))
    with pytest.raises(AnalysisError, match="both positive"):
        Shift(ShiftLaw.WLF, reference=23.0, coldest=0.0, constants=(-9.0, 50.0))


@pytest.mark.parametrize("constants", [(np.inf, 100.0), (9.0, np.inf), (9.0, np.nan), (np.nan, 100.0)])
def test_constants_that_are_no_numbers_are_refused(constants: tuple[float, float]) -> None:
    with pytest.raises(AnalysisError, match="both positive"):
        Shift(ShiftLaw.WLF, reference=23.0, coldest=0.0, constants=constants)


@pytest.mark.parametrize("reference", [-273.15, -300.0, np.nan, np.inf])
@pytest.mark.parametrize("law", list(ShiftLaw))
def test_a_reference_that_is_no_temperature_is_refused(law: ShiftLaw, reference: float) -> None:
    with pytest.raises(AnalysisError, match=r"the reference temperature is .* above -273.15"):
        Shift(law, reference, coldest=reference)
