"""Master curves in the store."""

from sqlalchemy.orm import Session

from jointlab.documents.master import MasterDocument, MasterQuestion
from store.results.analyses import add_analysis
from store.results.master_curves import StoredMasterCurve, add_master_curve
from store.states import AnalysisKind

METHOD = "time-temperature superposition"


def save_master(session: Session, question: MasterQuestion, found: MasterDocument) -> int:
    """Store a master curve, and return the number of its analysis.

    Raises:
        StoreError: one of its runs is not there.
    """
    analysis = add_analysis(
        session,
        kind=AnalysisKind.MASTER_CURVES,
        method=METHOD,
        settings=question.model_dump(mode="json", exclude_defaults=True),
        runs=found.runs,
        parents=found.analyses,
    )
    low, high = found.reduced_frequencies_covered
    add_master_curve(
        session,
        StoredMasterCurve(
            analysis_id=analysis,
            article=found.article,
            specimen=found.specimen,
            configuration=found.configuration,
            amplitude_pp_mm=found.amplitude_pp_mm,
            shift=found.shift.value,
            reference_c=found.reference_c,
            lowest_reduced_frequency=low,
            highest_reduced_frequency=high,
            document=found.model_dump(mode="json"),
        ),
    )
    return analysis
