"""What theory cannot say and trials can: how wrong laws are, and how often a cause is in no catalogue."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Calibration:
    """Figures that trials on benches of other laws give; the defaults are what was assumed before any trial.

    Attributes:
        form_error: largest rms share of its effect that a law of the right kind leaves.
        least_form_error: the least, as no law is exact; the size of an effect is known no better than to this share.
        known_form_error: the largest for effects whose form is known, such as a mass or a delay; the least is zero.
        patterns: independent ways in which what a law leaves deviates from zero.
        further: largest share of the misfit of an explanation that one with a further effect may leave, for its own
            misfit to be that of right laws.
        counts: prior probability that so many effects are there, from none to the most that are searched for.
        outside_share: of what is left before it, that each effect of the best explanation leaves in the mean, at which
            it is even odds that the cause is in no catalogue.
        local_share: prior probability that a single cause is a change at one place of the beam.
        outside_slope: change of these log odds over a factor of ten.
        provenance: where the figures are from, in a few words.
    """

    form_error: float = 0.07
    least_form_error: float = 0.01
    known_form_error: float = 0.022
    patterns: float = 10.0
    further: float = 0.02
    counts: tuple[float, ...] = (0.25, 0.45, 0.18, 0.08, 0.03, 0.01)
    outside_share: float = 0.35
    local_share: float = 0.1
    outside_slope: float = 5.0
    provenance: str = "assumed before any trial"

    @property
    def most_effects(self) -> int:
        """Effects that an explanation may have."""
        return len(self.counts) - 1

    def form_errors(self, known: bool) -> tuple[float, float]:
        """Least and largest share of its effect that a law of the right kind leaves."""
        return (0.0, self.known_form_error) if known else (self.least_form_error, self.form_error)


UNCALIBRATED = Calibration()
"""Before any trial."""
