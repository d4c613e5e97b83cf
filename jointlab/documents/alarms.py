"""Documents on alarms."""

from datetime import datetime

from pydantic import BaseModel, Field

from jointlab.documents.fields import OneLine, Request
from store.states import AlarmKind


class DeliveryDocument(BaseModel):
    """What became of the message about an alarm to one channel; times are UTC."""

    channel: str = Field(description="such as webhook or mail")
    attempts: int
    tried_at: datetime | None = Field(description="beginning of the last attempt")
    result: str | None = Field(description="of the last attempt; null while it is under way")
    delivered_at: datetime | None


class AlarmDocument(BaseModel):
    """An alarm; it stands until it is acknowledged. Times are UTC."""

    id: int
    uid: str = Field(description="names it in every message")
    kind: AlarmKind
    rig: str
    run_id: int | None
    text: str
    happened_at: datetime
    acknowledged_at: datetime | None
    acknowledged_by: str | None
    note: str | None
    deliveries: list[DeliveryDocument]


class Acknowledgement(Request):
    """What somebody who has seen an alarm says about it."""

    note: OneLine | None = Field(default=None, description="what was seen, or what was done about it")
