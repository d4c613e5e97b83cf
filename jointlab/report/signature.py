"""Who signs a report: a name on its summary, and an entry of the audit log with the checksum of the file.

An examination of the rig is signed in the same way (`store/service/commissioning.py`). The file itself has no
cryptographic signature.
"""

import hashlib
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from sqlalchemy.orm import Session

from jointlab.report.run_record import RunRecord
from jointlab.report.section import Section, Table
from store.service.audit import add_audit_entry
from store.version import software_version

TO_SIGN_BY_HAND = Table("", ("name", "date", "signature"), (("", "", ""),))


@dataclass(frozen=True)
class Signature:
    """A signature under the report of a run.

    Attributes:
        name: of the person who answers for the report, as it was given with the command.
        who: gave the command: the key of the service, or the login of this computer.
        at: when, UTC.
    """

    name: str
    who: str
    at: datetime


def signature_section(signature: Signature, record: RunRecord, setup_version: int, standing: str) -> Section:
    """Who signed, when, and which results the signature covers.

    Args:
        record: of the run.
        setup_version: of the set-up that the results were computed with.
        standing: a sentence on how they compare with the stored identification, or nothing.
    """
    identification = f"its identification ({standing[0].lower()}{standing[1:]})" if standing else "its identification"
    diagnosis = "no diagnosis" if record.diagnosis_number is None else f"diagnosis {record.diagnosis_number}"
    covers = (
        f"this whole report of run {record.run.id}: {identification}, version {setup_version} of the set-up, "
        f"{diagnosis}, computed by Jointlab {software_version()}; the audit log has the SHA-256 checksum of this file"
    )
    signed = f"{signature.name}, at {signature.at:%Y-%m-%d %H:%M} UTC; command given by {signature.who}"
    return Section("Signature", (Table("", (), (("signed by", signed), ("covers", covers))),))


def unsigned_section() -> Section:
    """An empty line, for a printed report to be signed by hand."""
    return Section("Signature", (TO_SIGN_BY_HAND,))


def note_signature(session: Session, run_id: int, signature: Signature, file: Path) -> None:
    """Note in the audit log that the report of a run was signed, with the SHA-256 checksum of its file.

    Raises:
        OSError: the file cannot be read.
        StoreError: the database refuses.
    """
    checksum = hashlib.sha256(file.read_bytes()).hexdigest()
    add_audit_entry(
        session,
        who=signature.who,
        action="sign report",
        target=f"run {run_id}",
        outcome="done",
        details={"signed_by": signature.name, "checksum": checksum},
    )
