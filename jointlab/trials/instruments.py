"""A case measured as in a laboratory: blows over NI-DAQmx, sweeps over Modbus, stored in a catalogue of its own."""

import json
from pathlib import Path
from typing import Any

from analysis.dof import Dof
from jointlab.instruments import instruments_of
from jointlab.runs.carry_out import run_sequence
from jointlab.trials.simulated_laboratory import simulated_settings
from jointlab.trials.simulated_operator import SimulatedOperator
from jointlab.trials.worker import DATABASE
from rig.control import RunControl
from rig.events import Observer, ignore_event
from rig.sequences.sequence import Sequence, sequence_from
from simlab.case.campaign import AMPLITUDES_PP_MM, AVERAGES, CONFIGURATIONS, MEASURED, PRESET_MM
from simlab.case.draw import Case
from simlab.laboratory import Addresses, Laboratory
from simlab.operator_server import OperatorClient
from store.catalogue import Catalogue

SPEED = 100.0
"""Bench time over wall time: beyond it the wires take the time, not the bench."""
ARTICLE = ("beam", "node_positions", "joints", "accelerometer", "tolerances")


class CaseOperator(SimulatedOperator):
    """Strikes and mounts on a case's bench, and begins each hammer set with its set-up."""

    def __init__(self, operator: OperatorClient, first: Dof) -> None:
        super().__init__(operator)
        self._first, self._sets = first, 0
        self._last: Dof | None = None

    def strike(self, point: Dof, blow: int) -> None:
        """Strike `point`; a set begins with its first point.

        Raises:
            RequestError: no hammer reaches that point, or the case has no further set.
        """
        if point == self._first and self._last != point:
            self._do("set_up", number=self._sets)
            self._sets += 1
        self._last = point
        super().strike(point, blow)


def measure(case: Case, folder: Path) -> None:
    """Measure a case over the wires and keep the run in a database in `folder`.

    Raises:
        DaqError, RigError, JointlabError: an instrument failed.
    """
    with Laboratory(speed=SPEED, case=case) as laboratory:
        operator = OperatorClient(laboratory.addresses.operator)
        try:
            sequence = sequence_of(operator.do("drawing"))
            with Catalogue.open(f"sqlite:///{folder / DATABASE}") as catalogue:
                measured_at(laboratory.addresses, operator, catalogue, sequence)
        finally:
            operator.close()


def measured_at(
    addresses: Addresses,
    operator: OperatorClient,
    catalogue: Catalogue,
    sequence: Sequence,
    observer: Observer = ignore_event,
    control: RunControl | None = None,
) -> int:
    """Run a sequence on the case that stands in a simulated laboratory, and return the number of the run.

    Raises:
        RunStoppedError: `control` asked for it.
        DaqError, RigError, JointlabError: an instrument failed.
    """
    first = Dof.parse(sequence.hammer_steps[0].points[0])
    settings = simulated_settings(addresses, database_url="")
    return run_sequence(sequence, instruments_of(settings), catalogue, CaseOperator(operator, first), observer, control)


def sequence_of(drawing: dict[str, Any], blows: int = AVERAGES, frequency_step: float = 5.0) -> Sequence:
    """The sequence that a laboratory would carry out for a case: its hammer sets, then the whole sweep.

    Args:
        drawing: the bench as it is stated, in the form of setup.json.
        blows: at each point.
        frequency_step: Hz, of the sweep from 5 to 200 Hz.
    """
    hammers = [
        {"step": "hammer", "points": [row.name for row in MEASURED], "blows": blows, "peak_force": entry["peak_force"]}
        for entry in drawing["inverse"]
    ]
    sweep = {
        "step": "sweep",
        "specimens": [joint["name"] for joint in drawing["joints"]],
        "configurations": list(CONFIGURATIONS),
        "amplitudes_pp_mm": list(AMPLITUDES_PP_MM),
        "preset_mm": PRESET_MM,
        "frequencies": {"first": 5.0, "last": 200.0, "step": frequency_step},
    }
    document = {
        "format": "jointlab-sequence/1",
        "title": drawing["title"],
        "article_name": "sealed case",
        "article": {part: drawing[part] for part in ARTICLE},
        "steps": [*hammers, sweep],
    }
    return sequence_from(json.loads(json.dumps(document)))
