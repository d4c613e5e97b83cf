"""An empty catalogue on SQLite and on a real PostgreSQL server that the tests start and stop."""

import json
import shutil
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import closing
from datetime import UTC, date, datetime, timedelta
from pathlib import Path
from types import SimpleNamespace
from uuid import uuid4

import numpy as np
import pytest
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from store.catalogue import Catalogue
from store.dof import StoredDof
from store.exchange.bundle_exchange import export_bundle
from store.instrument import Instrument, StoredChannel
from store.measurements.amendments import amend_setup
from store.measurements.blows import add_blow, add_point
from store.measurements.frequency_responses import FrequencyResponseSet, add_frequency_responses
from store.measurements.runs import finish_run, start_run
from store.measurements.sine_records import SineRecord, add_sine_record
from store.measurements.spools import advance_spool
from store.models.base import Base
from store.models.measurements import BlowWithdrawalRow, CommissioningRecordRow
from store.results.analyses import add_analysis
from store.results.comparisons import Comparison, add_comparisons
from store.results.diagnoses import StoredDiagnosis, add_diagnosis
from store.results.dynamic_stiffness import StoredStiffness, add_dynamic_stiffness
from store.results.joint_matrices import JointMatrix, add_joint_matrix
from store.results.master_curves import StoredMasterCurve, add_master_curve
from store.results.modes import ModeSet, add_modes
from store.service.alarms import NewAlarm, add_alarm, claim_delivery
from store.service.audit import add_audit_entry
from store.service.jobs import add_job
from store.service.keys import add_key, begin_page_session
from store.service.requests import begin_request
from store.service.rig_limits import save_rig_limits
from store.service.sequence_documents import save_sequence_document
from store.states import AlarmKind, AnalysisKind, RunState, Scope
from store.waveforms.waveform import Waveform, WaveformChannel
from tests.databases import LAB, TEMPLATE, Rows, put_rows, rows_of
from tests.fault_proxy import FaultProxy
from tests.postgresql_server import Server


@pytest.fixture
def empty_database_url(database_kind: str, request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """Address of a database without any table."""
    if database_kind == "sqlite":
        yield f"sqlite:///{tmp_path / 'empty.db'}"
        return
    server: Server = request.getfixturevalue("postgresql")
    name = f"empty_{uuid4().hex}"
    server.execute("CREATE DATABASE {}", name)
    yield server.url(name)
    server.execute("DROP DATABASE {}", name)


@pytest.fixture
def proxy(postgresql: Server) -> Iterator[FaultProxy]:
    """A line to the server that can go bad."""
    proxy = FaultProxy(f"{postgresql.folder}/.s.PGSQL.5432")
    yield proxy
    proxy.stop()


@pytest.fixture
def distant_url(database_url: str, database_kind: str, request: pytest.FixtureRequest) -> str:
    """Address of a database with an up-to-date schema and nothing in it, through `proxy` where it is on a server."""
    if database_kind == "sqlite":
        return database_url
    return f"postgresql://postgres@{request.getfixturevalue('proxy').address}/{LAB}"


@pytest.fixture
def catalogue(database_url: str, tmp_path: Path) -> Iterator[Catalogue]:
    with Catalogue.open(database_url, tmp_path / "waveforms") as opened:
        yield opened


@pytest.fixture
def row_counts(catalogue: Catalogue) -> Callable[[], dict[str, int]]:
    """Rows in every table, to show that something stored nothing."""

    def count() -> dict[str, int]:
        with catalogue.reading() as session:
            return {
                name: session.scalar(select(func.count()).select_from(table)) or 0
                for name, table in Base.metadata.tables.items()
            }

    return count


SETUP = {
    "format": "jointlab-bundle/1",
    "beam": {
        "length": 0.914, "height": 0.0254, "width": 0.0507874, "youngs_modulus": 207e9,
        "poisson_ratio": 0.3, "density": 7850.0, "free_damping_ratios": [0.004, 0.001],
    },
    "node_positions": [0.0, 0.06, 0.3, 0.6, 0.85, 0.914],
    "joints": [
        {"name": "I", "node": 2, "inclinations_deg": [-45, 135], "eccentricity": 0.006, "added_mass": 0.0},
        {"name": "II", "node": 5, "inclinations_deg": [45, -135], "eccentricity": 0.006, "added_mass": 0.0},
    ],
    "accelerometer": {"node": 3, "direction": "y", "mass": 0.0},
    "direct": {"preset_mm": 0.5},
    "tolerances": {
        "node_position": 0.001, "sensor_gain": 0.005, "youngs_modulus": 0.005, "density": 0.003,
        "impact_position": 0.0015, "inclination_deg": 0.5, "tester_gain": 0.003,
    },
}  # fmt: skip
STARTED = datetime(2026, 3, 4, 9, 30, tzinfo=UTC)
HAMMER = StoredChannel(
    "hammer", "cDAQ1Mod1/ai0", "force", "N", 0.0023, -2000.0, 2000.0, 0.004,
    Instrument("hammer", "086C03", "4711", date(2026, 1, 15), 0.0023, "V/N"),
)  # fmt: skip
ACCELEROMETER = StoredChannel(
    "accelerometer", "cDAQ1Mod1/ai1", "acceleration", "m/s^2", 0.0102, -500.0, 500.0, 0.004,
    Instrument("accelerometer", "352C33", "1234", date(2026, 1, 16), 0.0102, "V/(m/s^2)"),
)  # fmt: skip


def two_channels(first: str, first_unit: str, second: str, second_unit: str) -> Waveform:
    counts = np.random.default_rng(5).integers(-(2**20), 2**20, (2, 100), dtype=np.int32)
    channels = (
        WaveformChannel(first, first_unit, (0.0, 1e-6), 0.0023),
        WaveformChannel(second, second_unit, (0.0, 1e-6), 0.0102),
    )
    return Waveform(channels, counts, 5120.0, STARTED, trigger_index=10)


@pytest.fixture
def samples() -> SimpleNamespace:
    """What `filled` stores, and the functions that make it."""
    return SimpleNamespace(
        setup=SETUP, started=STARTED, hammer=HAMMER, accelerometer=ACCELEROMETER, comparisons=COMPARISONS,
        waveform=two_channels, dynamic_stiffness=dynamic_stiffness, frequency_responses=frequency_response_set,
        modes=mode_set, joint_matrix=joint_matrix,
    )  # fmt: skip


@pytest.fixture(scope="session")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small bundle: what `filled` holds, exported."""
    folder = tmp_path_factory.mktemp("exported")
    with Catalogue.open(f"sqlite:///{folder / 'lab.db'}") as opened:
        hammer, sweep = fill(opened)
        export_bundle(opened, hammer, folder / "bundle", also=[sweep])
    return folder / "bundle"


@pytest.fixture
def bundle(exported: Path, tmp_path: Path) -> Path:
    """A copy of the small bundle without its checksums, to be damaged."""
    folder = tmp_path / "bundle"
    shutil.copytree(exported, folder)
    document = json.loads((folder / "setup.json").read_text())
    del document["checksums"]
    (folder / "setup.json").write_text(json.dumps(document))
    return folder


@pytest.fixture(scope="session")
def filled_sqlite(sqlite_template: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what `filled` puts into SQLite, to be copied: that is faster than to make it."""
    folder = tmp_path_factory.mktemp("filled-sqlite")
    shutil.copy(sqlite_template, folder / "lab.db")
    with Catalogue.open(f"sqlite:///{folder / 'lab.db'}", folder / "waveforms") as opened:
        assert fill(opened) == FILLED
    return folder


@pytest.fixture(scope="session")
def filled_postgresql(postgresql: Server, tmp_path_factory: pytest.TempPathFactory) -> tuple[Rows, Path]:
    """What `filled` puts into PostgreSQL, and the folder of its waveforms."""
    waveforms = tmp_path_factory.mktemp("filled-postgresql") / "waveforms"
    postgresql.execute("CREATE DATABASE {} TEMPLATE {}", "filled", TEMPLATE)
    with Catalogue.open(postgresql.url("filled"), waveforms) as opened:
        assert fill(opened) == FILLED
    return rows_of(postgresql, "filled"), waveforms


@pytest.fixture
def filled(catalogue: Catalogue, database_kind: str, request: pytest.FixtureRequest, tmp_path: Path) -> int:
    """A hammer run and a sweep of one article, measured here, with every kind of result; the hammer run's number."""
    if database_kind == "sqlite":
        folder: Path = request.getfixturevalue("filled_sqlite")
        waveforms = folder / "waveforms"
        with (
            closing(sqlite3.connect(folder / "lab.db")) as whole,
            closing(sqlite3.connect(tmp_path / "lab.db")) as empty,
        ):
            whole.backup(empty)
    else:
        rows, waveforms = request.getfixturevalue("filled_postgresql")
        put_rows(request.getfixturevalue("postgresql"), LAB, rows)
    shutil.copytree(waveforms, catalogue.waveforms.folder, dirs_exist_ok=True)
    return FILLED[0]


FILLED = 1, 2
"""Numbers of the hammer run and the sweep that `fill` adds to an empty catalogue."""


def fill(catalogue: Catalogue) -> tuple[int, int]:
    """A hammer run and a sweep with every kind of result and request; their numbers."""
    hammer = _hammer_run(catalogue)
    sweep, record = _sweep(catalogue)
    with catalogue.writing() as session:
        _add_results(session, hammer, sweep, record)
        _add_requests(session)
    return hammer, sweep


def _hammer_run(catalogue: Catalogue) -> int:
    with catalogue.writing() as session:
        run = start_run(
            session, kind="hammer", title="beam 3, roving hammer", article="beam 3", setup=SETUP,
            sequence={"points": ["1y", "4y"], "blows": 2}, channels=[HAMMER, ACCELEROMETER],
            instruments=[Instrument("thermometer", "T-100", "99")], started_at=STARTED,
        )  # fmt: skip
    for dof in (StoredDof(1, "y"), StoredDof(4, "y")):
        with catalogue.writing() as session:
            point = add_point(session, run.id, dof)
        for number, reason in enumerate([None, "double hit: second peak 34 % of the first", None], start=1):
            reference = catalogue.waveforms.append(
                run.waveform_file, two_channels("hammer", "N", "accelerometer", "m/s^2")
            )
            with catalogue.writing() as session:
                add_blow(
                    session, point, number, accepted=reason is None, reason=reason, waveform=reference,
                    peak_force=100.0 + number, temperature_c=23.1, struck_at=STARTED,
                )  # fmt: skip
    with catalogue.writing() as session:
        finish_run(session, run.id, RunState.FINISHED)
    return run.id


def _sweep(catalogue: Catalogue) -> tuple[int, int]:
    with catalogue.writing() as session:
        run = start_run(
            session, kind="sweep", title="beam 3, sweep", article="beam 3", setup={}, started_at=STARTED,
            instruments=[Instrument("tester", "servo-hydraulic", "7", details={"register_map": 1})],
        )  # fmt: skip
    reference = catalogue.waveforms.append(run.waveform_file, two_channels("displacement", "m", "force", "N"))
    with catalogue.writing() as session:
        record = SineRecord(1, "I", "shear", 0.1, 0.0998, 5.0, 1.5, STARTED, 23.2, reference)
        number = add_sine_record(session, run.id, record)
        finish_run(session, run.id, RunState.STOPPED, "stopped by the operator")
    return run.id, number


def dynamic_stiffness(record: int | None = None) -> list[StoredStiffness]:
    """Two amplitudes at two frequencies, as the direct method gives them."""
    return [
        StoredStiffness(
            order_number=order, elapsed=1.5 * order, specimen="I", configuration="shear", amplitude_pp_mm=amplitude,
            frequency=frequency, stiffness=7e5 / amplitude, damping=7e4, loss_factor=0.1 * amplitude,
            magnitude=7.1e5, loss_angle_deg=5.7, stiffness_se=700.0, damping_se=600.0, loss_factor_se=0.001,
            magnitude_se=700.0, loss_angle_se_deg=0.05, degrees_of_freedom=23.0, stiffness_damping_covariance=-2e4,
            reached_frequency=frequency,
            reached_pp_mm=0.94 * amplitude, reached_pp_se_mm=1e-4, thd_percent=0.4, thd_se_percent=0.02,
            thd_displacement_percent=0.1, thd_displacement_se_percent=0.03, loop_energy=5.5e-4, loop_energy_se=2e-6,
            loop_energy_excess=-1e-6, loop_energy_excess_se=4e-7, shared_errors={"blank 1": (30.0, -2.5)},
            temperature_c=23.2, flags=("first harmonic insufficient",) if order == 4 else (),
            sine_record_id=record if order == 1 else None,
        )
        for order, (amplitude, frequency) in enumerate([(0.1, 5.0), (0.1, 10.0), (0.05, 5.0), (0.05, 10.0)], start=1)
    ]  # fmt: skip


def frequency_response_set() -> FrequencyResponseSet:
    rng = np.random.default_rng(3)
    return FrequencyResponseSet(
        number=1, response=StoredDof(3, "y"), inputs=(StoredDof(1, "y"), StoredDof(4, "y")),
        frequency=np.arange(9) / 2.0, accelerance=rng.normal(size=(2, 9)) + 1j * rng.normal(size=(2, 9)),
        averages=2, peak_force=102.0,
        temperature_c=23.1, window="none", sample_rate=5120.0, block_seconds=2.0, estimator="H1",
        coherence=rng.uniform(size=(2, 9)), variance=rng.uniform(size=(2, 9)),
    )  # fmt: skip


def mode_set() -> ModeSet:
    rng = np.random.default_rng(4)
    return ModeSet(
        frequency=np.array([77.1, 79.4]), loss_factor=np.array([0.05, 0.06]),
        dofs=(StoredDof(1, "y"), StoredDof(4, "y")),
        shapes=rng.normal(size=(2, 2)) + 1j * rng.normal(size=(2, 2)),
        frequency_ci95=np.array([[77.0, 77.2], [np.nan, np.nan]]),
        loss_factor_ci95=np.array([[0.04, 0.06], [0.05, 0.07]]),
        predicted_frequency=np.array([77.2, np.nan]), pole_covariance=np.eye(4), shape_covariance=np.ones((2, 4, 4)),
    )  # fmt: skip


def joint_matrix(joint: str, node: int) -> JointMatrix:
    stiffness = np.array([[2.6e6, 9e5, 1.0], [9e5, 2.6e6, 2.0], [1.0, 2.0, 300.0]])
    interval = np.stack([0.97 * stiffness, 1.03 * stiffness], axis=-1)
    loss_factor = np.full((3, 3), 0.1)
    loss_factor[0, 2] = np.nan
    observable = np.eye(3) > 0
    return JointMatrix(
        joint, node, stiffness, 0.1 * stiffness, interval, 0.1 * interval, loss_factor,
        np.stack([0.9 * loss_factor, 1.1 * loss_factor], axis=-1), observable, np.diag(np.arange(12.0)),
    )  # fmt: skip


COMPARISONS = [
    Comparison("I", "k22", (2.5e6, 2.7e6), (2.55e6, 2.6e6), "agree", frequency=79.0, amplitude_pp_mm=0.01),
    Comparison("I", "gamma22", (0.05, 0.06), (0.07, 0.08), "differ", reason="zero lies outside"),
    Comparison("I+II", "k11", None, (5.5e6, 5.7e6), "not comparable"),
]


def _add_results(session: Session, hammer: int, sweep: int, record: int) -> None:
    def analysis(kind: AnalysisKind, method: str, *runs: int, parents: tuple[int, ...] = ()) -> int:
        return add_analysis(session, kind=kind, method=method, settings={"order": 20}, runs=runs, parents=parents)

    responses = analysis(AnalysisKind.FREQUENCY_RESPONSES, "H1", hammer)
    add_frequency_responses(session, responses, hammer, frequency_response_set())
    modes = analysis(AnalysisKind.MODES, "LSCF", hammer, parents=(responses,))
    add_modes(session, modes, mode_set())
    joints = analysis(AnalysisKind.JOINT_MATRICES, "modal", hammer, parents=(modes,))
    for joint, node in (("I", 2), ("II", 5)):
        add_joint_matrix(session, joints, joint_matrix(joint, node))
    direct = analysis(AnalysisKind.DYNAMIC_STIFFNESS, "sine fit", sweep)
    add_dynamic_stiffness(session, direct, dynamic_stiffness(record))
    compared = analysis(AnalysisKind.COMPARISONS, "intervals", hammer, sweep, parents=(joints, direct))
    add_comparisons(session, compared, COMPARISONS)
    diagnosed = analysis(AnalysisKind.DIAGNOSES, "nested models", hammer, sweep, parents=(responses, direct))
    found = {"verdict": {"status": "explained", "effects": ["sensor_mass"]}}
    add_diagnosis(session, StoredDiagnosis(diagnosed, "explained", ("sensor_mass",), 12.3, 3.1, document=found))
    curve = analysis(AnalysisKind.MASTER_CURVES, "time-temperature superposition", sweep, parents=(direct,))
    add_master_curve(session, master_curve(curve))


def master_curve(analysis: int) -> StoredMasterCurve:
    return StoredMasterCurve(
        analysis_id=analysis, article="beam 3", specimen="I", configuration="shear", amplitude_pp_mm=0.1, shift="wlf",
        reference_c=23.0, lowest_reduced_frequency=0.3, highest_reduced_frequency=4e3, document={"curve": [1.0, 2.0]},
    )  # fmt: skip


def _add_requests(session: Session) -> None:
    # of a blow that was refused already, which changes no count
    session.add(BlowWithdrawalRow(blow_id=2, reason="struck beside", who="bench"))
    key, _ = add_key(session, "bench", [Scope.READ])
    begin_page_session(session, key, datetime.now(UTC), timedelta(hours=1))
    add_audit_entry(session, who="bench", action="start run", target="run 1", outcome="done")
    begin_request(session, "bench", "first", "fingerprint")
    save_sequence_document(session, "short", {"format": "jointlab-sequence/1"})
    amend_setup(session, 2, {}, reason="nothing to correct", who="bench")
    advance_spool(session, "20260304-0123456789ab-01234567", 0, 5)
    save_rig_limits(session, "rig", {"force": 2e3}, "bench")
    examined = {"rig": "rig", "place": "bench", "who": "bench", "verdict": "passed"}
    session.add(CommissioningRecordRow(**examined, checks={"checks": []}, instruments={"instruments": []}))
    add_job(session, "identify", {"run": 1}, "bench")
    add_alarm(session, NewAlarm(AlarmKind.RUN_ENDED, "rig", "run 1 has failed", "run 1 ended", 1))
    claim_delivery(session, "rig", "webhook", STARTED, timedelta(seconds=20), lambda alarm: alarm.text)
