"""Examinations of the rig: how its instruments are now, what the newest examination found, a new one, earlier ones."""

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from html import escape

from nicegui import ui
from pydantic import ValidationError

from api.page.address import number
from api.page.controls import button, choice, enable
from api.page.formatting import UNKNOWN, duration, in_unit, moment
from api.page.frame import Frame
from api.page.markup import Cell, Link, details, show, table
from api.service.context import Services
from jointlab.commissioning.examination import asked_of
from jointlab.commissioning.warnings import latest_examination, warnings_of
from jointlab.commissioning.wording import TITLES, check_of, limit_text, verdict_text, warning_text
from jointlab.documents.commissioning import ExaminationRequest
from jointlab.drive.phase import Phase
from jointlab.drive.state import RigState
from jointlab.report.section import Unknown
from jointlab.supervision.manager import RunManager
from rig.checks.check import Check, CheckState, Measured, Place
from rig.checks.tester_checks import BY_OPTION
from rig.instruments import EXTERNAL, Instruments
from store.service.commissioning import CommissioningRecord, get_commissioning_record, list_commissioning_records
from store.states import Scope
from store.validation import faults_text

HISTORY = 30
LOOK_AGAIN = 5.0
"""Seconds between two looks for records that another program has signed."""
PLACES = {
    Place.BENCH: "as for a run",
    Place.CALIBRATOR: "accelerometer on the calibrator",
    Place.MASS: "accelerometer on a hanging mass",
}
BEFORE = {
    Place.BENCH: "Specimens out of the tester, nobody at the beam: nothing may move. It takes some 10 s.",
    Place.CALIBRATOR: "Put the accelerometer on the calibrator and switch it on, then press the button.",
    Place.MASS: "Hang the mass with the accelerometer on it. Press the button, then strike it twice within 5 s.",
}
"""What a person does before an examination."""
INSTRUMENTS = {"acquisition": "Acquisition", "thermometer": "Thermometer", "tester": "Tester"}
TRIP = "Trip watchdog and emergency stop, too"
"""Beginning of the label of the box that consents to it."""
StartExamination = Callable[[Mapping[str, object]], Awaitable[None]]
ASKED_BY = "only an examination and a run ask it"


@dataclass(frozen=True)
class ShownExamination:
    """The examinations in the database.

    Attributes:
        records: the newest ones.
        bench: the newest one at the bench; None where the rig was never examined.
        shown: the one that the address names, or the newest one.
    """

    records: tuple[CommissioningRecord, ...]
    bench: CommissioningRecord | None
    shown: CommissioningRecord | None


def find(services: Services, examination: int | None) -> ShownExamination:
    """Read them, of this service's rig, or of every rig where it drives none.

    Raises NotFoundError where there is no `examination` of that number.
    """
    runs = services.runs
    with services.catalogue.reading() as session:
        name = None if runs is None else runs.instruments.rig
        records = tuple(list_commissioning_records(session, rig=name, limit=HISTORY))
        shown = None if examination is None else get_commissioning_record(session, examination)
    bench = None if runs is None else latest_examination(services.catalogue, runs.instruments.rig)
    return ShownExamination(records, bench, shown or (records[0] if records else None))


def warnings_text(runs: RunManager, bench: CommissioningRecord | None) -> str:
    """Why the rig should be examined before a run, by the newest examination at the bench; empty where it need not."""
    found = warnings_of(bench, runs.instruments.channels, runs.commissioning.valid_days)
    said = (escape(_sentence(warning_text(each))) for each in found)
    return "".join(f'<p class="notice">{each}</p>' for each in said)


async def build(frame: Frame, query: Mapping[str, str]) -> None:
    """Build the part."""
    runs, address = frame.services.runs, [query]
    warned = show("").props('role="status"')
    with ui.element("div").classes("cards"):
        with ui.element("section").classes("card"):
            latest = show("<h2>Last examination</h2><p>…</p>")
        place = ui.element("section").classes("card")
    now, checks, history = show(""), show(""), show("")

    async def draw() -> None:
        found = await frame.read(lambda: find(frame.services, number(address[0], "examination")))
        if found is None:
            return
        warned.set_content("" if runs is None else warnings_text(runs, found.bench))
        instruments = None if runs is None else runs.instruments
        now.set_content(instruments_now(instruments, frame.services.rig_state, found.bench))
        latest.set_content(_record(found.shown, is_newest=found.shown in found.records[:1]))
        checks.set_content(_checks(found.shown))
        history.set_content(_history(found.records))

    async def examine(given: Mapping[str, object]) -> None:
        await _examine(frame, given)
        address[0] = {}  # the newest one is shown then
        await draw()

    with place:
        show("<h2>Examine the rig</h2>")
        if runs is None:
            show("<p>This service drives no rig, so that it examines none.</p>")
        elif Scope.CONTROL not in frame.caller.scopes:
            show(f"<p>Only a key with the scope {Scope.CONTROL} examines the rig.</p>")
        else:
            _form(frame, runs, examine)
    frame.refreshes.append(draw)
    ui.timer(LOOK_AGAIN, draw, immediate=False)


def instruments_now(instruments: Instruments | None, state: RigState | None, bench: CommissioningRecord | None) -> str:
    """The state of each instrument: whether it answers now, and the values of the newest examination."""
    if instruments is None or state is None:
        return "<p>This service drives no rig: it has no connection to any instrument.</p>"
    addresses = {
        "acquisition": instruments.daq_address,
        "thermometer": instruments.thermometer_url,
        "tester": instruments.tester_url,
    }
    rows: list[tuple[Cell, ...]] = [
        (title, _now(kind, state, addresses[kind]), _identity(kind, bench), addresses[kind] or "none")
        for kind, title in INSTRUMENTS.items()
    ]
    told = "identity or reading"
    then = told if bench is None else f"{told} at examination {bench.id}, {moment(bench.created_at)}"
    return (
        f"{table('Instruments', ('instrument', 'now', then, 'address'), rows)}"
        '<p class="quiet">Firmware is not known: no instrument of this rig tells it to the program.</p>'
    )


def _now(kind: str, state: RigState, address: str | None) -> Cell:
    if address is None:
        return "this rig has none"
    if kind == "tester" and address == EXTERNAL:
        return Unknown("not asked", "its own software drives it")
    if kind == "tester" and state.tester_silent is not None:
        return f"does not answer: {state.tester_silent}"
    if state.phase is Phase.EXAMINING:
        return "being examined"
    if state.phase.is_of_a_run:
        return f"used by run {state.run_id}"
    return "answers" if kind == "tester" else Unknown("not asked", ASKED_BY)


def _identity(kind: str, bench: CommissioningRecord | None) -> Cell:
    checks = () if bench is None else tuple(map(check_of, bench.checks))
    found = next((each for each in checks if each.subject == kind and each.id in ("identity", "reading")), None)
    if found is None:
        return Unknown("not known", "the rig was not examined with it")
    return _value(found.measured, found.unit) or f"did not answer: {found.advice}"


def _sentence(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}{'' if text.endswith('?') else '.'}"


def _form(frame: Frame, runs: RunManager, examine: StartExamination) -> None:
    """The form: parts to examine, the button that begins, and the progress."""
    chosen = [Place.BENCH]
    shown = show("")

    def choose(value: str) -> None:
        chosen[0] = Place(value)
        shown.set_content(f"<p>{BEFORE[chosen[0]]}</p>")
        trip.set_visibility(chosen[0] is Place.BENCH and runs.instruments.driven_url is not None)
        mass.set_visibility(chosen[0] is Place.MASS)

    choice("Where the sensors are", "place", {place.value: text for place, text in PLACES.items()}, choose)
    trip = ui.checkbox(f"{TRIP}. Hydraulics will be switched on. I confirm that the machine is clear.")
    mass = ui.number("Mass with the accelerometer on it, kg").props("outlined")
    choose(Place.BENCH)

    async def begin() -> None:
        given: dict[str, object] = {"place": chosen[0]}
        if chosen[0] is Place.BENCH:
            given["trip"], trip.value = trip.value, False  # the machine is looked at each time
        if chosen[0] is Place.MASS:
            given["mass"] = mass.value
        await examine(given)

    pressed = button(f"Examine, and sign as {frame.caller.name}", begin, main=True)
    progress = show("").props('aria-live="polite"')

    async def refresh() -> None:
        state = runs.state
        enable(pressed, state.phase is Phase.IDLE)
        progress.set_content(progress_text(state))

    frame.refreshes.append(refresh)


def progress_text(state: RigState) -> str:
    """How far an examination is, or why none can begin; empty where one can."""
    match state.phase:
        case Phase.IDLE:
            return ""
        case Phase.EXAMINING:
            said = escape(_sentence(state.activity))
            return f'<p class="big" id="examining">{said}</p><progress aria-label="examination"></progress>'
        case Phase.UNKNOWN:
            return f"<p>{UNKNOWN}</p>"
        case _:
            return f"<p>Run {state.run_id} is in progress. Wait until it has ended, then try again.</p>"


async def _examine(frame: Frame, given: Mapping[str, object]) -> None:
    try:
        asked = ExaminationRequest.model_validate(given)
    except ValidationError as error:
        frame.tell(faults_text(error.errors(), "value"))
        return
    await frame.actions.drive(
        "examine rig", "rig",
        lambda runs, caller, lease: runs.examine(asked_of(asked, runs.commissioning), caller.name, lease),
    )  # fmt: skip


def _record(record: CommissioningRecord | None, *, is_newest: bool) -> str:
    """One examination: its verdict, who answers for it, and the checks that failed."""
    if record is None:
        return "<h2>Last examination</h2><p>None yet. It looks at every instrument at rest and says what to do.</p>"
    checks = tuple(map(check_of, record.checks))
    age = duration((datetime.now(UTC) - record.created_at).total_seconds())
    title = "Last examination" if is_newest else f"Examination {record.id}"
    parts = [
        f'<h2>{title}</h2><p class="big" id="verdict">{escape(_sentence(verdict_text(record.verdict)))}</p>',
        f"<p>Examination {record.id} of {escape(record.rig)}, sensors {PLACES[Place(record.place)]}, "
        f"{moment(record.created_at)} ({age} ago), signed by {escape(record.who)}.</p>",
        *(f'<p class="notice trouble">{_failed(each)}</p>' for each in checks if each.state is CheckState.FAILED),
    ]
    return "".join(parts)


def _checks(record: CommissioningRecord | None) -> str:
    """The checks of an examination that were not done, and those that were passed."""
    checks = () if record is None else tuple(map(check_of, record.checks))
    parts = list[str]()
    undone = [(each.subject, TITLES[each.id], _need(each)) for each in checks if each.state is CheckState.NOT_DONE]
    if undone:
        parts.append(table("Not done", ("of", "check", "what it needs"), undone))
    passed = [
        (each.subject, TITLES[each.id], _value(each.measured, each.unit), limit_text(each, _value))
        for each in checks
        if each.state is CheckState.PASSED
    ]
    if passed:
        made = table("Passed", ("of", "check", "measured", "compared with"), passed)
        parts.append(details(f"{len(passed)} of {len(checks)} checks passed", made))
    return "".join(parts)


def _need(check: Check) -> str:
    """What a check that was not done needs, with the box of this page in place of the option of a command."""
    return check.advice.replace(BY_OPTION, f": tick “{TRIP}” and examine again")


def _failed(check: Check) -> str:
    measured, limit = _value(check.measured, check.unit), limit_text(check, _value)
    value = f": {escape(measured)}{f' ({escape(limit)})' if limit else ''}" if measured else ""
    return f"<b>{escape(check.subject)}, {escape(TITLES[check.id])}</b>{value}. {escape(_sentence(check.advice))}"


def _value(value: Measured, unit: str) -> str:
    """A measured value, as the page writes it."""
    return value or "" if value is None or isinstance(value, str) else in_unit(value, unit)


def _history(records: tuple[CommissioningRecord, ...]) -> str:
    if len(records) < 2:
        return ""
    rows = [
        (
            Link(str(each.id), f"/page/instruments?examination={each.id}"),
            moment(each.created_at),
            PLACES[Place(each.place)],
            verdict_text(each.verdict),
            each.who,
        )
        for each in records
    ]
    said = "Examinations, newest first" if len(records) < HISTORY else f"The {HISTORY} newest examinations"
    return table(said, ("examination", "at", "sensors", "verdict", "signed by"), rows)
