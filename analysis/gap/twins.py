"""Effects that these data cannot tell apart, and the cheapest check that would."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.gap.evidence import tempered
from analysis.gap.search import Model
from analysis.gap.verdict import UNKNOWN, Weighed

INSEPARABLE = 1 / 20
"""Of the verdict's probability, above which another explanation is its twin."""
CHECKS: tuple[tuple[str, tuple[str, ...], float], ...] = (
    ("read the thermometers of both rigs", ("temperature_shift",), 0.05),
    ("measure the places of joints and points with a ruler", ("support_position", "impact_position"), 0.1),
    ("weigh the accelerometer, the caps and the bar", ("accelerometer_mass", "joint_mass", "density"), 0.05),
    ("measure how the cylinders lean and sit", ("cylinder_angle", "vertical_offset", "contact_patch"), 0.1),
    ("strike a known free mass", ("sensor_gain", "channel_delay", "highpass_corner"), 0.05),
    ("take a blank test of the tester", ("frame_compliance", "frame_resonance", "fixture_inertia"), 0.05),
    ("test a known mass in the tester", ("transducer_lag", "fixture_inertia"), 0.05),
    ("take records of twice the length", ("exponential_window", "beam_damping"), 0.1),
    ("repeat the tester's points in random order", ("conditioning_drift",), 0.1),
    ("repeat the tester's points at another preset", ("preload_stiffening",), 0.1),
    ("turn the accelerometer, or use one of three axes", ("cross_axis_sensitivity",), 0.1),
    ("listen out of the plane", ("out_of_plane_bending",), 0.1),
    ("strike with a guided hammer", ("impact_angle",), 0.1),
    ("suspend the bar and measure it free", ("youngs_modulus", "density", "beam_damping", "mesh_error"), 0.1),
    ("listen at the foundation", ("foundation_compliance",), 0.1),
    (
        "strike at a third level and test at a fourth amplitude",
        ("amplitude_dependence", "cubic_stiffness", "coulomb_friction"),
        0.1,
    ),
    ("test to a higher frequency", ("frequency_dependence", "loss_law"), 0.2),
)
"""What to do, the effects whose size it tells, and how well: as a share of an effect's range. The cheapest first."""
CONVINCING = 5.0
"""Standard deviations of expected separation that settle a matter."""


def twins(weighed: Sequence[Weighed]) -> tuple[tuple[str, ...], ...]:
    """Groups of effects that could each stand in the verdict's place, one group for each effect of the verdict."""
    verdict = weighed[0]
    if not verdict.effects or verdict.effects == UNKNOWN:
        return ()
    groups = []
    for effect in verdict.effects:
        rest = set(verdict.effects) - {effect}
        group = [effect]
        for other in weighed[1:]:
            swapped = set(other.effects) - rest
            alike = other.probability > INSEPARABLE * verdict.probability and other.effects != UNKNOWN
            if alike and rest <= set(other.effects) and len(swapped) == 1 and not swapped & set(verdict.effects):
                group += sorted(swapped)
        if len(group) > 1:
            groups.append(tuple(group))
    return tuple(groups)


def next_experiment(status: str, weighed: Sequence[Weighed], groups: Sequence[Sequence[str]]) -> str:
    """In a sentence, what to measure next."""
    if status == "none":
        return "nothing is asked for: simulation and measurement agree within noise and tolerances"
    if status == "unknown":
        return (
            "look at the bench where the map shows the gap; repeat the measurement after a new set-up, at another "
            "level and with the accelerometer at a second place, to see what moves with it"
        )
    verdict = weighed[0]
    doubtful = [name for group in groups for name in group] or list(verdict.effects)
    found = _cheapest(verdict.model, doubtful)
    if found is None:
        return f"repeat the measurement with {' and '.join(verdict.effects)} put right"
    check, separation = found
    purpose = f"tell {' from '.join(doubtful)}" if groups else f"confirm {' and '.join(doubtful)}"
    return f"{check}: expected to {purpose} by {separation:.0f} standard deviations"


def _cheapest(model: Model, doubtful: Sequence[str]) -> tuple[str, float] | None:
    """The first check that settles the matter, else the one that comes nearest."""
    best: tuple[str, float] | None = None
    for check, tells, share in CHECKS:
        for number, effect in enumerate(model.effects):
            # what tells a twin's size tells this one's too: it is there or it is not
            if not set(tells) & set(doubtful) or (effect.id not in tells and effect.id not in doubtful):
                continue
            separation = _size(model, number) / share
            if separation >= CONVINCING:
                return check, separation
            if best is None or separation > best[1]:
                best = check, separation
    return best


def _size(model: Model, effect: int) -> float:
    """Of an effect, in standard deviations of its prior, as far as the data are sure of it."""
    places = list(model.places(effect))
    scores = model.fit.scores[places]
    certain = np.linalg.inv(np.linalg.inv(tempered(model.fit, 1.0))[np.ix_(places, places)])
    weight = np.diag(certain) / np.max(np.diag(certain))
    return float(np.sqrt(np.sum(weight * scores**2) / np.sum(weight)))
