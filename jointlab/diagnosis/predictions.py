"""Accelerances that were asked for, as UFF58: without the effects in the model (before), and with them (after)."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from analysis.dof import Dof
from analysis.frequency_response import Complex, Real
from analysis.gap.diagnosis import Predicted
from jointlab.errors import JointlabError
from store.dof import StoredDof
from store.exchange.accelerance_file import even_spacing, to_uff
from store.exchange.uff import FunctionKind, UffFunction, UffModel, write_uff
from store.exchange.uff_units import UffQuantity

ResponseAndInput = tuple[Dof, Dof]
"""Response and input."""


def write_predictions(
    folder: Path, predicted: Predicted, asked: Sequence[ResponseAndInput], model: UffModel
) -> tuple[Path, Path]:
    """Write before.unv and after.unv, the beam and a function for each of `asked`, and return their paths.

    Raises:
        JointlabError: the folder cannot be made.
        StoreError: a file cannot be written, or the frequencies are not evenly spaced.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise JointlabError(f"{folder} cannot be made: {error.strerror or error}") from error
    files = folder / "before.unv", folder / "after.unv"
    for file, accelerances in zip(files, (predicted.before, predicted.after), strict=True):
        write_accelerances(file, predicted.frequency, accelerances, asked, model)
    return files


def write_accelerances(
    file: Path, frequency: Real, accelerances: Complex, asked: Sequence[ResponseAndInput], model: UffModel
) -> None:
    """Write (rows, lines) accelerances, (m/s^2)/N, at (lines,) Hz as UFF58; StoreError as of `write_predictions`."""
    start, step = even_spacing(frequency)
    write_uff(file, [_function(pair, row, start, step) for pair, row in zip(asked, accelerances, strict=True)], model)


def _function(pair: ResponseAndInput, accelerance: Complex, start: float, step: float) -> UffFunction:
    response, struck = (to_uff(StoredDof(dof.node, dof.direction.value)) for dof in pair)
    return UffFunction(
        kind=FunctionKind.FREQUENCY_RESPONSE,
        response=response,
        reference=struck,
        start=start,
        step=step,
        values=accelerance.astype(np.complex128),
        abscissa_unit="Hz",
        unit="m/s^2",
        denominator_unit="N",
        quantity=UffQuantity.ACCELERATION,
        denominator=UffQuantity.FORCE,
        name="accelerance",
    )
