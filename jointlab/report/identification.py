"""The report of an identification: a summary on the first page, contents, and everything else as annexes."""

from collections.abc import Callable
from pathlib import Path

from analysis.inverse.frequency_law import FrequencyLaw
from jointlab.identification.options import Options
from jointlab.identification.pipeline import Identification
from jointlab.report.direct import direct_sections
from jointlab.report.facts import facts_of
from jointlab.report.front import front_sections
from jointlab.report.gap import gap_sections
from jointlab.report.inverse import inverse_sections, levels_section
from jointlab.report.laboratory import NO_LABORATORY, LaboratorySettings
from jointlab.report.page import write_page
from jointlab.report.printing import wanted
from jointlab.report.run_record import RunRecord, read_run_record
from jointlab.report.section import Section
from jointlab.report.signature import Signature, signature_section, unsigned_section
from jointlab.report.standards import standards_section
from jointlab.report.summary import inverse_left_out_section, suspended_section
from store.catalogue import Catalogue


def write_run_report(
    catalogue: Catalogue,
    run_id: int,
    found: Identification,
    path: Path,
    laboratory: LaboratorySettings = NO_LABORATORY,
    standing: str = "",
    still_wanted: Callable[[], object] = wanted,
    *,
    signature: Signature | None = None,
) -> None:
    """Write the report of the identification `found` of a stored run, with its newest diagnosis; see `write_report`.

    Raises:
        StoreError: the database cannot be read.
        JointlabError: the file cannot be written.
    """
    record = read_run_record(catalogue, run_id)
    gap = () if record.diagnosis is None else tuple(gap_sections(record.diagnosis))
    write_report(
        found, path, laboratory=laboratory, record=record, more=gap, standing=standing, still_wanted=still_wanted,
        signature=signature,
    )  # fmt: skip


def write_report(
    found: Identification,
    path: Path,
    *,
    laboratory: LaboratorySettings = NO_LABORATORY,
    record: RunRecord | None = None,
    more: tuple[Section, ...] = (),
    last: tuple[Section, ...] = (),
    standing: str = "",
    still_wanted: Callable[[], object] = wanted,
    signature: Signature | None = None,
) -> None:
    """Write the report of an identification: a summary on the first page, contents, and everything else as annexes.

    Args:
        path: the file, HTML or PDF by its suffix.
        laboratory: that made it.
        record: of the run, or None where it is no stored one.
        more: sections that come before the methods' own.
        last: sections that come after everything, such as those of another bench.
        standing: a sentence on how it compares with the stored identification, or nothing.
        still_wanted: called while a PDF is printed; an error that it raises ends printing and is passed on.
        signature: under it, which needs a `record`; None leaves a line to sign by hand. Who signs notes it in the audit
            log when the file is written (`note_signature`).

    Raises:
        JointlabError: the file cannot be written.
    """
    facts = facts_of(found, laboratory, record)
    sections = [standards_section(facts), *more]
    if found.suspended is not None:
        sections.append(suspended_section(found.suspended))
    if found.inverse is not None:
        sections += inverse_sections(found.inverse, found.measurement)
    elif found.inverse_left_out:
        sections.append(inverse_left_out_section(found))
    if found.levels.found:
        sections.append(levels_section(found.levels))
    sections += [*direct_sections(found), *last]
    said = [_lead(found), *(f"{text}." for text in (choices(found.options), standing) if text)]
    front = [*front_sections(found, facts, record), _signature(found, record, standing, signature)]
    title, lead = found.measurement.title, " ".join(said)
    write_page(title, lead, sections, path, front=front, laboratory=laboratory, still_wanted=still_wanted)


def _signature(found: Identification, record: RunRecord | None, standing: str, signature: Signature | None) -> Section:
    if signature is None:
        return unsigned_section()
    assert record is not None, "only the report of a stored run is signed"
    return signature_section(signature, record, found.measurement.setup_version, standing)


def choices(options: Options) -> str:
    """The options that are not at their defaults, in words; empty where all are."""
    said = []
    if options.free_beam is not None:
        said.append(f"beam without joints from run {options.free_beam}")
    if options.elements is not None:
        said.append(f"elements between nodes: {options.elements}")
    if options.joint_law is not FrequencyLaw.AUTO:
        said.append(f"law of the joints: {options.joint_law}")
    if options.without:
        said.append(f"without the corrections {', '.join(options.without).replace('_', ' ')}")
    if options.regularise is not None:
        said.append(f"joint terms held within {100 * options.regularise:g} % of their size")
    if options.averages_otherwise:
        said.append(f"blows averaged by {options.estimator}, window {options.window}")
    return f"Chosen by hand: {'; '.join(said)}" if said else ""


def _lead(found: Identification) -> str:
    verdicts = [each.verdict.value for each in found.comparison]
    counts = ", ".join(f"{verdicts.count(verdict)} {verdict}" for verdict in sorted(set(verdicts)))
    parts = []
    if found.inverse is not None:
        parts.append(f"{found.inverse.modal.modes.poles.size} modes from {len(found.inverse.measured.inputs)} points")
    if found.suspended is not None:
        parts.append(f"{len(found.suspended.result.elastic.numbers)} modes of the suspended beam")
    if found.measurement.points:
        parts.append(f"{len(found.measurement.points)} sine points")
    if counts:
        parts.append(f"direct against inverse: {counts}")
    return "; ".join(parts) + "."
