"""A sequence as text: written here or taken from a file, checked as it is written, with help for each key beside it."""

from collections.abc import Callable
from html import escape
from urllib.parse import urlencode

from nicegui import ui
from nicegui.events import GenericEventArguments
from pydantic import TypeAdapter, ValidationError

from api.page.controls import button, enable
from api.page.frame import Frame
from api.page.markup import details, show
from api.page.starting import Made, automatic_choice, outlook, start
from api.service.access import Caller
from jointlab.documents.fields import Name
from jointlab.errors import JointlabError
from jointlab.sequences import save_sequence
from jointlab.sequences.key_help import KeyGroup, key_help
from rig.sequences.sequence import Sequence, SequenceError
from rig.sequences.sequence_file import sequence_of_text
from store.states import Scope
from store.validation import faults_text

TEXT = "text"
"""Of the field `as` of the address: the sequence is changed as text."""
LOOK = 0.5  # s between two looks at the text
LARGEST = 100_000
"""Characters of a text at most: it is checked whenever it changes, which takes a second for so many."""
_NAME = TypeAdapter[str](Name)
READ_FILE = f"""async (event) => {{
    const [file] = event.target.files;
    event.target.value = "";
    if (file) emit(file.size > {LARGEST} ? null : await file.text(), file.name);
}}"""


def sequence_editor(frame: Frame, text: str) -> None:
    """The text beside the help, then what it would do or what is wrong with it, then the start."""
    with ui.element("section").classes("card w-full"):
        _file_field(frame, lambda read: editor.set_value(read))
        with ui.element("div").classes("editor"):
            editor = ui.codemirror(text, language="YAML", theme="githubLight", line_wrapping=True, indent="  ")
            editor.props('data-editor="the sequence as YAML text"')
            with ui.element("div"):
                faults = show("").props('role="status"')
                show(f"<div>{''.join(map(_group, key_help()))}</div>").classes("help")
        show("<h2>What will be done</h2>")
        steps = show("<p>…</p>")
        automatic = automatic_choice(frame)

        def made() -> Sequence:
            return _checked(editor.value)

        with ui.element("div").classes("row-of"):
            starting = button("Start", lambda: start(frame, made, automatic=automatic.value), main=True)
            name = ui.input("Name to keep it under").props("outlined")
            keeping = button("Keep", lambda: _keep(frame, name.value or "", made))
    looked = list[str]()

    async def look() -> None:
        now = editor.value
        if looked == [now]:
            return
        read = await frame.read(lambda: outlook(frame.services, lambda: _checked(now)))
        if read is None:
            return
        looked[:] = [now]
        sequence, markup = read
        is_right = sequence is not None
        faults.set_content("" if is_right else markup)
        steps.set_content(markup if is_right else "<p>Nothing, as long as the text cannot be measured.</p>")
        for each in (starting, keeping):
            enable(each, is_right)

    ui.timer(LOOK, look)


def _file_field(frame: Frame, take: Callable[[str], object]) -> None:
    """A field for a file of this computer, which the browser reads; `take` gets its text."""

    def read(event: GenericEventArguments) -> None:
        text, name = event.args
        if text is None:
            frame.tell(f"{name} has more than {LARGEST} characters; a sequence has some thousands")
            return
        frame.tell("")
        take(text)

    with ui.element("label").classes("field"):
        ui.html("Take a file (YAML)", sanitize=False, tag="span")
        field = ui.element("input").props('type="file" accept=".yaml,.yml,.json,text/plain"')
    field.on("change", read, js_handler=READ_FILE)


async def _keep(frame: Frame, name: str, made: Made) -> None:
    """Store the sequence under a name, in place of an older one; then it is among those to choose from."""

    def keep(_caller: Caller) -> str:
        try:
            checked = _NAME.validate_python(name)
        except ValidationError as error:
            raise JointlabError(faults_text(error.errors(), "the name")) from error
        with frame.services.catalogue.writing() as session:
            save_sequence(session, checked, made())
        return checked

    kept = await frame.actions.act(Scope.CONTROL, "save sequence", f"sequence {name}", keep)
    if kept is not None:
        ui.navigate.to(f"/measure?{urlencode({'sequence': kept, 'as': TEXT})}")


def _group(group: KeyGroup) -> str:
    keys = "".join(f"<dt><code>{escape(key.key)}</code></dt><dd>{escape(key.text)}</dd>" for key in group.keys)
    return details(group.title, f"<p>{escape(group.about)}</p><dl>{keys}</dl>")


def _checked(text: str) -> Sequence:
    """The sequence of the text. Raises SequenceError, which says what is wrong, in which line."""
    if len(text) > LARGEST:
        raise SequenceError(f"the text has {len(text)} characters; it may have {LARGEST}")
    return sequence_of_text(text, "the text")
