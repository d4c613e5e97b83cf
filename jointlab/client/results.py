"""Requests for results of runs."""

from collections.abc import Iterator

from jointlab.client.connection import Connection
from jointlab.documents.master import MasterSummary, StoredMasterDocument
from jointlab.documents.overlay import OverlayDocument
from jointlab.documents.results import (
    AnalysisDocument,
    ComparisonDocument,
    FrequencyResponseDocument,
    JointMatrixDocument,
    ModesDocument,
    SetSummary,
    StiffnessPoint,
    TableSummary,
)
from jointlab.documents.stiffness import StiffnessDocument
from store.states import AnalysisKind


class ResultRequests:
    """Results of one run, and of several over each other."""

    _connection: Connection

    def analyses(self, run: int, kind: AnalysisKind | None = None) -> Iterator[AnalysisDocument]:
        """The analyses of a run, newest first; the number of one reads its results."""
        return self._connection.pages(AnalysisDocument, f"/runs/{run}/analyses", kind=kind)

    def accelerance_sets(self, run: int, analysis: int | None = None) -> Iterator[SetSummary]:
        """The roving-hammer sets of a run: the newest accelerances, or those of one analysis."""
        return self._connection.pages(SetSummary, f"/runs/{run}/frequency-responses", analysis=analysis)

    def accelerance(
        self, run: int, set_number: int, point: str, analysis: int | None = None
    ) -> FrequencyResponseDocument:
        """The accelerance of a set from the blows at a point such as 3y: the newest, or that of one analysis."""
        path = f"/runs/{run}/frequency-responses/{set_number}/{point}"
        return self._connection.get(FrequencyResponseDocument, path, analysis=analysis)

    def modes(self, run: int, analysis: int | None = None) -> ModesDocument:
        """The modes of a run: the newest, or those of one analysis."""
        return self._connection.get(ModesDocument, f"/runs/{run}/modes", analysis=analysis)

    def tables(self, run: int) -> Iterator[TableSummary]:
        """The tables of a run's newest results, with their columns."""
        return self._connection.pages(TableSummary, f"/runs/{run}/tables")

    def table(self, run: int, name: str, form: str = "csv") -> bytes:
        """One table of a run's newest results as a ``csv`` or ``parquet`` file."""
        return self._connection.request("GET", f"/runs/{run}/tables/{name}.{form}").content

    def joint_matrices(self, run: int, analysis: int | None = None) -> Iterator[JointMatrixDocument]:
        """The joint matrices of a run: the newest by each inverse method, or those of one analysis."""
        return self._connection.pages(JointMatrixDocument, f"/runs/{run}/joint-matrices", analysis=analysis)

    def dynamic_stiffness(self, run: int, analysis: int | None = None) -> Iterator[StiffnessPoint]:
        """The sine points of a run by the direct method: the newest, or those of one analysis."""
        path = f"/runs/{run}/dynamic-stiffness"
        return self._connection.pages(StiffnessPoint, path, analysis=analysis, limit=1000)

    def stiffness_at(self, run: int, amplitude_pp_mm: float, frequency: float) -> StiffnessDocument:
        """The dynamic stiffness by the fitted law of a run, at an amplitude (mm peak to peak) and a frequency (Hz)."""
        path = f"/runs/{run}/dynamic-stiffness/at"
        return self._connection.get(StiffnessDocument, path, amplitude_pp_mm=amplitude_pp_mm, frequency=frequency)

    def comparisons(self, run: int, analysis: int | None = None) -> Iterator[ComparisonDocument]:
        """The comparison of both methods on a run: the newest, or that of one analysis."""
        return self._connection.pages(ComparisonDocument, f"/runs/{run}/comparisons", analysis=analysis)

    def overlay(
        self,
        *runs: int,
        amplitude_pp_mm: float | None = None,
        point: str | None = None,
        response: str | None = None,
    ) -> OverlayDocument:
        """Results of two to twelve runs over each other.

        Args:
            amplitude_pp_mm: of the sine points, as commanded; that of most runs by default.
            point, response: of the accelerance, such as 3y; the driving point by default.

        Raises:
            ProblemError: the runs do not have that in common; the message says what they have.
        """
        asked = {"amplitude_pp_mm": amplitude_pp_mm, "point": point, "response": response}
        return self._connection.get(OverlayDocument, "/overlay", run=runs, **asked)

    def master_curves(self, article: str | None = None, specimen: str | None = None) -> Iterator[MasterSummary]:
        """Master curves in short, newest first: all, or those of an article and of a specimen."""
        return self._connection.pages(MasterSummary, "/master-curves", article=article, specimen=specimen)

    def master_curve(self, number: int) -> StoredMasterDocument:
        """One master curve: parameters of its shift, curve with bands, points, predictions, what was left out."""
        return self._connection.get(StoredMasterDocument, f"/master-curves/{number}")
