"""Options of commands that ask a running service: its address, and the name of its rig."""

import re
from typing import Annotated

import typer
from pydantic import AnyHttpUrl, TypeAdapter, ValidationError

from jointlab.errors import JointlabError
from jointlab.settings import RIG_NAME, Settings, describe

ServiceOption = Annotated[
    str | None, typer.Option(help="Its address, such as http://127.0.0.1:8000; by default that of the configuration.")
]
RigOption = Annotated[
    str | None, typer.Option(help="Name of the rig, `rig` in its own configuration; by default that of this one.")
]
_ADDRESS = TypeAdapter(AnyHttpUrl)


def service_of(settings: Settings, given: str | None) -> str:
    """The address of the service. Raises JointlabError where what was given is none."""
    if given is None:
        return str(settings.publishing.service)
    try:
        return str(_ADDRESS.validate_python(given))
    except ValidationError as error:
        raise JointlabError(f"--service: {describe(error)}; give an address such as http://127.0.0.1:8000") from error


def rig_of(settings: Settings, given: str | None) -> str:
    """The name of the rig. Raises JointlabError where what was given cannot be one."""
    if given is not None and not re.search(RIG_NAME, given):
        raise JointlabError(f"--rig: {given!r} is no name of a rig; give up to 50 letters, digits, spaces, _ and -")
    return given or settings.rig
