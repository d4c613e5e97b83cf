"""Requests for what the laboratory has: instruments, channels, specimens, sequences."""

from collections.abc import Iterator
from urllib.parse import quote

from jointlab.client.connection import Connection
from jointlab.documents.commissioning import ExaminationDocument
from jointlab.documents.history import HistoryDocument
from jointlab.documents.laboratory import (
    CalibrationDocument,
    ChannelDocument,
    InstrumentDocument,
    NewCalibration,
    SpecimenDocument,
)
from jointlab.documents.runs import NamedSequence, SequenceSummary
from rig.sequences.sequence import Sequence


class LaboratoryRequests:
    """Instruments, channels, specimens and sequences."""

    _connection: Connection

    def examinations(self, rig: str | None = None) -> Iterator[ExaminationDocument]:
        """Examinations of every rig, or of one, newest first."""
        return self._connection.pages(ExaminationDocument, "/examinations", rig=rig)

    def instruments(self, kind: str | None = None) -> Iterator[InstrumentDocument]:
        """Every instrument that was ever used, or those of a kind such as tester, in the order of first use."""
        return self._connection.pages(InstrumentDocument, "/instruments", kind=kind)

    def calibrations(self, instrument: int) -> Iterator[CalibrationDocument]:
        """The calibrations of an instrument, newest first."""
        return self._connection.pages(CalibrationDocument, f"/instruments/{instrument}/calibrations")

    def calibrate(self, instrument: int, certificate: NewCalibration) -> CalibrationDocument:
        """Store a new certificate; needs the scope engineer."""
        path = f"/instruments/{instrument}/calibrations"
        return self._connection.post(CalibrationDocument, path, certificate.model_dump(mode="json"))

    def channels(self, run: int | None = None) -> Iterator[ChannelDocument]:
        """The channel table of a run, by default of the next run."""
        return self._connection.pages(ChannelDocument, "/channels" if run is None else f"/runs/{run}/channels")

    def specimens(self, article: str | None = None) -> Iterator[SpecimenDocument]:
        """Specimens, or those of a test article, in the order of first use."""
        return self._connection.pages(SpecimenDocument, "/specimens", article=article)

    def specimen_history(
        self,
        specimen: int,
        configuration: str | None = None,
        amplitude_pp_mm: float | None = None,
        frequency: float | None = None,
    ) -> HistoryDocument:
        """A specimen over its runs at one point of the tester, with its trend.

        Args:
            specimen: its number, of `specimens`.
            configuration, amplitude_pp_mm, frequency: of the point, as commanded; those of most runs by default.

        Raises:
            ProblemError: it was not measured there; the message says where it was.
        """
        asked = {"configuration": configuration, "amplitude_pp_mm": amplitude_pp_mm, "frequency": frequency}
        return self._connection.get(HistoryDocument, f"/specimens/{specimen}/history", **asked)

    def sequences(self) -> Iterator[SequenceSummary]:
        """All sequences by name, stored and built-in ones."""
        return self._connection.pages(SequenceSummary, "/sequences")

    def sequence(self, name: str) -> Sequence:
        """One sequence, stored or built in."""
        return self._connection.get(NamedSequence, f"/sequences/{quote(name)}").sequence

    def save_sequence(self, name: str, sequence: Sequence) -> Sequence:
        """Store a sequence under a name, in place of the one that was there."""
        body = sequence.model_dump(mode="json")
        return self._connection.put(NamedSequence, f"/sequences/{quote(name)}", body).sequence

    def delete_sequence(self, name: str) -> None:
        """Delete a stored sequence; runs keep their own copy."""
        self._connection.request("DELETE", f"/sequences/{quote(name)}")
