"""Limits of jobs: how many of one caller wait, and how long a file of an export is kept."""

import logging
import shutil
import time
from dataclasses import dataclass

from jointlab.errors import ConflictError
from jointlab.jobs.kinds import SUFFIXES, exports_folder
from store.catalogue import Catalogue

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
    """Remove files of exports and folders of trials that are older than `days`; returns their number."""
    oldest, removed = time.time() - days * DAY, 0
    for path in exports_folder(catalogue).glob("run-*"):
        if path.suffix in SUFFIXES.values() and path.stat().st_mtime < oldest:
            path.unlink(missing_ok=True)
            removed += 1
    for path in exports_folder(catalogue).glob("trial-*"):
        if path.stat().st_mtime < oldest:
            shutil.rmtree(path)
            removed += 1
    if removed:
        log.info("%s exports and trials that were older than %g days are removed", removed, days)
    return removed
