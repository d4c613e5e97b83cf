"""A structure from the modes in a UFF file, as programs of modal analysis and of finite elements write them."""

from pathlib import Path

import numpy as np

from analysis.gap.parameter import Parameter
from analysis.gap.structures.modal_structure import STIFFNESS, ModalStructure
from analysis.gap.structures.modes import NormalModes
from jointlab.errors import JointlabError
from store.exchange.uff_modes import read_uff_modes

MOST_TURNED = 0.2
"""Part of a shape out of phase with the rest, over the whole, from which it is no real mode."""
LOSS_SPREAD = 0.3
"""Standard deviation of the error that the loss factors of all modes share, over their median."""
LEAST_SPREAD = 1e-3
"""Smallest such deviation, for a file without damping."""


def structure_of_uff(path: Path) -> ModalStructure:
    """The structure of a file with datasets 55; its parameters are its stiffness and a change of all loss factors.

    Raises:
        JointlabError: a shape is too complex for a mode of a structure with proportional damping.
        StoreError: the file cannot be read, or holds no modes.
    """
    found = read_uff_modes(path)
    turned = found.shapes * np.exp(-0.5j * np.angle(np.sum(found.shapes**2, axis=0)))
    size = np.linalg.norm(turned, axis=0)
    left = np.linalg.norm(turned.imag, axis=0) / np.where(size > 0, size, 1.0)
    if np.max(left) > MOST_TURNED:
        raise JointlabError(
            f"{path.name}: {100 * np.max(left):.0f} % of the mode at {found.frequencies[np.argmax(left)]:g} Hz is out "
            "of phase with the rest; export real (normal) modes"
        )
    spread = max(LOSS_SPREAD * float(np.median(found.loss_factors)), LEAST_SPREAD)
    return ModalStructure(
        NormalModes(found.dofs, turned.real, found.frequencies, losses=found.loss_factors),
        parameters=(STIFFNESS, Parameter("loss_factor", "1", 0.0, spread)),
        name=path.name,
    )
