"""The tables of the catalogue, by topic: `measurements` (written once) and `results` (recomputed beside the old)."""

from store.models.base import Base
from store.models.measurements import (
    Blow,
    Calibration,
    Channel,
    Instrument,
    Point,
    Run,
    RunEvent,
    RunInstrument,
    SineRecord,
    Specimen,
)
from store.models.results import (
    Analysis,
    AnalysisParent,
    AnalysisRun,
    Comparison,
    DynamicStiffness,
    FrequencyResponse,
    FrequencyResponseSet,
    JointElement,
    JointMatrix,
    Mode,
    ModeSet,
)

__all__ = [
    "Analysis",
    "AnalysisParent",
    "AnalysisRun",
    "Base",
    "Blow",
    "Calibration",
    "Channel",
    "Comparison",
    "DynamicStiffness",
    "FrequencyResponse",
    "FrequencyResponseSet",
    "Instrument",
    "JointElement",
    "JointMatrix",
    "Mode",
    "ModeSet",
    "Point",
    "Run",
    "RunEvent",
    "RunInstrument",
    "SineRecord",
    "Specimen",
]
