"""An imported run is measured again under its own conditions, so that an experiment after it is one of its kind."""

import csv
from pathlib import Path

import pytest

from analysis.gap.experiments.catalogue import Experiment
from analysis.gap.experiments.next_experiment import NextExperiment
from jointlab.sequences.of_run import sequence_for_experiment, sequence_of_run
from rig.tester.limits import TesterLimits
from simlab.case.bundle import write_case
from simlab.case.draw import CaseKind, draw_case
from store.catalogue import Catalogue
from store.exchange.bundle_exchange import import_bundle


@pytest.fixture
def catalogue(tmp_path: Path) -> Catalogue:
    """With run 1: a bundle of the tester's points at 0.2 and 0.08 mm, 20 to 100 Hz, without shear."""
    write_case(draw_case(5, CaseKind.NONE), tmp_path / "bundle")
    file = tmp_path / "bundle" / "direct.csv"
    with file.open(newline="", encoding="utf-8") as table:
        reader = csv.DictReader(table)
        names, rows = list(reader.fieldnames or ()), list(reader)
    amplitudes = sorted({row["amplitude_pp_mm"] for row in rows}, key=float)[:2]
    others = dict(zip(amplitudes, ("0.08", "0.2"), strict=True))
    kept = [
        row | {"amplitude_pp_mm": others[row["amplitude_pp_mm"]]}
        for row in rows
        if row["amplitude_pp_mm"] in others and row["configuration"] != "shear"
        and 20 <= float(row["frequency_hz"]) <= 100 and float(row["frequency_hz"]) % 10 == 0
    ]  # fmt: skip
    with file.open("w", newline="", encoding="utf-8") as table:
        writer = csv.DictWriter(table, names)
        writer.writeheader()
        writer.writerows(kept)
    opened = Catalogue.open(f"sqlite:///{tmp_path / 'lab.db'}")
    import_bundle(opened, tmp_path / "bundle")
    return opened


def test_the_sweep_of_an_imported_run_is_measured_again_as_it_was(catalogue: Catalogue) -> None:
    with catalogue, catalogue.reading() as session:
        sweep = sequence_of_run(session, 1).sweep
    assert sweep is not None
    assert sweep.amplitudes_pp_mm == (0.2, 0.08)
    assert sweep.configurations == ("compression", "angled")
    assert sweep.frequencies.values == pytest.approx([20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 90.0, 100.0])


def test_half_the_smallest_amplitude_is_that_of_the_imported_run(catalogue: Catalogue) -> None:
    asked = NextExperiment(Experiment.HALF_AMPLITUDE, information=1.0, doubt=1.0)
    with catalogue, catalogue.reading() as session:
        sweep = sequence_for_experiment(session, 1, asked, TesterLimits()).sweep
    assert sweep is not None
    assert sweep.amplitudes_pp_mm == (0.04,)
