"""Modes and accelerances of a fitted bench, whose joints may follow a law of frequency."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.dof import Dof
from analysis.errors import AnalysisError
from analysis.frequency_response import FrequencyResponses, Real
from analysis.inverse.frequency_laws import REFERENCE_FREQUENCY, growth
from analysis.inverse.response_model import ResponseModel
from analysis.inverse.tolerances import Deviations
from analysis.modes import Modes
from analysis.structure.beam import FreeBeam
from analysis.structure.forward import accelerance, eigensolution
from analysis.structure.joints import Joint

ITERATIONS = 30
SETTLED = 1e-9  # relative change of a natural frequency
MARGIN = 1.5  # times the highest frequency wanted, up to which modes are searched: joints are softer at lower ones


def joints_at(frequency: float, joints: Sequence[Joint], laws: Real) -> list[Joint]:
    """The joints as they are at `frequency`, Hz, from those at 100 Hz and their laws (4, joints)."""
    factors = growth(laws, np.log([frequency / REFERENCE_FREQUENCY]).astype(complex))[:, 0]
    return [
        replace(joint, dynamic_stiffness=factor * joint.dynamic_stiffness)
        for joint, factor in zip(joints, factors, strict=True)
    ]


def modes_on(free_beam: FreeBeam, joints: Sequence[Joint], highest_frequency: float, laws: Real | None = None) -> Modes:
    """Complex modes, each on the joints as they are at its own natural frequency.

    Args:
        free_beam: the beam without joints.
        joints: at 100 Hz.
        highest_frequency: of the modes wanted, Hz.
        laws: (4, joints) of the joints, in the order of `frequency_laws.LAW_PARAMETERS`; None for constant ones.

    Raises:
        AnalysisError: a mode's frequency does not settle, or `eigensolution` fails.
    """
    every = eigensolution(free_beam, joints, highest_frequency if laws is None else MARGIN * highest_frequency)
    if laws is None or every.poles.size == 0:
        return every
    found = [_settled(free_beam, joints, laws, every, number) for number in range(every.poles.size)]
    modes = Modes(
        np.array([each.poles[number] for number, each in enumerate(found)]),
        np.array([each.shapes[number] for number, each in enumerate(found)]),
        every.dofs,
    )
    keep = modes.frequency <= highest_frequency
    return Modes(modes.poles[keep], modes.shapes[keep], modes.dofs)


def accelerance_on(
    free_beam: FreeBeam,
    joints: Sequence[Joint],
    bench: Deviations,
    frequency: Real,
    response: Dof,
    inputs: Sequence[Dof],
    decay: float = 0.0,
) -> FrequencyResponses:
    """Accelerances, Eq. (46), of a bench that is not quite as drawn, with the joints as they are at each frequency.

    Args:
        free_beam: the beam without joints, as drawn.
        joints: at their true places, at 100 Hz.
        bench: how it differs from the drawing.
        frequency, response, inputs, decay: as of `accelerance`; at 0 Hz a supported beam does not accelerate.
    """
    if not np.any(bench.values):
        return accelerance(free_beam, joints, frequency, response, inputs, decay)
    moving = frequency > 0
    nodes = tuple(joint.node for joint in joints)
    model = ResponseModel(free_beam, nodes, response, tuple(inputs), frequency[moving], decay)
    stiffness = np.array([joint.dynamic_stiffness for joint in joints])
    found = np.zeros((len(inputs), frequency.size), dtype=complex)
    found[:, moving] = model.condensed(bench).evaluate_on(stiffness).accelerance
    return FrequencyResponses(frequency, found, response, tuple(inputs), decay=decay)


def _settled(free_beam: FreeBeam, joints: Sequence[Joint], laws: Real, modes: Modes, number: int) -> Modes:
    """All modes on the joints as they are at the frequency of the one of this `number`."""
    limit = MARGIN * float(modes.frequency[-1])
    for _ in range(ITERATIONS):
        before = float(modes.frequency[number])
        modes = eigensolution(free_beam, joints_at(before, joints, laws), limit)
        if modes.poles.size <= number:
            break
        if abs(modes.frequency[number] - before) < SETTLED * before:
            return modes
    raise AnalysisError(f"mode {number + 1} finds no frequency on joints that follow frequency")
