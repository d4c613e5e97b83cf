"""A diagnosis made by hand, to see what is made of it."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from analysis.gap.diagnosis import Diagnosis, Predicted, Ranked
from analysis.gap.effect import LawOver, Mechanism
from analysis.gap.evidence.verdict import Status
from analysis.gap.experiments.catalogue import Experiment
from analysis.gap.experiments.next_experiment import NextExperiment
from analysis.gap.findings.effects_found import EffectFound, Remainder
from analysis.gap.findings.intervals import Band
from analysis.gap.findings.law_found import LawFound, LawOfAxis
from analysis.gap.findings.location import GapMap, GapPlace
from analysis.gap.findings.model_values import EffectValues, ModelValues
from analysis.gap.fitting.held_out import Gap, HeldOut
from analysis.gap.measurement import Rig
from analysis.gap.outside_catalogue.shape import FoundShape
from analysis.gap.parameter import ParameterEstimate
from analysis.gap.simulation.scales import Scales
from jointlab.diagnosis.document import diagnosis_document
from jointlab.diagnosis.track_record import TrackRecord

EFFECT = "out_of_plane_bending"


def held_out(percent: float, sigma: float) -> HeldOut:
    beam, tester = Gap(percent, sigma, percent, percent), Gap(percent / 2, sigma / 2, percent / 2, percent / 2)
    return HeldOut(beam, tester, (0.9 * percent, 1.1 * percent))


AT = np.linspace(10.0, 1000.0, 5)
CURVE = FoundShape(
    place={"rig": "inverse", "at": "joint I", "motion": "y", "position": 0.0561, "node": 2.0},
    quantity="dynamic stiffness",
    unit="N/m",
    over="frequency",
    at=AT,
    value=np.asarray(1e3j * AT),
    low=np.asarray(1e3j * AT - 500 * (1 + 1j)),
    high=np.asarray(1e3j * AT + 500 * (1 + 1j)),
    before=12.3,
    after=3.4,
    resembles="dashpot",
)
"""A damper at a joint."""


def band(*value: float) -> Band:
    """A tenth of the change to both sides."""
    found = np.array(value)
    half = 0.1 * np.abs(found - found[0])
    return Band(found, found - half, found + half)


LAW = LawFound(
    over=LawOver.AMPLITUDE,
    unit="m",
    at=np.array([1e-6, 3e-6, 10e-6]),
    shear=LawOfAxis(band(1.0, 0.9, 0.84), band(0.12, 0.13, 0.156), band(1.0, 1.08, 1.3)),
    compression=LawOfAxis(band(1.0, 0.9, 0.8), band(0.1, 0.11, 0.13), band(1.0, 1.1, 1.3)),
    closest="Kraus",
)
"""Stiffness falls and loss rises with amplitude."""
FOLLOWS_AMPLITUDE = EffectFound(
    "amplitude_dependence", 0.9, Mechanism.JOINT_AMPLITUDE, "Kraus, bent", True, {}, law_found=LAW
)


def handmade(**others: Any) -> Diagnosis:
    """Out-of-plane bending at 93 %; `others` replaces fields."""
    coupling = {EFFECT: {"coupling": ParameterEstimate(0.02, (0.018, 0.022), "1")}}
    fields: dict[str, Any] = {
        "status": Status.EXPLAINED,
        "effects": (EFFECT,),
        "before": held_out(12.3, 41.0),
        "after": held_out(3.1, 1.2),
        "floor_percent": 2.9,
        "where": (
            GapPlace(Rig.BEAM, {"input": "1x", "response": "3y", "level": 1}, (300.0, 360.0), "magnitude", 0.41, 88.0),
            GapPlace(
                Rig.TESTER,
                {"specimen": "I", "configuration": "shear", "amplitude_pp_mm": 0.1},
                (5.0, 50.0),
                "phase",
                0.02,
                3.5,
            ),
        ),
        "maps": (
            GapMap(
                "beam rig, 100 N",
                Rig.BEAM,
                ("1x", "3y"),
                ({"input": "1x", "response": "3y"}, {"input": "3y", "response": "3y"}),
                np.array([5.0, 300.0, 360.0, 1024.0]),
                np.array([[10.0, 400.0, 30.0], [5.0, -1.0, 0.0]]),
                np.array([[4.0, 88.0, 12.0], [2.0, 0.0, 0.5]]),
                np.array([[0.5, 0.9, 0.1], [0.5, 0.5, 0.5]]),
            ),
        ),
        "ranking": (
            Ranked((EFFECT,), ("two modes",), 0.93, held_out(3.1, 1.2), coupling, 0.98),
            Ranked((), (), 0.04, held_out(12.3, 41.0), {}, 0.0),
            Ranked(("unknown",), (), 0.03, None, {}, 0.0),
        ),
        "confounded": (("impact_angle", "cross_axis_sensitivity"),),
        "next_experiment": NextExperiment(Experiment.TURN_ACCELEROMETER, (EFFECT,), False, 0.9, 1.0, 20.0),
        "faults": (),
        "predicted": Predicted(np.array([5.0, 5.5, 6.0]), np.full((1, 3), 1 + 2j), np.full((1, 3), 1 - 2j)),
        "seconds": 12.0,
        "readings": None,
        "missing_evidence": (),
        "included": (EffectFound(EFFECT, 0.93, Mechanism.BEAM, "two modes", True, coupling[EFFECT]),),
        "mechanisms": {Mechanism.BEAM: 0.93},
        "remainder": Remainder(1.1, 0.9, False, ()),
        "nuisances": Scales(0.004, 0.011, 0.002, 0.005),
        "set_up_changes": (),
        "model": ModelValues((EffectValues(EFFECT, "two modes", {}, coupling[EFFECT]),), {}, None, {}, {}, ""),
    }
    return Diagnosis(**(fields | others))


@pytest.fixture
def diagnosis() -> Callable[..., Diagnosis]:
    return handmade


@pytest.fixture
def document() -> Callable[..., dict[str, Any]]:
    """The document of a handmade diagnosis, beside a track record."""

    def make(record: TrackRecord | None = None, **others: Any) -> dict[str, Any]:
        return diagnosis_document(handmade(**others), TrackRecord() if record is None else record)

    return make
