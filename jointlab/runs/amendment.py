"""Amending the article of a run after the measurement: a new version of its setup, which later results refer to."""

import json
import math
from collections.abc import Iterator, Sequence
from typing import Any

from sqlalchemy.orm import Session

from analysis.errors import AnalysisError
from jointlab.errors import ConflictError, JointlabError
from rig.article import check_identifiable
from rig.sequences.sequence import sequence_from
from store.errors import NotFoundError, StoreError
from store.exchange.bundle_setup import Article, article_from, unknown_keys
from store.measurements.amendments import Amendment, amend_setup, lock_setup
from store.measurements.frequency_responses import list_frequency_responses
from store.measurements.runs import Run, get_run
from store.results.analyses import latest_analysis
from store.results.dynamic_stiffness import list_dynamic_stiffness
from store.states import AnalysisKind, RunState
from store.validation import FieldPath, place_text


def changes_of(values: Sequence[str]) -> dict[str, Any]:
    """Changes as `amend_article` takes them, from texts such as beam.length=0.914, whose values are JSON.

    Raises JointlabError where a text has another form.
    """
    changes = dict[str, Any]()
    for text in values:
        path, equals, value = text.partition("=")
        *outer, last = path.split(".")
        place = changes
        try:
            for key in outer:
                place = place.setdefault(key, {})
            if not equals:
                raise ValueError("there is no = in it")
            place[last] = json.loads(value)
        except (ValueError, TypeError, AttributeError, RecursionError) as error:
            raise JointlabError(f"{text}: {error}; write key=value, such as beam.length=0.914") from error
    return changes


def amend_article(session: Session, run_id: int, changes: dict[str, Any], *, reason: str, who: str) -> Amendment:
    """Amend the article of a run; nothing that was recorded or computed before is changed.

    Args:
        run_id: of a run that has begun.
        changes: values of the article, only those that change: ``{"beam": {"length": 0.914}}``. A list is whole.

    Raises:
        NotFoundError: there is no such run.
        ConflictError: it has not begun, or nothing would change.
        JointlabError: there is no such value, a number is not finite, or joints cannot be identified on that article
            from what was measured.
        SequenceError: the sequence of the run does not fit the article: a node or joint that it measures is gone.
    """
    lock_setup(session, run_id)  # somebody else may correct another value in this moment
    run = get_run(session, run_id)
    if run.state is RunState.CREATED:
        raise ConflictError(f"run {run_id} has not begun; plan another one with the right article")
    known = {name: run.setup.get(name) for name in Article.model_fields}
    where = f"the amended article of run {run_id}"
    if unknown := list(unknown_keys(changes, known)):
        raise JointlabError(f"{where}: there is no key {', '.join(unknown)}")
    if faults := list(_not_finite(changes)):
        raise JointlabError(f"{where}: {'; '.join(faults)}")
    try:
        article = article_from(_merged(known, changes))
        setup = run.setup | article.model_dump(mode="json")
        if setup == run.setup:
            raise ConflictError(f"{where}: nothing differs from version {run.setup_version}")
        check_identifiable(article)
        if run.sequence:
            sequence_from(run.sequence | {"article": article.model_dump(mode="json")}, where)
        else:
            _check_imported(session, run, article)
    except (AnalysisError, StoreError) as error:
        raise JointlabError(f"{where}: {error}") from error
    return amend_setup(session, run_id, setup, reason=reason, who=who)


def _not_finite(value: Any, place: FieldPath = ()) -> Iterator[str]:
    """Each number that is not finite, with its place: Python reads NaN and 1e999 as numbers of JSON."""
    match value:
        case dict():
            for key, inner in value.items():
                yield from _not_finite(inner, (*place, key))
        case list():
            for index, inner in enumerate(value):
                yield from _not_finite(inner, (*place, index))
        case float() if not math.isfinite(value):
            yield f"{place_text(place, 'article')}: is {value}, which is no finite number"


def _merged(known: dict[str, Any], changes: dict[str, Any]) -> dict[str, Any]:
    both = {name: (known[name], new) for name, new in changes.items()}
    inner = {name: _merged(*pair) for name, pair in both.items() if all(isinstance(each, dict) for each in pair)}
    return known | changes | inner


def _check_imported(session: Session, run: Run, article: Article) -> None:
    """Check that `article` has the node or joint of each stored accelerance and sine point of an imported run.

    Raises StoreError where it lacks one.
    """
    try:
        for measured in list_frequency_responses(session, run.id):
            for point in (measured.response, *measured.inputs):
                article.check_node(point, f"set {measured.number}")
    except NotFoundError:
        pass  # of the tester only
    try:
        points = list_dynamic_stiffness(session, latest_analysis(session, run.id, AnalysisKind.DYNAMIC_STIFFNESS).id)
    except NotFoundError:
        return  # of the beam only
    if unknown := {point.specimen for point in points} - set(article.specimens):
        raise StoreError(f"there are sine points of {', '.join(sorted(unknown))}, which is not a joint of the article")
