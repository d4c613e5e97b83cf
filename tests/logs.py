"""Logging of a process as it was, after something of ours has set it up."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

from jointlab.logs import OURS


@contextmanager
def restored_logging() -> Iterator[None]:
    """Take handlers and levels back that are set within: they would write to streams that are closed by then."""
    root = logging.getLogger()
    handlers, levels = list(root.handlers), {name: logging.getLogger(name).level for name in (*OURS, "")}
    try:
        yield
    finally:
        for handler in [each for each in root.handlers if each not in handlers]:
            root.removeHandler(handler)
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)
