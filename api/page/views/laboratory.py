"""The laboratory: instruments that were ever used with their calibrations, limits in force, keys, and the audit log."""

from collections.abc import Awaitable, Callable, Mapping
from datetime import UTC, datetime, timedelta
from functools import partial
from html import escape

from nicegui import ui

from api.page.controls import button
from api.page.formatting import WHOLE_LIST, due, moment, quantity
from api.page.frame import Frame
from api.page.instruments.channel_table import kind_words
from api.page.markup import Cell, filters, show, table, tabs
from api.service.access import Caller
from api.service.context import Services
from jointlab import access_keys
from rig.tester.limits import TesterLimits
from store.measurements.instruments import (
    InstrumentCalibration,
    KnownInstrument,
    list_calibrations,
    list_known_instruments,
)
from store.service.audit import AuditEntry, list_audit_entries
from store.service.keys import ApiKey, add_key, list_keys
from store.states import Scope

KNOWN, KEYS, AUDIT = "Sensors and limits", "Keys", "Audit log"
KEY_DAYS = 365


async def build(frame: Frame, query: Mapping[str, str]) -> None:
    """Build the part that the address names."""
    part = query.get("part", KNOWN)
    show(tabs("parts", {name: f"/page/laboratory?part={name}" for name in (KNOWN, KEYS, AUDIT)}, part))
    if part == KEYS:
        await _keys(frame)
    elif part == AUDIT:
        await _audit(frame, query)
    else:
        await _instruments(frame)
        _limits(frame)
    show('<form method="post" action="/page/log-out"><button class="act">Log out</button></form>')


def _known(services: Services) -> list[tuple[KnownInstrument, list[InstrumentCalibration]]]:
    with services.catalogue.reading() as session:
        return [
            (each, list_calibrations(session, each.id)) for each in list_known_instruments(session, limit=WHOLE_LIST)
        ]


async def _instruments(frame: Frame) -> None:
    known = await frame.read(lambda: _known(frame.services))
    if known is None:
        return
    rows = [
        (
            kind_words(each.kind),
            each.model,
            each.serial,
            ", ".join(due(found.calibrated_on, found.due_on) for found in calibrations),
        )
        for each, calibrations in known
    ]
    if rows:
        show(table("Instruments that were ever used", ("kind", "model", "serial", "calibrated on"), rows))
    else:
        show("<p>No instrument was used yet; they are noted with the first run.</p>")


def _limits(frame: Frame) -> None:
    runs = frame.services.runs
    if runs is None:
        return
    show(table("Limits of the tester that runs keep to", ("limit", "value"), limit_rows(runs.instruments.limits)))


def limit_rows(limits: TesterLimits) -> list[tuple[str, str]]:
    """The limits in words, each with the unit in which it is set on the page."""
    return [
        ("amplitude, peak to peak", f"at most {quantity(1e3 * limits.amplitude_pp, 'mm')}"),
        ("frequency", f"{quantity(limits.lowest_frequency, 'Hz')} to {quantity(limits.highest_frequency, 'Hz')}"),
        (
            "preset (mean displacement)",
            f"{quantity(1e3 * limits.lowest_preset, 'mm')} to {quantity(1e3 * limits.highest_preset, 'mm')}",
        ),
        ("velocity", f"at most {quantity(limits.velocity, 'm/s')}"),
        ("acceleration", f"at most {quantity(limits.acceleration, 'm/s²')}"),
        ("force", f"at most {quantity(limits.force / 1e3, 'kN')}"),
    ]


def _stored_keys(services: Services) -> list[ApiKey]:
    return services.catalogue.read(list_keys, limit=WHOLE_LIST)


async def _keys(frame: Frame) -> None:
    if Scope.ADMIN not in frame.caller.scopes:
        show(f"<p>Only a key with the scope {Scope.ADMIN} manages keys.</p>")
        return
    listed, place, known = show(""), ui.element("div").classes("row-of"), dict[int, ui.element]()

    async def draw() -> None:
        keys = await frame.read(lambda: _stored_keys(frame.services))
        if keys is None:
            return
        listed.set_content(table("Keys", ("key", "name", "scopes", "made", "ends", "revoked"), map(_key, keys)))
        for key in keys:
            if key.id not in known:
                with place:
                    known[key.id] = _to_revoke(frame, key, draw)
            known[key.id].set_visibility(key.is_valid(datetime.now(UTC)))

    await draw()
    show(f"<h2>Make a key</h2><p>It ends after {KEY_DAYS} days.</p>")
    with ui.element("div").classes("row-of"):
        name = ui.input("Name of the person or program").props("outlined")
        chosen = {scope: ui.checkbox(scope.value, value=scope is Scope.READ) for scope in Scope}
    secret = show("").props('aria-live="polite"')

    async def make() -> None:
        scopes = [scope for scope, box in chosen.items() if box.value]

        def add(_caller: Caller) -> str:
            ends = datetime.now(UTC) + timedelta(days=KEY_DAYS)
            with frame.services.catalogue.writing() as session:
                return add_key(session, name.value or "", scopes, ends)[1]

        made = await frame.actions.act(Scope.ADMIN, "create key", f"key of {name.value}", add, scopes=" ".join(scopes))
        if made is not None:
            secret.set_content(
                f'<p class="notice">The new key, shown only now: <code id="secret">{escape(made)}</code></p>'
            )
            await draw()

    button("Make the key", make, main=True)


def _to_revoke(frame: Frame, key: ApiKey, draw: Callable[[], Awaitable[None]]) -> ui.element:
    """The buttons that revoke a key after a confirmation; they stay, as a press on one that is replaced is lost."""

    def confirm(is_asked: bool) -> None:
        ask.set_visibility(not is_asked)
        for element in (yes, keep):
            element.set_visibility(is_asked)

    with ui.element("div").classes("row-of") as place:
        ask = button(f"Revoke key {key.id}", lambda: confirm(True))
        yes = button(f"Yes, key {key.id} ({key.name}) opens nothing any more", partial(_revoke, frame, key.id, draw))
        keep = button(f"Keep key {key.id}", lambda: confirm(False))
    confirm(False)
    return place


async def _revoke(frame: Frame, number: int, draw: Callable[[], Awaitable[None]]) -> None:
    def revoke(_caller: Caller) -> ApiKey:
        with frame.services.catalogue.writing() as session:
            revoked = access_keys.revoke(session, number)
        frame.services.recent_keys.clear()
        return revoked

    if await frame.actions.act(Scope.ADMIN, "revoke key", f"key {number}", revoke) is not None:
        await draw()


def _key(key: ApiKey) -> tuple[Cell, ...]:
    scopes = ", ".join(sorted(key.scopes))
    return str(key.id), key.name, scopes, moment(key.created_at), moment(key.expires_at), moment(key.revoked_at)


def _entries(services: Services, action: str) -> list[AuditEntry]:
    return services.catalogue.read(list_audit_entries, action=action or None, limit=200)


async def _audit(frame: Frame, query: Mapping[str, str]) -> None:
    action, words = query.get("action", ""), query.get("text", "")
    if Scope.ADMIN not in frame.caller.scopes:
        show(f"<p>Only a key with the scope {Scope.ADMIN} reads the audit log.</p>")
        return
    found = await frame.read(lambda: _entries(frame.services, action))
    if found is None:
        return
    show(
        filters({"part": ("Part", AUDIT, (AUDIT,)), "action": ("Action", action, ()), "text": ("Contains", words, ())})
    )
    rows = [
        (moment(entry.at), entry.who, entry.action, entry.target, entry.outcome)
        for entry in found
        if words.lower() in f"{entry.who} {entry.action} {entry.target} {entry.outcome}".lower()
    ]
    if rows:
        show(table("Audit log, newest first", ("time", "caller", "action", "target", "outcome"), rows))
    else:
        show("<p>There is no such entry yet. Every action that moves the machine is noted here.</p>")
