"""Options of long-running commands: what they write into the log."""

from typing import Annotated, Literal

import typer

from jointlab.logs import LogForm
from jointlab.settings import Settings

LogLevel = Annotated[
    Literal["debug", "info", "warning", "error"] | None,
    typer.Option("--log-level", help="Lowest level of messages that are logged; by default that of the configuration."),
]
LogFormOption = Annotated[
    LogForm | None, typer.Option("--log-form", help="Lines to read, or a JSON object a line; by default as configured.")
]


def with_log_options(settings: Settings, level: str | None, form: LogForm | None) -> Settings:
    """The settings with what was given on the command line."""
    given = {name: value for name, value in (("level", level), ("form", form)) if value is not None}
    return settings.model_copy(update={"log": settings.log.model_copy(update=given)})
