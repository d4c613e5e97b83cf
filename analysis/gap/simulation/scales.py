"""Scales of the nuisances, which are errors of every bench and no effects: stated, or estimated from the data.

Joints are a little stiffer or softer after each new set-up, the tester reads a little differently in each
configuration, blows at each point lean a little, and an accelerance is off by a smooth share that no model explains.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from analysis.gap.measurement import SetUpTolerances


@dataclass(frozen=True)
class Scales:
    """Standard deviations of the nuisances, relative but for an angle, and two properties of the model error.

    Attributes:
        setup_scatter: of the stiffness of each joint from one set-up to another.
        configuration_gain: of the tester's gain from one configuration to another.
        model_error: of an accelerance, coherent over neighbouring lines.
        blow_lean: of the mean lean of the blows of each row in the plane of the beam, rad.
        correlation: length over which that error is coherent, Hz.
        common: share of its variance that rows struck at one point have in common in all sets.
    """

    setup_scatter: float
    configuration_gain: float
    model_error: float
    blow_lean: float
    correlation: float = 15.0
    common: float = 0.0


HALF_NORMAL = Scales(setup_scatter=0.005, configuration_gain=0.01, model_error=0.003, blow_lean=float(np.radians(0.5)))
"""Scales of the half-normal priors of scales that a laboratory does not state."""
NAMES = tuple(each.name for each in fields(Scales) if each.name not in ("correlation", "common"))
"""Names of the standard deviations."""


def typical_scales(tolerances: SetUpTolerances) -> Scales:
    """Scales as stated, or those of the priors."""
    return Scales(**{name: _stated_or(getattr(tolerances, name), getattr(HALF_NORMAL, name)) for name in NAMES})


def unknown_scales(tolerances: SetUpTolerances) -> tuple[str, ...]:
    """Names of the scales that are not stated."""
    return tuple(name for name in NAMES if getattr(tolerances, name) is None)


def narrower(scales: Scales, typical: Scales) -> Scales:
    """Scales of which each is the smaller of the given and the typical one."""
    return replace(scales, **{name: min(getattr(scales, name), getattr(typical, name)) for name in NAMES})


def log_prior(scales: Scales, tolerances: SetUpTolerances) -> float:
    """Log prior of the scales that are not stated, up to a constant."""
    unknown = unknown_scales(tolerances)
    return -float(sum((getattr(scales, name) / getattr(HALF_NORMAL, name)) ** 2 for name in unknown)) / 2


def _stated_or(stated: float | None, typical: float) -> float:
    return typical if stated is None else stated
