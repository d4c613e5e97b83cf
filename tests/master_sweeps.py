"""Sweeps of a drawn material at several temperatures in a catalogue, each a run of the article beam 3, specimen I."""

from collections.abc import Sequence

import numpy as np

from analysis.direct.dynamic_stiffness import DynamicStiffness
from jointlab.identification.sine_points import IdentifiedSinePoint, stored_point
from store.catalogue import Catalogue
from store.measurements.runs import start_run
from store.results.analyses import add_analysis
from store.results.dynamic_stiffness import add_dynamic_stiffness
from store.states import AnalysisKind
from tests.analysis.direct.materials import Material

ARTICLE, SPECIMEN = "beam 3", "I"
AMPLITUDE = 0.01  # mm
UNKNOWN = 60.0  # degrees Celsius, where no thermometer was connected


def store_sweeps(
    catalogue: Catalogue,
    sweeps: Sequence[float | None],
    configuration: str = "angled",
    amplitude_pp_mm: float = AMPLITUDE,
    corrections: Sequence[str] = (),
) -> Material:
    """A run of the tester at each temperature, degrees Celsius; None for one without a thermometer.

    `corrections` are the effects that its analysis says were corrected.
    """
    random = np.random.default_rng(11)
    material = Material.drawn(random)
    for temperature in sweeps:
        points, _ = material.sweeps([UNKNOWN if temperature is None else temperature], random)
        _store(catalogue, points, temperature, (configuration, amplitude_pp_mm), corrections)
    return material


def _store(
    catalogue: Catalogue,
    points: Sequence[DynamicStiffness],
    temperature: float | None,
    series: tuple[str, float],
    corrections: Sequence[str],
) -> None:
    settings = {"corrections": [{"effect": effect} for effect in corrections]}
    with catalogue.writing() as session:
        run = start_run(session, kind="sweep", title="sweep", article=ARTICLE, setup={})
        made = add_analysis(
            session, kind=AnalysisKind.DYNAMIC_STIFFNESS, method="sine fit", settings=settings, runs=[run.id]
        )
        rows = [
            IdentifiedSinePoint(SPECIMEN, *series, each.frequency, each, number, 1.0, temperature)
            for number, each in enumerate(points, start=1)
        ]
        add_dynamic_stiffness(session, made, [stored_point(each) for each in rows])
