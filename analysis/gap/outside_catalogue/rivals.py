"""All changes in no catalogue that compete with the effects of the catalogue."""

from analysis.gap.effect import Effect
from analysis.gap.measurement import Measurement
from analysis.gap.outside_catalogue.common_base import common_base
from analysis.gap.outside_catalogue.local_change import local_changes
from analysis.gap.outside_catalogue.row_change import changes_of_rows
from analysis.gap.outside_catalogue.tester_change import changes_of_tester


def rivals_of(measurement: Measurement) -> tuple[Effect, ...]:
    """Every kind that these data could show, from every place."""
    return (
        *local_changes(measurement),
        *common_base(measurement),
        *changes_of_tester(measurement),
        *changes_of_rows(measurement),
    )
