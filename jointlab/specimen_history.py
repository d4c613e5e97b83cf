"""The history of a specimen: one nominal point of the tester over all its runs, with its trend."""

from dataclasses import dataclass

from sqlalchemy.orm import Session

from analysis.direct.trend import change
from analysis.interval import Estimate
from store.errors import NotFoundError
from store.results.specimen_history import HistoryPoint, NominalPoint, nominal_points, specimen_history

DAY = 86400.0
"""Seconds of a day."""
NO_POINTS = (
    "No sine points of this specimen are identified yet. Measure a sweep of it, or import a bundle, then identify the "
    "run: Identify on the page, or jointlab identify RUN."
)


@dataclass(frozen=True)
class SpecimenHistory:
    """One nominal point over all runs of a specimen.

    Attributes:
        point: configuration, amplitude and frequency.
        results: the newest of each run, in the order of measuring.
    """

    point: NominalPoint
    results: tuple[HistoryPoint, ...]

    @property
    def days(self) -> float:
        """Days from the first result to the last."""
        return (self.results[-1].measured_at - self.results[0].measured_at).total_seconds() / DAY

    @property
    def stiffness_change(self) -> Estimate | None:
        """Change of k from the first to the last result by a straight line, as a share; None for too few results."""
        return self._change([each.stiffness for each in self.results])

    @property
    def loss_factor_change(self) -> Estimate | None:
        """Change of gamma from the first to the last result by a straight line, as a share; None for too few."""
        return self._change([each.loss_factor for each in self.results])

    def _change(self, values: list[float]) -> Estimate | None:
        return change([each.measured_at.timestamp() / DAY for each in self.results], values)


def history_of(
    session: Session,
    article: str,
    specimen: str,
    configuration: str | None = None,
    amplitude_pp_mm: float | None = None,
    frequency: float | None = None,
) -> SpecimenHistory:
    """The history of a specimen at a nominal point; of what is not given, the value of most runs is taken.

    Raises:
        NotFoundError: the specimen was not measured, or not at this point; the message says where it was.
    """
    points = nominal_points(session, article, specimen)
    if not points:
        raise NotFoundError(f"{article}, {specimen}: {NO_POINTS}")
    wanted = (configuration, amplitude_pp_mm, frequency)
    fitting = [point for point in points if all(w in (None, v) for w, v in zip(wanted, point, strict=True))]
    if not fitting:
        known = (", ".join(f"{each}" for each in sorted(set(values))) for values in zip(*points, strict=True))
        raise NotFoundError(
            "{}: not measured at this point; its points are {}, at {} mm p-p and {} Hz".format(specimen, *known)
        )
    return SpecimenHistory(fitting[0], tuple(specimen_history(session, article, specimen, fitting[0])))
