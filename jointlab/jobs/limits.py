"""Limits of jobs: how many of one caller wait, and how long a file of an export is kept."""

import logging
import shutil
import time
from contextlib import suppress
from dataclasses import dataclass

from jointlab.errors import ConflictError
from jointlab.jobs.kinds import SUFFIXES, exports_folder
from store.catalogue import Catalogue
from store.new_file import UNFINISHED

DAY = 86_400.0  # s
log = logging.getLogger(__name__)


class QuotaError(ConflictError):
    """The caller has as many open jobs as allowed."""


@dataclass(frozen=True)
class JobLimits:
    """The limits.

    Attributes:
        open_jobs: jobs of one caller that are queued or running.
        export_days: days for which the file of an export is kept, and what was done of a trial that did not end.
    """

    open_jobs: int = 20
    export_days: float = 30.0


def remove_old_exports(catalogue: Catalogue, days: float) -> int:
    """Remove files of exports and folders of trials older than `days`, finished or not; returns their number."""
    oldest, removed = time.time() - days * DAY, 0
    folder, suffixes = exports_folder(catalogue), (*SUFFIXES.values(), UNFINISHED)
    exports = [path for path in folder.glob("run-*") if path.suffix in suffixes]
    for path in (*exports, *folder.glob("trial-*")):
        with suppress(FileNotFoundError):  # another service of the same database may have removed it
            if path.stat().st_mtime < oldest:
                shutil.rmtree(path) if path.is_dir() else path.unlink()
                removed += 1
    if removed:
        log.info("%s exports and trials that were older than %g days are removed", removed, days)
    return removed
