"""Diagnoses in the store."""

from typing import Any

from sqlalchemy.orm import Session

from store.analyses import add_analysis
from store.catalogue import Catalogue
from store.diagnoses import StoredDiagnosis, add_diagnosis, get_diagnosis, list_diagnoses
from store.states import AnalysisKind


def save_diagnosis(session: Session, run_id: int, document: dict[str, Any], without: tuple[str, ...] = ()) -> int:
    """Store a diagnosis of a run and return its number.

    Args:
        session: a transaction.
        run_id: of the run.
        document: in the format jointlab-diagnosis/1.
        without: ids of effects that were left out of the catalogue.

    Raises:
        StoreError: there is no such run.
    """
    analysis = add_analysis(
        session,
        kind=AnalysisKind.DIAGNOSES,
        method=document["format"],
        settings={"without": list(without)} if without else {},
        runs=[run_id],
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


def latest_diagnosis(catalogue: Catalogue, run_id: int) -> dict[str, Any] | None:
    """The document of a run's newest diagnosis; None where it has none.

    Raises:
        StoreError: the database cannot be read.
    """
    with catalogue.reading() as session:
        newest = list_diagnoses(session, run_id=run_id, limit=1)
        return get_diagnosis(session, newest[0].analysis_id).document if newest else None
