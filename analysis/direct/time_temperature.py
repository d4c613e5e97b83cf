"""Time-temperature superposition: how far a temperature shifts the frequencies of an elastomer.

A thermorheologically simple elastomer at the temperature T and the frequency f behaves as at T_ref and the reduced
frequency f a_T. With d = T - T_ref,

    WLF:        ln a_T = -ln(10) C1 d / (C2 + d)     (M. L. Williams, R. F. Landel, J. D. Ferry, JACS 77, 1955),
    Arrhenius:  ln a_T = E / R (1 / T - 1 / T_ref)   (T in kelvin).

Between the glass transition and some 100 K above it WLF is the usual law; a narrow range of temperatures does not tell
the two apart. In both, every parameter is positive.
"""

from dataclasses import dataclass

import numpy as np

from analysis.direct.shift_law import ShiftLaw
from analysis.errors import AnalysisError
from analysis.frequency_response import Real

KELVIN = 273.15
GAS = 8.314462618e-3  # kJ / (mol K)


PRIORS = {
    ShiftLaw.WLF: ((9.0, 2.0), (100.0, 2.0)),
    ShiftLaw.ARRHENIUS: ((120.0, 2.0),),
}
"""Median, and the factor that is one standard deviation of the logarithm: of C1 and of C2 - (T_ref - T_coldest) in K;
of E in kJ/mol. With the universal constants of WLF, 50 K above the glass transition C1 is 8.9 and C2 is 102 K."""


@dataclass(frozen=True)
class Shift:
    """A law of the shift, without its free parameters.

    Attributes:
        law: its form.
        reference: T_ref, degrees Celsius.
        coldest: least temperature that the law has to reach, degrees Celsius. C2 is larger than T_ref less this one.
        constants: C1 and C2 in K at T_ref, where WLF is not fitted but given; else None.

    Raises:
        AnalysisError: the reference is no temperature, or the constants are not of a WLF that reaches the coldest.
    """

    law: ShiftLaw
    reference: float
    coldest: float
    constants: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if not -KELVIN < self.reference < np.inf:
            raise AnalysisError(
                f"the reference temperature is {self.reference} degrees Celsius; it must be above -{KELVIN}"
            )
        if self.constants is None:
            return
        if self.law is not ShiftLaw.WLF or not all(0 < each < np.inf for each in self.constants):
            raise AnalysisError("given constants are C1 and C2 of WLF, both positive")
        self._check(self.constants[1], self.coldest)

    @property
    def priors(self) -> tuple[tuple[float, float], ...]:
        """Median and factor of each free parameter; empty where the constants are given."""
        return () if self.constants else PRIORS[self.law]

    @property
    def names(self) -> tuple[str, ...]:
        """Of the free parameters, as `values` gives them."""
        return () if self.constants else {ShiftLaw.WLF: ("C1", "C2"), ShiftLaw.ARRHENIUS: ("E",)}[self.law]

    def values(self, logarithms: Real) -> Real:
        """C1 and C2 in K, or E in kJ/mol, from the (parameters,) logarithms that are fitted."""
        if self.constants:
            return np.array(self.constants)
        values = np.exp(logarithms)
        if self.law is ShiftLaw.WLF:
            values[1] += max(self.reference - self.coldest, 0.0)
        return np.asarray(values)

    def at(self, logarithms: Real, temperature: Real) -> tuple[Real, Real]:
        """The shift and its derivatives.

        Args:
            logarithms: (parameters,) fitted.
            temperature: (points,) degrees Celsius.

        Returns:
            (points,) ln a_T, and (points, parameters) its derivatives by the logarithms.

        Raises:
            AnalysisError: WLF does not reach as low as a temperature.
        """
        if self.law is ShiftLaw.ARRHENIUS:
            shift = self.values(logarithms)[0] / GAS * (1 / (temperature + KELVIN) - 1 / (self.reference + KELVIN))
            return shift, shift[:, None]
        c1, c2 = self.values(logarithms)
        self._check(float(c2), float(np.min(temperature)))
        warmer = temperature - self.reference
        shift = -np.log(10) * c1 * warmer / (c2 + warmer)
        if self.constants:
            return shift, np.empty((len(shift), 0))
        return shift, np.stack([shift, -shift / (c2 + warmer) * np.exp(logarithms[1])], axis=1)

    def _check(self, c2: float, coldest: float) -> None:
        if not c2 + coldest - self.reference > 0:
            raise AnalysisError(
                f"WLF with C2 = {c2:.3g} K at {self.reference:g} degrees Celsius ends above {coldest:g}: no stiffness "
                "there; measure colder, or take Arrhenius"
            )
