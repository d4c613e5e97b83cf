"""The free bar with everything that hangs on it: joints, masses, springs, cuts, by its receptance and a small solve.

H = R_ol - R_oj (1 + Z R_jj)^-1 Z R_jl, with R the free bar's receptance between output o, load l and the places j
where something of dynamic stiffness Z is attached; one solve a frequency line, of the size of Z.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simlab.assembly import DYNAMIC_BELOW, Complex
from simlab.beam import FreeModes, Real
from simlab.case.article import Article


@dataclass(frozen=True, eq=False)
class Attachment:
    """Something held by the bar, or taken out of it.

    Attributes:
        shapes: (n, modes) of the free bar where it is held.
        stiffness: (lines, n, n) or (n, n) dynamic stiffness; negative takes stiffness out.
    """

    shapes: Real
    stiffness: Complex


class CoupledBar:
    """The free bar of an article, prepared for angular frequencies `omega` (lines,), rad/s, complex and not zero."""

    def __init__(self, modes: FreeModes, article: Article, omega: Complex) -> None:
        self.omega = omega
        self._dynamic = modes.frequency < DYNAMIC_BELOW
        natural = modes.angular_frequency[self._dynamic]
        damping = article.damping_scale * modes.damping_ratio[self._dynamic]
        square = natural**2 * (1 + 1j * article.loss_factor)
        self._compliance: Complex = 1.0 / (square - omega[:, None] ** 2 + 2j * damping * natural * omega[:, None])
        self._static = 1.0 / modes.angular_frequency[~self._dynamic] ** 2

    def accelerance(self, output: Real, loads: Real, attachments: list[Attachment]) -> Complex:
        """(loads, lines) acceleration read by `output` (modes,) under each unit force of `loads` (loads, modes)."""
        places = np.concatenate([attachment.shapes for attachment in attachments])
        stiffness = side_by_side(attachments, self.omega.size)
        between = self._receptance(places, places)
        reaction = np.linalg.solve(
            np.eye(len(places)) + stiffness @ between, stiffness @ self._receptance(places, loads)
        )
        received = self._receptance(output[None], loads) - self._receptance(output[None], places) @ reaction
        return np.asarray(-(self.omega**2) * received[:, 0].T)

    def _receptance(self, outputs: Real, inputs: Real) -> Complex:
        """(lines, outputs, inputs) of the free bar."""
        pairs = (outputs[:, None, :] * inputs[None, :, :]).reshape(len(outputs) * len(inputs), -1)
        received = self._compliance @ pairs[:, self._dynamic].T + pairs[:, ~self._dynamic] @ self._static
        return np.asarray(received.reshape(-1, len(outputs), len(inputs)))


def side_by_side(attachments: list[Attachment], lines: int) -> Complex:
    """(lines, N, N) with the stiffness of every attachment on the diagonal."""
    size = sum(len(attachment.shapes) for attachment in attachments)
    whole = np.zeros((lines, size, size), dtype=np.complex128)
    start = 0
    for attachment in attachments:
        end = start + len(attachment.shapes)
        whole[:, start:end, start:end] = attachment.stiffness
        start = end
    return whole
