"""Figures that theory does not give: how inexact laws are, and how often a cause is in no catalogue."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Calibration:
    """How inexact laws are, and how often a cause is in no catalogue.

    Only `parameter_error` was set by sealed trials, on benches that follow other laws. The other figures are older, and
    a fit of them to such trials was no better (docs/gap_trials.md).

    Attributes:
        form_error: largest rms share of its effect that a law of the right kind leaves.
        least_form_error: least such share, as no law is exact; sizes in laws of known form are uncertain by this share.
        known_form_error: largest such share for effects of known form, such as a mass or a delay; their least is zero.
        parameter_error: relative standard deviation of a size in a law whose form is not known; of 51 sizes in trials
            with random laws, 90 % needed 0.023 or less.
        patterns: number of independent patterns in the misfit that a law leaves.
        further: largest share of the previous misfit that remains after a further effect which counts as real; an
            effect that leaves more only takes up errors of the other laws.
        counts: prior probability of each number of effects, from none to the most that are searched for.
        outside_share: share of the misfit that an effect of the best explanation leaves (geometric mean) at which it is
            even odds that the cause is in no catalogue.
        local_share: prior probability that a single cause is a change at one place of the beam.
        outside_slope: change of the log odds of a cause in no catalogue when the share that is left grows tenfold.
    """

    form_error: float = 0.07
    least_form_error: float = 0.01
    known_form_error: float = 0.022
    parameter_error: float = 0.02
    patterns: float = 10.0
    further: float = 0.02
    counts: tuple[float, ...] = (0.25, 0.45, 0.18, 0.08, 0.03, 0.01)
    outside_share: float = 0.35
    local_share: float = 0.1
    outside_slope: float = 5.0

    @property
    def most_effects(self) -> int:
        """Largest number of effects of an explanation."""
        return len(self.counts) - 1

    def form_errors(self, known: bool) -> tuple[float, float]:
        """Least and largest share of its effect that a law of the right kind leaves."""
        return (0.0, self.known_form_error) if known else (self.least_form_error, self.form_error)


UNCALIBRATED = Calibration()
"""The figures that every diagnosis takes."""
