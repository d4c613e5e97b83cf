"""The report of an identification, and any sections, as one HTML file that loads nothing from outside."""

from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

import jinja2

from jointlab.errors import JointlabError
from jointlab.identification.options import Options
from jointlab.identification.pipeline import Identification
from jointlab.report.direct import direct_sections
from jointlab.report.inverse import inverse_sections, levels_section
from jointlab.report.section import Section
from jointlab.report.summary import suspended_section
from store.version import software_version


def write_report(
    found: Identification,
    path: Path,
    *,
    more: tuple[Section, ...] = (),
    last: tuple[Section, ...] = (),
    standing: str = "",
) -> None:
    """Write the report of an identification.

    Args:
        found: the identification.
        path: the HTML file.
        more: sections that come before the methods' own.
        last: sections that come after everything, such as those of another bench.
        standing: a sentence on how it compares with the stored identification, or nothing.

    Raises:
        JointlabError: the file cannot be written.
    """
    sections = [*more]
    if found.suspended is not None:
        sections.append(suspended_section(found.suspended))
    if found.inverse is not None:
        sections += inverse_sections(found.inverse, found.measurement)
    if found.levels:
        sections.append(levels_section(found.levels))
    sections += [*direct_sections(found), *last]
    said = [_lead(found), *(f"{text}." for text in (choices(found.options), standing) if text)]
    write_page(found.measurement.title, " ".join(said), sections, path)


def write_page(title: str, lead: str, sections: Sequence[Section], path: Path, *, intervals: str = "95 %") -> None:
    """Write sections as one HTML page that loads nothing from outside.

    Args:
        title, lead: heading, and the sentence under it.
        sections: in order.
        path: the HTML file.
        intervals: confidence of all intervals that do not state their own.

    Raises:
        JointlabError: the file cannot be written.
    """
    text = _template().render(
        title=title,
        lead=lead,
        written=f"{datetime.now(UTC):%Y-%m-%d %H:%M} UTC",
        version=software_version(),
        sections=sections,
        intervals=intervals,
    )
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise JointlabError(f"{path} cannot be written: {error.strerror or error}") from error


def choices(options: Options) -> str:
    """The options that are not at their defaults, in words; empty where all are."""
    said = []
    if options.elements is not None:
        said.append(f"elements between nodes: {options.elements}")
    if options.joint_exponent:
        said.append(f"joints that follow frequency by a power known to {options.joint_exponent:g}")
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


def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("jointlab.report", ""),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("report.html")
