"""Objects that others wrote: by the name of an entry point, by module and name, or by file and name."""

import importlib
import importlib.util
import sys
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

from jointlab.errors import JointlabError

FILE_PREFIX = "plug_in_"
"""Before the name of a module that is a file of a user: `json.py` must not take the place of another module `json`."""


def plug_in(group: str, name: str, what: str) -> Any:
    """The object `name`: an entry point of `group`, `package.module:object` or `file.py:object`.

    Raises:
        JointlabError: there is none of that name, or it cannot be imported; `what` says what it should have been.
    """
    offered = dict[str, EntryPoint]()
    for each in entry_points(group=group):
        first = offered.setdefault(each.name, each)
        if each.name == name and first.value != each.value:
            raise JointlabError(f"two packages offer the {what} {name}: {first.value} and {each.value}; uninstall one")
    return loaded(offered[name]) if name in offered else object_named(name, what, sorted(offered))


def object_named(name: str, what: str, offered: list[str]) -> Any:
    """Any object of a module or a file.

    Raises:
        JointlabError: it cannot be found, with what to write instead.
    """
    where, colon, attribute = name.rpartition(":")
    if not colon:
        known = f", or one of {', '.join(offered)}" if offered else ""
        raise JointlabError(f"{name!r} names no {what}: write package.module:object or file.py:object{known}")
    module = _file(Path(where)) if where.endswith(".py") else _module(where)
    if not hasattr(module, attribute):
        raise JointlabError(f"{where} has no {attribute!r}")
    return getattr(module, attribute)


def _module(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except (Exception, SystemExit) as error:  # a module of others may raise anything when it is imported
        raise JointlabError(f"{name} cannot be imported: {type(error).__name__}: {error}") from error


def _file(path: Path) -> Any:
    name = FILE_PREFIX + path.stem
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None or not path.is_file():
        raise JointlabError(f"there is no file {path}")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:  # a file of others may raise anything when it is run
        raise JointlabError(f"{path} cannot be run: {type(error).__name__}: {error}") from error
    return module


def loaded(entry: EntryPoint) -> Any:
    """The object of an entry point.

    Raises:
        JointlabError: it cannot be imported.
    """
    try:
        return entry.load()
    except (Exception, SystemExit) as error:  # a package of others may raise anything when it is imported
        raise JointlabError(f"the plug-in {entry.name} ({entry.value}) cannot be imported: {error}") from error
