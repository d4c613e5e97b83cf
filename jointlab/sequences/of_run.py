"""The sequence that measures a run again: its own one, or the paper's steps on the article of an imported run."""

from typing import Any

from sqlalchemy.orm import Session

from analysis.gap.experiments.next_experiment import NextExperiment
from jointlab.diagnosis.experiment_text import experiment_of
from jointlab.diagnosis.next_sequence import at_level, next_sequence, sequence_for_text
from jointlab.errors import JointlabError
from jointlab.sequences import BUILT_IN, built_in, sequence_of
from rig.sequences.sequence import MOST_ENTRIES, Sequence, SweepStep, sequence_from
from rig.tester.limits import TesterLimits
from store.errors import NotFoundError
from store.exchange.bundle_setup import article_from
from store.measurements.frequency_responses import FrequencyResponseSet, list_frequency_responses
from store.measurements.runs import Run, get_run
from store.results.analyses import get_analysis, latest_analysis
from store.results.diagnoses import get_diagnosis
from store.results.dynamic_stiffness import list_dynamic_stiffness
from store.states import CONFIGURATIONS, HAMMER, AnalysisKind


def sequence_of_run(session: Session, run_id: int) -> Sequence:
    """The sequence that run `run_id` was measured by, or one that measures an imported run again.

    Raises NotFoundError where there is no such run, StoreError, RigError where its stored data make no sequence.
    """
    run = get_run(session, run_id)
    return sequence_of(run) or sequence_from(_on_article_of(session, run), f"sequence of run {run_id}")


def sequence_for_diagnosis(session: Session, diagnosis: int, limits: TesterLimits) -> tuple[str, Sequence]:
    """The experiment that a diagnosis asks for next, in words, and the sequence for it within `limits`.

    Raises:
        NotFoundError: there is no such diagnosis.
        JointlabError: it asks for nothing.
        StoreError, RigError: the stored data make no sequence.
    """
    verdict = get_diagnosis(session, diagnosis).document["verdict"]
    text, experiment = verdict.get("next_experiment"), experiment_of(verdict)
    if not text:
        raise JointlabError(f"diagnosis {diagnosis} does not ask for another experiment")
    base = sequence_of_run(session, get_analysis(session, diagnosis).runs[0])
    if experiment is None:
        return text, sequence_for_text(text, base, limits)
    return text, next_sequence(experiment, base, limits)


def sequence_for_experiment(session: Session, run_id: int, asked: NextExperiment, limits: TesterLimits) -> Sequence:
    """The sequence for an experiment after run `run_id`, within `limits`.

    Raises NotFoundError where there is no such run, StoreError, RigError where its stored data make no sequence.
    """
    return next_sequence(asked, sequence_of_run(session, run_id), limits)


def _on_article_of(session: Session, run: Run) -> dict[str, Any]:
    """The paper's steps with the points, hammer levels, sines and preset of the imported run."""
    article = article_from(run.setup)
    document = built_in(BUILT_IN).model_dump(mode="json", exclude_none=True)
    hammer, sweep = document["steps"]
    try:
        sets = list_frequency_responses(session, run.id)
        levels = [_at_level(hammer, each) for each in sets if each.excitation == HAMMER] or [hammer]
    except NotFoundError:
        levels = [hammer]
    sweep |= {"specimens": [joint.name for joint in article.joints]} | _sines_of(session, run)
    if (preset := (run.setup.get("direct") or {}).get("preset_mm")) is not None:
        sweep |= {"preset_mm": preset}
    own = {"title": run.title, "article_name": run.article, "article": article.model_dump(mode="json")}
    return document | own | {"steps": [*levels, sweep]}


def _sines_of(session: Session, run: Run) -> dict[str, Any]:
    """Fields of a sweep over the mountings, amplitudes and frequencies of an imported run, as far as it has them."""
    if not run.setup.get("direct"):
        return {}
    points = list_dynamic_stiffness(session, latest_analysis(session, run.id, AnalysisKind.DYNAMIC_STIFFNESS).id)
    frequencies = sorted({each.frequency for each in points})
    first, last = frequencies[0], frequencies[-1]
    spacing = {"step": (last - first) / (len(frequencies) - 1)} if last > first else {}
    return {
        "specimens": list(dict.fromkeys(each.specimen for each in points)),
        "configurations": [each for each in CONFIGURATIONS if any(each == point.configuration for point in points)],
        "amplitudes_pp_mm": sorted({each.amplitude_pp_mm for each in points}, reverse=True)[:MOST_ENTRIES],
        "frequencies": {"first": first, "last": last} | spacing,
        "sample_rate": max(SweepStep(step="sweep").sample_rate, 20 * last),
    }


def _at_level(hammer: dict[str, Any], measured: FrequencyResponseSet) -> dict[str, Any]:
    own = {"points": [str(point) for point in measured.inputs]}
    return at_level(hammer | own, measured.peak_force or hammer["peak_force"])
