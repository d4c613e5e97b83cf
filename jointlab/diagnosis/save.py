"""Diagnoses in the store."""

from collections.abc import Sequence
from typing import Any

from sqlalchemy.orm import Session

from store.catalogue import Catalogue
from store.results.analyses import add_analysis
from store.results.diagnoses import StoredDiagnosis, add_diagnosis, get_diagnosis, list_diagnoses
from store.states import AnalysisKind


def save_diagnosis(
    session: Session, run_id: int, document: dict[str, Any], without: tuple[str, ...] = (), further: Sequence[int] = ()
) -> int:
    """Store a diagnosis of a run, or of several together, and return its number.

    Args:
        session: a transaction.
        run_id: of the run.
        document: in the format jointlab-diagnosis/1.
        without: ids of effects that were left out of the catalogue.
        further: numbers of the other runs that were diagnosed together with the first one.

    Raises:
        StoreError: there is no such run.
    """
    analysis = add_analysis(
        session,
        kind=AnalysisKind.DIAGNOSES,
        method=document["format"],
        settings={"without": list(without)} if without else {},
        runs=[run_id, *further],
    )
    gap, verdict = document["gap"], document["verdict"]
    add_diagnosis(
        session,
        StoredDiagnosis(
            analysis_id=analysis,
            status=verdict["status"],
            effects=tuple(verdict["effects"]),
            gap_before_percent=gap["before"]["percent"],
            gap_after_percent=gap["after"]["percent"],
            document=document,
        ),
    )
    return analysis


def newest_diagnosis(catalogue: Catalogue, run_id: int) -> StoredDiagnosis | None:
    """The newest diagnosis of a run alone; None where it has none.

    One of several runs together is not counted: its corrected simulation has the sets of all of them.

    Raises:
        StoreError: the database cannot be read.
    """
    with catalogue.reading() as session:
        newest = list_diagnoses(session, run_id=run_id, alone=True, limit=1)
        return get_diagnosis(session, newest[0].analysis_id) if newest else None
