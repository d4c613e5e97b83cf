"""Documents on investigations: what they have found, what they ask for, and the answers to that."""

from datetime import datetime
from typing import Annotated, Self

from pydantic import BaseModel, Field, model_validator

from analysis.gap.experiments.missing_condition import MissingCondition
from jointlab.documents.fields import LARGEST, OneLine, Request
from jointlab.documents.jobs import OfRun
from store.quantity import quantity
from store.states import InvestigationState
from store.validation import TextLike

ENDED = "why it has ended: certain, nothing would help, or budget; null where it has not"
MOST_READINGS = 100
OF_RIG_TIME = "of rig time in all"
AT_MOST = "that are carried out at most"
OF_VERDICT = "probability of the verdict at which it ends"
ReadingName = Annotated[
    str, TextLike(r"^[A-Za-z0-9_.]{1,100}$", "write 1 to 100 letters, digits, underscores and dots")
]


class BudgetDocument(BaseModel):
    """The limits of an investigation."""

    minutes: Annotated[float, quantity("min", OF_RIG_TIME)]
    experiments: int = Field(description=AT_MOST)
    certain: Annotated[float, quantity("1", OF_VERDICT)]


class ExplanationDocument(BaseModel):
    """An explanation of the gap."""

    effects: list[str] = Field(description="empty for none; unknown for a cause that no known effect is")
    probability: Annotated[float, quantity("1", "with all data and readings so far")]


class RequestedDocument(BaseModel):
    """An experiment that is asked for."""

    experiment: str = Field(description="its id, such as half_force")
    text: str
    effects: list[str] = Field(description="that it is expected to tell apart or to confirm")
    tells_apart: bool = Field(description="whether it tells these effects apart, or confirms them")
    information: Annotated[float, quantity("bit", "that is expected of it")]
    doubt: Annotated[float, quantity("bit", "about the explanation before it")]
    minutes: Annotated[float, quantity("min", "of rig time that is expected")]
    readings: dict[str, str] = Field(description="unit of each reading that is wanted; empty where a run is wanted")


class AnswerDocument(BaseModel):
    """An answer to a request; two of its fields are null."""

    run: int | None = None
    readings: dict[str, float] | None = None
    refusal: str | None = None


class MountingDocument(BaseModel):
    """A specimen in the tester."""

    specimen: str
    configuration: str = Field(description="compression, shear or angled")


class MissingDocument(BaseModel):
    """One thing that was asked for and is not in the run that answers."""

    what: MissingCondition
    text: str
    wanted: float | None = Field(description="in `unit`; an amplitude is zero to peak")
    measured: float | None = Field(description="the nearest one in the run, in `unit`")
    unit: str | None = Field(description="N, m or Hz; null where nothing has a value")
    points: list[str] = Field(description="that were not struck as asked for, such as 3y")
    mountings: list[MountingDocument] = Field(description="that were not tested as asked for")


class StepDocument(BaseModel):
    """One step: what is probable with all data so far, what was asked for, and what came of it."""

    number: int
    diagnosis: int | None = Field(description="of all data so far; its document has the verdict before readings")
    status: str = Field(description="of that diagnosis: none, explained, partial or unknown")
    leads: ExplanationDocument
    beside: list[ExplanationDocument] = Field(description="the next probable ones")
    asked: RequestedDocument | None
    otherwise: list[RequestedDocument] = Field(description="of the last step: asked for in turn after refusals")
    answer: AnswerDocument | None
    missing: list[MissingDocument] = Field(description="what was asked for and is not in the run that answers")
    ended: str | None = Field(description=ENDED)


class InvestigationSummary(BaseModel):
    """An investigation in short; times are UTC."""

    id: int
    run: int = Field(description="with the first data")
    state: InvestigationState
    leads: ExplanationDocument | None = Field(description="the leading explanation; null before the first diagnosis")
    ended: str | None = Field(description=ENDED)
    experiments: int = Field(description="that were carried out")
    minutes: Annotated[float, quantity("min", "of rig time that was expected of these")]
    asked_by: str
    created_at: datetime
    changed_at: datetime


class InvestigationDocument(InvestigationSummary):
    """An investigation with all its steps."""

    budget: BudgetDocument
    steps: list[StepDocument]
    job: int = Field(description="the newest job; its events show how far a diagnosis is")
    error: str | None = Field(description="why the newest job has failed")


class NewBudget(Request):
    """The limits of all steps; those that are not given stay as they are, in a new investigation 240, 3 and 0.95."""

    minutes: Annotated[float | None, quantity("min", OF_RIG_TIME, ge=0, le=1e6)] = None
    experiments: int | None = Field(default=None, ge=0, le=1000, description=AT_MOST)
    certain: Annotated[float | None, quantity("1", OF_VERDICT, ge=0, le=1)] = None


class NewInvestigation(NewBudget, OfRun):
    """Which run, and how much may be spent."""


class NewAnswer(Request):
    """The answer to a request: a run with the data, the readings, or why it cannot be made."""

    run: int | None = Field(default=None, ge=1, le=LARGEST, description="with the data that were asked for")
    readings: dict[ReadingName, float] | None = Field(
        default=None, min_length=1, max_length=MOST_READINGS, description="by name, in the unit that was asked for"
    )
    refusal: OneLine | None = Field(default=None, description="why it cannot be made; another experiment is asked for")

    @model_validator(mode="after")
    def _one(self) -> Self:
        if sum(each is not None for each in (self.run, self.readings, self.refusal)) != 1:
            raise ValueError("give one of run, readings and refusal")
        return self
