"""Configuration of alarms: the table [alarms] of jointlab.toml. Secrets come from the environment, never from there."""

import os
from typing import Annotated, Literal
from urllib.parse import urlsplit

from pydantic import BaseModel, ConfigDict, Field, SecretStr, field_validator, model_validator

from store.validation import TextLike

WEBHOOK_SECRET, MAIL_PASSWORD = "JOINTLAB_WEBHOOK_SECRET", "JOINTLAB_MAIL_PASSWORD"
"""Variables of the environment with the secrets."""
_ADDRESS = r"^[^\s@<>,;]+@[^\s@<>,;]+$"
_Address = Annotated[str, TextLike(_ADDRESS, "write one address, such as rig@laboratory.example")]
_Bytes = Annotated[
    str, TextLike(r"^([0-9A-Fa-f]{2})*$", "write two hexadecimal digits for each byte, such as A00101A2")
]


class WebhookSettings(BaseModel):
    """A program that is notified by a POST request."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    url: SecretStr = Field(description="http or https; not shown, because the addresses of some services are secrets")

    @field_validator("url")
    @classmethod
    def _has_a_host(cls, url: SecretStr) -> SecretStr:
        text = url.get_secret_value()
        if not text.isascii() or not text.isprintable() or " " in text:
            raise ValueError("an address has ASCII characters without spaces; write others as %XX")
        found = urlsplit(text)
        if found.scheme not in ("http", "https") or not found.hostname or found.username is not None:
            raise ValueError("give an http or https address without a user")
        found.port  # noqa: B018 - raises ValueError where it is no number
        return url


class MailSettings(BaseModel):
    """A mail server that takes the messages, and whom they are for."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    host: str = Field(min_length=1, max_length=253)
    port: int = Field(default=587, ge=1, le=65535)
    security: Literal["starttls", "tls", "none"] = Field(
        default="starttls", description="tls: encrypted from the first byte, usually on port 465"
    )
    user: str | None = Field(default=None, description=f"logs in; its password is in {MAIL_PASSWORD}")
    sender: _Address
    to: tuple[str, ...] = Field(min_length=1, max_length=20)

    @field_validator("to")
    @classmethod
    def _are_addresses(cls, to: tuple[str, ...]) -> tuple[str, ...]:
        for each in to:
            if each.count("@") != 1 or any(sign.isspace() or sign in "<>,;" for sign in each):
                raise ValueError(f"{each!r} is no address")
        return to

    @model_validator(mode="after")
    def _keep_the_password(self) -> "MailSettings":
        if self.user is not None and self.security == "none":
            raise ValueError("a password is not sent without encryption; leave user out, or use starttls or tls")
        return self


class RelaySettings(BaseModel):
    """A lamp or horn on a serial port: on while an alarm is active that nobody has acknowledged."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    url: str = Field(min_length=1, description="serial port or pyserial URL")
    line: Literal["rts", "dtr"] | None = Field(default=None, description="this output of the port is set")
    on: _Bytes = Field(default="", description="bytes that switch it on, hexadecimal")
    off: _Bytes = Field(default="", description="bytes that switch it off, hexadecimal")

    @model_validator(mode="after")
    def _switch(self) -> "RelaySettings":
        if self.line is None and not (self.on and self.off):
            raise ValueError("give line, or both on and off")
        return self


class AlarmSettings(BaseModel):
    """The channels of alarms, and the optional alarms; every alarm is stored and shown on the page."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    webhook: WebhookSettings | None = None
    mail: MailSettings | None = None
    relay: RelaySettings | None = None
    deadline: float = Field(default=20.0, ge=1, le=300, description="s that one attempt to deliver a message may take")
    database_away: float = Field(
        default=60.0, ge=1, le=86_400, description="s for which the database may be away while a run goes on"
    )
    failed_jobs: bool = Field(default=False, description="whether a job that fails raises an alarm")

    @property
    def are_told(self) -> bool:
        """Whether anybody is told."""
        return not (self.webhook is None and self.mail is None and self.relay is None)


def secret_of(variable: str) -> str | None:
    """The secret in a variable of the environment; None where there is none."""
    return os.environ.get(variable) or None
