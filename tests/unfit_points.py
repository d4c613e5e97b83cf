"""A run with a sine point that a bundle cannot hold."""

from dataclasses import replace

from store.catalogue import Catalogue
from store.results.analyses import add_analysis, latest_analysis
from store.results.dynamic_stiffness import add_dynamic_stiffness, list_dynamic_stiffness
from store.states import AnalysisKind

UNFIT = 2
"""The order of the point that `without_temperature` takes its temperature from."""


def without_temperature(catalogue: Catalogue, run: int) -> None:
    """Store the dynamic stiffness of a run once more, its second point without a temperature."""
    with catalogue.writing() as session:
        known = list_dynamic_stiffness(session, latest_analysis(session, run, AnalysisKind.DYNAMIC_STIFFNESS).id)
        points = [replace(each, temperature_c=None) if each.order_number == UNFIT else each for each in known]
        analysis = add_analysis(session, kind=AnalysisKind.DYNAMIC_STIFFNESS, method="later", settings={}, runs=[run])
        add_dynamic_stiffness(session, analysis, points)
