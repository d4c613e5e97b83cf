"""YAML files of sequences: plain values of a bounded size, however the file came to be."""

import re
from functools import partial
from pathlib import Path
from typing import Any

import yaml

from rig.sequences.sequence import Sequence, SequenceError, sequence_from
from store.validation import FieldPath

LARGEST_FILE = 1_000_000
"""Bytes of a file at most; a sequence has some thousands."""
MOST_VALUES = 100_000
"""Values of a document at most, where those that an alias (`*`) stands for count each time."""
_YAML_ERRORS = (yaml.YAMLError, ValueError, LookupError, AttributeError, TypeError, OverflowError, RecursionError)
"""Errors that PyYAML raises: its own, and those of Python's constructors for a date such as 2026-13-45."""


class _Loader(yaml.SafeLoader):
    """Takes 70e9 for a number, as YAML 1.2 and JSON do; PyYAML's rules of YAML 1.1 want 70.0e+9."""


NUMBER = re.compile(r"[-+]?([0-9]+(\.[0-9]*)?|\.[0-9]+)[eE][-+]?[0-9]+$")
"""A number with an exponent."""
_Loader.add_implicit_resolver("tag:yaml.org,2002:float", NUMBER, list("-+.0123456789"))


def load_sequence(path: Path) -> Sequence:
    """Read and check a sequence document.

    Raises:
        SequenceError: the file cannot be read, is not YAML, or does not describe a sequence; says what is wrong, where.
    """
    try:
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except OSError as error:
        raise SequenceError(f"{path} cannot be read: {error.strerror or error}") from error
    if len(content) > LARGEST_FILE:
        raise SequenceError(f"{path} has more than {LARGEST_FILE} bytes")
    try:
        return sequence_of_text(content.decode("utf-8"), str(path))
    except UnicodeDecodeError as error:
        raise SequenceError(f"{path} is not UTF-8 text: {error}") from error


def sequence_of_text(text: str, source: str) -> Sequence:
    """Check the YAML text of a sequence, which `source` names in errors.

    Raises SequenceError where it is no YAML or does not describe a sequence; says what is wrong, in which line.
    """
    try:
        document, node = read_yaml(text)
    except _YAML_ERRORS as error:
        raise SequenceError(f"{source}: not valid YAML: {' '.join(str(error).split())}") from error
    return sequence_from(document, source, partial(line_of, node))


def read_yaml(text: str) -> tuple[Any, yaml.Node | None]:
    """The values of a YAML document, and its nodes, which know their lines; None where it is empty.

    Raises yaml.YAMLError and other errors of PyYAML where it is no YAML, or larger than `MOST_VALUES`.
    """
    loader = _Loader(text)
    try:
        document = loader.get_single_node()
        if document is None:
            return None, None
        if (values := _values(document, {})) > MOST_VALUES:
            found = "holds itself" if values == float("inf") else f"has {values:.3g} values with those of its aliases"
            raise yaml.YAMLError(f"the document {found}")
        return loader.construct_document(document), document
    finally:
        loader.dispose()


def line_of(node: yaml.Node | None, place: FieldPath) -> str:
    """The line of a place in a document as far as it exists there, as text such as "line 12, "; empty for the whole."""
    found = None
    for key in place:
        if isinstance(node, yaml.MappingNode):
            pairs = {each.value: (each, value) for each, value in node.value if isinstance(each, yaml.ScalarNode)}
            if key not in pairs:
                continue  # the kind of a step, which is no key
            found, node = pairs[key]
        elif isinstance(node, yaml.SequenceNode) and str(key).isdecimal() and int(key) < len(node.value):
            found = node = node.value[int(key)]
    return "" if found is None else f"line {found.start_mark.line + 1}, "


def _values(node: yaml.Node, known: dict[int, float]) -> float:
    """The number of values below a node and of itself; infinite where it holds itself. `known` are those counted."""
    if id(node) not in known:
        known[id(node)] = float("inf")  # as long as it is not counted
        parts = node.value if isinstance(node, yaml.CollectionNode) else ()
        below = (each for part in parts for each in (part if isinstance(part, tuple) else (part,)))
        known[id(node)] = 1 + sum(_values(each, known) for each in below)
    return known[id(node)]
