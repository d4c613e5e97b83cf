"""Measured modes and accelerances against predicted ones: modal assurance criterion, pairs of modes, FRAC."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from analysis.errors import AnalysisError
from analysis.frequency_response import Complex, Real
from analysis.modes import Modes


@dataclass(frozen=True)
class ModeError:
    """One measured mode beside the predicted mode that it was paired with.

    Attributes:
        measured, predicted: places of the two modes, from 0.
        frequency, predicted_frequency: Hz.
        loss_factor, predicted_loss_factor: dimensionless.
        mac: modal assurance criterion of the shapes, 0..1.
    """

    measured: int
    predicted: int
    frequency: float
    predicted_frequency: float
    loss_factor: float
    predicted_loss_factor: float
    mac: float

    @property
    def frequency_error(self) -> float:
        """Predicted over measured frequency, less one."""
        return self.predicted_frequency / self.frequency - 1


def mac(first: Complex, second: Complex) -> Real:
    """(first modes, second modes) modal assurance criterion |a^H b|^2 / (a^H a b^H b) of complex shapes, each
    (modes, dofs).

    Raises:
        AnalysisError: the shapes have different numbers of components, or one is zero.
    """
    if first.shape[-1] != second.shape[-1]:
        raise AnalysisError(f"shapes of {first.shape[-1]} and {second.shape[-1]} components cannot be compared")
    sizes = np.outer(np.sum(np.abs(first) ** 2, axis=1), np.sum(np.abs(second) ** 2, axis=1))
    if np.any(sizes == 0):
        raise AnalysisError("a shape of zeros has no modal assurance criterion")
    return np.asarray(np.abs(first.conj() @ second.T) ** 2 / sizes)


def mode_errors(measured: Modes, predicted: Modes) -> tuple[ModeError, ...]:
    """Pair measured modes with predicted ones, by MAC and nearness in frequency.

    Args:
        measured: components at any dofs.
        predicted: components at all dofs of `measured`. Where these are fewer modes, those measured modes that
            fit worst have no pair.

    Raises:
        AnalysisError: components are missing.
    """
    assurance = mac(measured.shapes, np.stack([predicted.at(dof) for dof in measured.dofs], axis=1))
    distance = np.abs(np.log(predicted.frequency[None, :] / measured.frequency[:, None]))
    rows, columns = linear_sum_assignment(1 - assurance + 10 * distance)
    return tuple(
        ModeError(
            measured=int(row),
            predicted=int(column),
            frequency=float(measured.frequency[row]),
            predicted_frequency=float(predicted.frequency[column]),
            loss_factor=float(measured.loss_factor[row]),
            predicted_loss_factor=float(predicted.loss_factor[column]),
            mac=float(assurance[row, column]),
        )
        for row, column in zip(rows, columns, strict=True)
    )


def frac(first: Complex, second: Complex) -> Real:
    """(rows,) frequency response assurance criterion |a^H b|^2 / (a^H a b^H b) of complex responses over their lines.

    W. Heylen and S. Lammens, Proc. Int. Conf. on Identification in Engineering Systems, Swansea 1996. One factor on a
    whole row does not lower it. Both responses are (rows, lines).

    Raises:
        AnalysisError: they differ in shape, or a row is zero.
    """
    if first.shape != second.shape:
        raise AnalysisError(f"responses of shape {first.shape} and {second.shape} cannot be compared")
    sizes = np.sum(np.abs(first) ** 2, axis=-1) * np.sum(np.abs(second) ** 2, axis=-1)
    if np.any(sizes == 0):
        raise AnalysisError("a row of zeros has no frequency response assurance criterion")
    return np.asarray(np.abs(np.sum(first.conj() * second, axis=-1)) ** 2 / sizes)
