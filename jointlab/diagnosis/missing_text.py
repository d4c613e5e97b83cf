"""What is missing of an experiment that was asked for, in words."""

from collections.abc import Sequence

from analysis.gap.experiments.missing_condition import MissingCondition
from analysis.gap.experiments.requested_data import Missing
from rig.operator import loading_text

PEAK_TO_PEAK_MM = 2e3
"""mm peak to peak in a metre zero to peak."""


def missing_text(missing: Sequence[Missing]) -> str:
    """All that is missing, with the nearest that was measured in brackets."""
    return "; ".join(map(_text, missing))


def _text(missing: Missing) -> str:
    wanted, measured = missing.wanted, missing.measured
    match missing.what:
        case MissingCondition.HAMMER_SET:
            return "blows on the beam"
        case MissingCondition.TESTER_POINTS:
            return "points of the tester"
        case MissingCondition.POINTS:
            return f"blows at {', '.join(map(str, missing.points))}"
        case MissingCondition.FORCE:
            level = "a peak force that is new" if wanted is None else f"a peak force of about {wanted:.3g} N"
            return level + _nearest(measured, "N")
        case MissingCondition.HIGHEST_LINE:
            return f"accelerances up to {wanted:.4g} Hz" + _nearest(measured, "Hz")
        case MissingCondition.MOUNTINGS:
            return ", ".join(
                f"{each.specimen} {loading_text(each.configuration.name.lower())}" for each in missing.mountings
            )
        case MissingCondition.AMPLITUDE:
            if wanted is None:
                return "an amplitude of the tester that is new"
            near = None if measured is None else measured * PEAK_TO_PEAK_MM
            return f"an amplitude of about {wanted * PEAK_TO_PEAK_MM:.3g} mm peak to peak" + _nearest(near, "mm")
        case MissingCondition.LOWEST_FREQUENCY:
            return f"points of the tester down to {wanted:.4g} Hz" + _nearest(measured, "Hz")
        case MissingCondition.HIGHEST_FREQUENCY:
            return f"points of the tester up to {wanted:.4g} Hz" + _nearest(measured, "Hz")
        case MissingCondition.RANDOM_ORDER:
            return "a random order of the tester's points"


def _nearest(measured: float | None, unit: str) -> str:
    return "" if measured is None else f" (nearest measured: {measured:.4g} {unit})"
