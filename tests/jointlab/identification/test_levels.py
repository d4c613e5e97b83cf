"""Hammer levels: the operator is told how hard to strike, and a run holds a set for each."""

from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest
import yaml

from jointlab.identification.load import measurement_of_run
from jointlab.instruments import instruments_of
from jointlab.runs.carry_out import run_sequence
from jointlab.trials.simulated_laboratory import simulated_settings
from jointlab.trials.simulated_operator import SimulatedOperator
from rig.events import Event, HammerStarted, notify_all
from rig.sequences.sequence_file import load_sequence
from simlab.laboratory import Laboratory
from simlab.operator_server import OperatorClient
from store.catalogue import Catalogue
from tests.api.conftest import paper


def test_every_level_is_struck_as_hard_as_its_step_says(laboratory: Laboratory, tmp_path: Path) -> None:
    document = paper()
    light = document["steps"][0] | {"points": ["1y", "5y"], "blows": 3, "block_seconds": 1.0}
    document["steps"] = [light, light | {"peak_force": 300.0}]
    (tmp_path / "levels.yaml").write_text(yaml.safe_dump(document), encoding="utf-8")
    settings = simulated_settings(laboratory.addresses, database_url=f"sqlite:///{tmp_path / 'levels.db'}")
    client, events = OperatorClient(laboratory.addresses.operator), list[Event]()
    person = SimulatedOperator(client)
    with Catalogue.open(settings.database_url) as catalogue:
        run = run_sequence(
            load_sequence(tmp_path / "levels.yaml"),
            instruments_of(settings),
            catalogue,
            person,
            notify_all(events.append, person.observe),
        )
        measurement = measurement_of_run(catalogue, run)
    client.close()
    assert [event for event in events if isinstance(event, HammerStarted)] == [
        HammerStarted(1, 100.0),
        HammerStarted(2, 300.0),
    ]
    first, second = measurement.sets
    # the operator scatters by a tenth, and the converter's filter takes another tenth off so short a pulse
    assert 70.0 < first.peak_force < 120.0
    assert 2.0 < second.peak_force / first.peak_force < 4.0


@pytest.mark.usefixtures("drive", "operator")
def test_the_level_is_told_to_observers(
    jointlab: Callable[..., CompletedProcess[str]], sequence: Callable[..., Path]
) -> None:
    ran = jointlab("run", sequence(hammer={"peak_force": 150.0}))
    assert ran.returncode == 0, ran.stderr
    assert "hammer set 1: blows of about 150 N" in ran.stderr
