"""Whether a line calls the program by commands and options that it has."""

import re
import shlex
from typing import Any

import typer

from api.cli import COMMANDS, app, load


def is_known(line: str) -> bool:
    """Whether `jointlab` has the command of a line such as ``jointlab store backup FOLDER``, and its options."""
    words = shlex.split(line)[1:]
    if not words[0].startswith("-") and words[0] not in COMMANDS:
        return False
    command: Any = typer.main.get_command(app) if words[0].startswith("-") else load(words.pop(0))
    while words and words[0] in getattr(command, "commands", ()):
        command = command.commands[words.pop(0)]
    options = {option for parameter in command.params for option in parameter.opts}
    return {word.split("=")[0] for word in words if re.match(r"--?[a-z]", word)} <= options | {"--help"}
