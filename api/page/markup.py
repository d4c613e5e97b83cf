"""Small pieces of HTML with everything escaped: tables, lists of terms, links and filter forms."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from types import MappingProxyType

from nicegui import ui

from jointlab.report.section import THIN, Share, Table, Unknown


@dataclass(frozen=True)
class Link:
    """A link; one that leads away from the views, and so from STOP, opens in a new tab."""

    text: str
    address: str
    new_tab: bool = False


@dataclass(frozen=True)
class Choice:
    """A box to tick, of the form with an id; what is ticked is a value in the address that the form goes to."""

    form: str
    name: str
    value: str
    label: str


Cell = str | Link | Choice | Unknown | Share
DAY: Sequence[str] = ("day",)
"""Choices of a field that is a day."""
NOTHING: Mapping[str, str] = MappingProxyType({})
NARROW, MANY = 3, 8
"""Columns that a table may have on a phone, and on a small screen without being drawn smaller."""


def table(caption: str, head: Sequence[str], rows: Iterable[Sequence[Cell]]) -> str:
    """A table; on a phone the cells of a row stand below each other, each beside its heading, if there are many."""
    columns = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in head)
    body = "".join(f"<tr>{''.join(map(_cell, row, head))}</tr>" for row in rows)
    kinds = " ".join(kind for kind, most in (("rows", NARROW), ("many", MANY)) if len(head) > most)
    stacked = f' class="{kinds}"' if kinds else ""
    return (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(caption)}"><table{stacked}>'
        f"<caption>{escape(caption)}</caption><thead><tr>{columns}</tr></thead><tbody>{body}</tbody></table></div>"
    )


def show_table(made: Table) -> None:
    """Put a table of a section onto the page."""
    show(table(made.caption, made.head, made.rows))


def terms(pairs: Mapping[str, Cell]) -> str:
    """Terms with their values."""
    return f"<dl>{''.join(f'<dt>{escape(term)}</dt><dd>{_inner(cell)}</dd>' for term, cell in pairs.items())}</dl>"


def anchor(link: Link) -> str:
    """A link by itself."""
    if link.new_tab:
        shown = f"{escape(link.text)} <small>(new tab)</small>"
        return f'<a href="{escape(link.address)}" target="_blank" rel="noopener">{shown}</a>'
    return f'<a href="{escape(link.address)}">{escape(link.text)}</a>'


def details(summary: str, inner: str, *, is_open: bool = False) -> str:
    """Something that opens and closes at a click; `inner` is markup already."""
    return f"<details{' open' if is_open else ''}><summary>{escape(summary)}</summary>{inner}</details>"


def filters(
    fields: Mapping[str, tuple[str, str, Sequence[str]]],
    submit: str = "Show",
    kept: Mapping[str, str | Sequence[str]] = NOTHING,
) -> str:
    """A form that puts its fields into the address.

    Args:
        fields: by name: the label, the value, and the choices; without choices it is a free text, with `DAY` a day.
        kept: further values that the address keeps, each one or several.
    """
    inputs = "".join(_field(name, *field) for name, field in fields.items())
    also = (
        (name, value) for name, values in kept.items() for value in ([values] if isinstance(values, str) else values)
    )
    inputs += "".join(f'<input type="hidden" name="{escape(n)}" value="{escape(v)}">' for n, v in also)
    return f'<form class="filters" method="get">{inputs}<button class="act">{escape(submit)}</button></form>'


def tabs(label: str, links: Mapping[str, str], current: str) -> str:
    """Links (text to address), of which `current` is the present one."""
    inner = "".join(
        f'<a href="{escape(address)}"{" aria-current=page" if text == current else ""}>{escape(text)}</a>'
        for text, address in links.items()
    )
    return f'<nav aria-label="{escape(label)}">{inner}</nav>'


def show(markup: str) -> ui.html:
    """Add markup to the page; texts in it were escaped by the functions of this module."""
    return ui.html(markup, sanitize=False).classes("w-full")


def paragraph(text: str, classes: str = "") -> ui.html:
    """A paragraph of plain text."""
    return show(f'<p class="{classes}">{escape(text)}</p>')


def _field(name: str, label: str, value: str, choices: Sequence[str]) -> str:
    if choices is DAY:
        return f'<label>{escape(label)}<input type="date" name="{escape(name)}" value="{escape(value)}"></label>'
    if not choices:
        return f'<label>{escape(label)}<input name="{escape(name)}" value="{escape(value)}"></label>'
    options = "".join(
        f'<option value="{escape(choice)}"{" selected" if choice == value else ""}>{escape(choice or "all")}</option>'
        for choice in ("", *choices)
    )
    return f'<label>{escape(label)}<select name="{escape(name)}">{options}</select></label>'


def _cell(cell: Cell, head: str) -> str:
    """One cell, with its heading for screens on which the row of headings is away."""
    named = f' data-head="{escape(head)}"' if head else ""
    inner = _inner(cell)
    if isinstance(cell, Unknown):
        return f'<td class="unknown" title="{escape(cell.why)}"{named}>{_wrapped(inner)}</td>'
    return f"<td{named}>{_wrapped(inner) if isinstance(cell, Share) else inner}</td>"


def _wrapped(inner: str) -> str:
    """Several pieces as one, which stays beside the heading of its cell."""
    return f"<div>{inner}</div>"


def _inner(cell: Cell) -> str:
    match cell:
        case Link():
            return anchor(cell)
        case Choice(form, name, value, label):
            box = f'<input type="checkbox" form="{escape(form)}" name="{escape(name)}" value="{escape(value)}"'
            return f'<label class="choose">{box} aria-label="{escape(label)}"></label>'
        case Unknown(text, why):
            return f"{escape(text)}<br><small>{escape(why)}</small>"
        case Share(share, text):
            filled = f'<span class="bar" style="width:{100 * min(max(share, 0.0), 1.0):.1f}%"></span>'
            return f'<span class="track">{filled}</span> {escape(text.replace(" ", THIN))}'
        case _:
            return escape(cell)
