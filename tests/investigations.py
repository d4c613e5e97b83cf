"""What investigations are tested with: small bundles of one simulated bench, and an investigation that waits."""

import json
from dataclasses import replace
from pathlib import Path

from analysis.gap.evidence.verdict import Status
from analysis.gap.experiments.catalogue import Experiment
from analysis.gap.experiments.next_experiment import NextExperiment
from jointlab.diagnosis.investigation import INVESTIGATION, Asked, Budget, Data, Investigation, Probable, Step
from jointlab.jobs.investigations import StoredInvestigation, get_investigation
from simlab.case.bundle import write_case
from simlab.case.draw import Case, CaseKind, draw_case
from store.catalogue import Catalogue
from store.exchange.bundle_exchange import import_bundle
from store.service.jobs import add_job, finish_job, take_job
from tests.bench.sealed_bench import SealedBench
from tests.rewriting import with_fewer_lines, with_fewer_points

HALF_FORCE = Asked(
    NextExperiment(Experiment.HALF_FORCE, ("channel_delay",), information=0.5, doubt=0.9, minutes=14.0),
    "strike again at half the peak force: expected to confirm channel_delay, 56 % of the doubt gone in 14 min",
)
READING = Asked(
    NextExperiment(Experiment.STRIKE_KNOWN_MASS, ("channel_delay",), information=0.2, doubt=0.5, minutes=10.0),
    "strike a known free mass: expected to confirm channel_delay, 45 % of the doubt gone in 10 min",
    {"channel_delay.tau": "s"},
)
NOTHING_MORE = Asked(NextExperiment(Experiment.CORRECT_EFFECTS, ("channel_delay",), doubt=0.5), "correct it")
DELAY = 25e-6
"""s; what an instrument reads of the delay on the bench of seed 5."""
READ = {"channel_delay.tau": DELAY, "contact_patch.length": 0.0}
"""What instruments read on that bench; a few hundredths of a bit decide which is asked for first."""
EVERY = 128
"""Lines, of which one is kept: a delay shows in few."""
MULTIPLES_OF = 40
"""Hz; of the tester's 40 frequencies five are kept, at each mounting and amplitude."""


def case_of(seed: int) -> Case:
    """A bench whose accelerometer is late."""
    return draw_case(seed, CaseKind.SINGLE, ["channel_delay"], 0.5)


def small(seed: int, folder: Path, every: int = EVERY) -> Path:
    """A bundle with a late accelerometer, one line in so many, and few points of the tester."""
    write_case(case_of(seed), folder)
    return with_fewer_points(with_fewer_lines(folder, every), MULTIPLES_OF)


def small_further(seed: int, folder: Path) -> Path:
    """A further bundle of the bench of `small`, struck at half the force; `folder` is made for it."""
    folder.mkdir()
    answer = SealedBench(case_of(seed), folder).carry_out(HALF_FORCE)
    assert isinstance(answer, Data)
    return with_few_lines(Path(answer.source))


def struck_harder(folder: Path, ratio: float) -> Path:
    """The bundle with other peak forces stated; its values stay as they are."""
    setup = folder / "setup.json"
    document = json.loads(setup.read_text(encoding="utf-8"))
    for each in document["inverse"]:
        each["peak_force"] *= ratio
    setup.write_text(json.dumps(document), encoding="utf-8")
    return folder


def with_few_lines(folder: Path) -> Path:
    """The bundle with lines that are quick to diagnose."""
    return with_fewer_lines(folder, EVERY)


def import_as(catalogue: Catalogue, bundle: Path, article: str = "bench 5") -> int:
    """Import a bundle as a run of a test article; its number."""
    return import_bundle(catalogue, bundle, article)


def add_waiting(catalogue: Catalogue, run: int, asked: Asked, *otherwise: Asked) -> StoredInvestigation:
    """Store an investigation as its first job leaves it: a likely delay, and a request without an answer."""
    beside = (Probable(("joint_mass",), 0.2),)
    step = Step(1, Status.EXPLAINED, ("channel_delay",), 0.71, asked, beside=beside, otherwise=otherwise)
    return _add(catalogue, Investigation(str(run), Budget(), (step,)))


def add_spent(catalogue: Catalogue, run: int) -> StoredInvestigation:
    """Store an investigation that has ended because its budget does not allow one experiment."""
    step = Step(1, Status.EXPLAINED, ("channel_delay",), 0.71, ended="budget")
    return _add(catalogue, Investigation(str(run), Budget(experiments=0), (step,)))


def _add(catalogue: Catalogue, state: Investigation) -> StoredInvestigation:
    with catalogue.writing() as session:
        before = INVESTIGATION.dump_python(replace(state, steps=()), mode="json")
        add_job(session, "investigate", {"run": int(state.target), "state": before}, "ann")
        taken = take_job(session, ["investigate"])
        assert taken is not None
        job, token = taken
        finish_job(session, job.id, token, {"state": INVESTIGATION.dump_python(state, mode="json")})
        return get_investigation(session, job.id)
