"""A case measured as a real lab would: blows over NI-DAQmx, sweeps over Modbus, and no formula in between."""

import json
from pathlib import Path

from jointlab.identification.load import measurement_of_run
from jointlab.instruments import instruments_of
from jointlab.runs.carry_out import run_sequence
from jointlab.trials.simulated_laboratory import simulated_settings
from jointlab.trials.simulated_operator import SimulatedOperator
from rig.sequences.sequence import sequence_from
from simlab.case.bundle import percent
from simlab.case.campaign import CONFIGURATIONS, ROWS, Row
from simlab.case.draw import CaseKind, draw_case
from simlab.case.simulate import simulate
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from store.catalogue import Catalogue

STEPS = [
    {"step": "hammer", "points": ["4y", "1x"], "blows": 4, "block_seconds": 2.0},
    {
        "step": "sweep",
        "specimens": ["I"],
        "configurations": ["shear", "angled"],
        "amplitudes_pp_mm": [0.1],
        "frequencies": {"first": 40, "last": 120, "step": 80},
    },
]


def test_a_run_on_a_case_measures_its_effect(tmp_path: Path) -> None:
    case = draw_case(4, CaseKind.PAIR, ["foundation_compliance", "frame_compliance"], 0.6)
    with Laboratory(speed=200.0, case=case) as laboratory:
        operator = OperatorClient(laboratory.addresses.operator)
        drawing = operator.do("drawing")
        article = {part: drawing[part] for part in ("beam", "node_positions", "joints", "accelerometer", "tolerances")}
        document = {
            "format": "jointlab-sequence/1",
            "title": "a case",
            "article_name": "case",
            "article": article,
            "steps": STEPS,
        }
        settings = simulated_settings(laboratory.addresses, database_url="")
        with Catalogue.open(f"sqlite:///{tmp_path / 'lab.db'}") as catalogue:
            sequence = sequence_from(json.loads(json.dumps(document)))
            run = run_sequence(sequence, instruments_of(settings), catalogue, SimulatedOperator(operator))
            measured = measurement_of_run(catalogue, run)
        operator.close()
    responses = measured.responses(0)
    band = (responses.frequency > 20.0) & (responses.frequency < 1000.0)
    frequency = responses.frequency[band]
    true, paper = (simulate(case, without_effects=without, frequency=frequency) for without in (False, True))
    for point, accelerance in zip(responses.inputs, responses.accelerance[:, band], strict=True):
        row = ROWS.index(Row(point.node, point.direction.value))
        # four blows leave two per cent of noise on the row from the end, half of one on the other
        assert percent(true.accelerance[0, row], accelerance) < 4.0
        assert percent(paper.accelerance[0, row], accelerance) > 8.0
    points = case.campaign.points
    for sine in measured.points:
        here = (points.specimen == 0) & (points.amplitude_pp_mm == 0.1)
        here &= points.configuration == CONFIGURATIONS.index(sine.configuration)
        here &= points.frequency == round(sine.result.frequency)
        found = sine.result.stiffness * (1 + 1j * sine.result.loss_factor)
        assert abs(found / true.stiffness[here][0] - 1) < 2e-3
        assert abs(found / paper.stiffness[here][0] - 1) > 0.1
