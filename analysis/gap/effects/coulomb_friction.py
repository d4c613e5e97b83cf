"""Dry friction beside the elastomer: 4 F_c / (pi x) on the loss, with F_c of 0.1 to 5 N."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.gap.bench import Cylinders, Loading
from analysis.gap.effect import Effect, Given
from analysis.gap.effects.amplitude_dependence import BLOW_AMPLITUDE, FALL, blow_amplitude
from analysis.gap.parameter import Parameter

TRANSLATION = np.array([[1.0], [1.0], [0.0]])


@dataclass(frozen=True)
class CoulombFriction(Effect):
    """Each cylinder rubs, in shear as in compression; no slider loses more than the spring beside it could hold."""

    id = "coulomb_friction"
    title = "dry friction"
    law = "sliding"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (Parameter("F_c", "N", 0.7, 1.0, positive=True, starts=(-2.5, -1.2, 0.8)), BLOW_AMPLITUDE, FALL)

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        amplitude = blow_amplitude(given, loading, component=True)
        rubbing = np.minimum(4 * given["F_c"] / (np.pi * amplitude), cylinders.storage)
        return Cylinders(cylinders.storage, np.asarray(cylinders.loss + TRANSLATION * rubbing))


@dataclass(frozen=True)
class StickingFriction(Effect):
    """A slider behind a spring, which sticks at small amplitudes (Jenkins' element by harmonic balance).

    A step from a stiff spring overshoots what the tester shows: a search starts from a soft one too.
    """

    id = "coulomb_friction"
    title = "dry friction"
    law = "sticking and sliding"

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        return (
            Parameter("F_c", "N", 1.5, 0.9, positive=True),
            Parameter("stick", "1", 0.2, 0.6, positive=True, starts=(-3.0, -1.5, 0.0)),
            BLOW_AMPLITUDE,
            FALL,
        )

    def cylinders(self, given: Given, cylinders: Cylinders, loading: Loading) -> Cylinders:
        stick = TRANSLATION * given["stick"] * cylinders.storage
        slipping = blow_amplitude(given, loading, component=True) * np.maximum(stick, 1e-9)
        ratio = np.minimum(given["F_c"] / slipping, 1.0)
        turn = np.arccos(1 - 2 * ratio)
        return Cylinders(
            np.asarray(cylinders.storage + stick / np.pi * (turn - np.sin(2 * turn) / 2)),
            np.asarray(cylinders.loss + 4 * stick * ratio * (1 - ratio) / np.pi),
        )
