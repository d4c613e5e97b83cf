"""Results of a run as a UFF file: accelerances, modes and the beam, for programs of modal analysis.

The format has no place for joint matrices and sine points. Variances are functions of their own.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from store.catalogue import Catalogue
from store.dof import StoredDof
from store.errors import NotFoundError
from store.exchange.accelerance_file import accelerance_functions
from store.exchange.uff import FunctionKind, UffFunction, UffModel, write_uff
from store.exchange.uff_modes import UffMode
from store.measurements.frequency_responses import FrequencyResponseSet, list_frequency_responses
from store.measurements.runs import get_run
from store.new_file import new_file
from store.results.analyses import NO_RESULT, Analysis, list_analyses
from store.results.modes import ModeSet, get_modes
from store.states import AnalysisKind

VARIANCE = "variance"


def export_uff(catalogue: Catalogue, run_id: int, path: Path) -> int:
    """Write the newest accelerances and modes of a run, and return the number of analyses.

    Accelerances are functions (dataset 58) with coherence and variance beside them; modes are datasets 55, their loss
    factor as hysteretic damping, and their 95 % intervals, method and analysis in the lines of text. Their shapes have
    unit modal mass if the point of the accelerometer was struck; if not, the modal mass is zero.

    Raises:
        NotFoundError: there is no such run, or it has neither accelerances nor modes.
        DamagedError: a result is damaged.
        StoreError: the file exists already or cannot be written, or frequencies are not evenly spaced.
    """
    with catalogue.reading(long=True) as session:
        run = get_run(session, run_id)
        responses, modal = (
            _newest(list_analyses(session, run_id, kind))
            for kind in (AnalysisKind.FREQUENCY_RESPONSES, AnalysisKind.MODES)
        )
        sets = [each for one in responses for each in list_frequency_responses(session, run_id, one.id)]
        found = [(analysis, get_modes(session, analysis.id)) for analysis in modal]
    if not sets and not found:
        raise NotFoundError(f"run {run_id} has neither accelerances nor modes; identify it first")
    positions = run.setup.get("node_positions")
    model = None if positions is None else UffModel(run.article, positions, run.started_at)
    functions = [function for measured in sets for function in _functions(measured)]
    places = {each.response for each in sets}
    driven = places.pop() if len(places) == 1 else None
    modes = [mode for analysis, each in found for mode in _modes(analysis, each, driven)]
    with new_file(path) as unfinished:
        write_uff(unfinished, functions, model, modes)
    return len(responses) + len(modal)


def _newest(analyses: Sequence[Analysis]) -> list[Analysis]:
    """The newest analysis of each method, where it has results."""
    newest = {analysis.method: analysis for analysis in reversed(analyses)}
    return [analysis for analysis in newest.values() if NO_RESULT not in analysis.settings]


def _functions(measured: FrequencyResponseSet) -> list[UffFunction]:
    made = accelerance_functions(
        measured.response, measured.inputs, measured.frequency, measured.accelerance, measured.coherence,
        measured.excitation,
    )  # fmt: skip
    if measured.variance is not None:
        first = made[: len(measured.inputs)]
        made += [
            UffFunction(
                FunctionKind.GENERAL, each.response, each.reference, each.start, each.step, row.astype(np.float64),
                abscissa_unit=each.abscissa_unit, name=VARIANCE,
            )
            for each, row in zip(first, measured.variance, strict=True)
        ]  # fmt: skip
    return [replace(function, name=f"{function.name} set {measured.number}") for function in made]


def _modes(analysis: Analysis, modes: ModeSet, accelerometer: StoredDof | None) -> Iterator[UffMode]:
    """Modes with shapes of unit modal mass, where the point of the accelerometer was struck.

    Otherwise shapes are the modal constants, which are proportional to them, and the modal mass is zero: not known.
    """
    made_by = f"analysis {analysis.id}, {analysis.method}, Jointlab {analysis.software_version}"
    for index, frequency in enumerate(modes.frequency.tolist()):
        texts = [f"mode {index + 1}", made_by]
        for name, limits in (("frequency", modes.frequency_ci95), ("loss factor", modes.loss_factor_ci95)):
            if limits is not None:
                texts.append(f"{name} 95 %: {limits[index, 0]:.10g} to {limits[index, 1]:.10g}")
        constants = dict(zip(modes.dofs, modes.shapes[index].tolist(), strict=True))
        own = constants.get(accelerometer, 0.0) if accelerometer is not None else 0.0
        shape = {dof: each / np.sqrt(complex(own)) for dof, each in constants.items()} if own else constants
        modal_mass = 1.0 if own else 0.0
        yield UffMode(index + 1, frequency, float(modes.loss_factor[index]), shape, texts, modal_mass)
