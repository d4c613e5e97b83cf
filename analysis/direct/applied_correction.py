"""The record of a correction that a result carries: what was applied, with which value and error."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class AppliedCorrection:
    """One parameter of one correction.

    Attributes:
        effect: what was corrected for, such as "frame_compliance".
        parameter: its symbol, such as "c".
        value: in `unit`.
        standard_error: in `unit`; part of the result's covariance.
        unit: SI.
    """

    effect: str
    parameter: str
    value: float
    standard_error: float
    unit: str

    @property
    def text(self) -> str:
        """One line for a report."""
        return f"{self.effect}: {self.parameter} = {self.value:.4g} +- {self.standard_error:.2g} {self.unit}"
