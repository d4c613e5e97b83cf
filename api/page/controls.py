"""Buttons, lists and charts for every view."""

from collections.abc import Callable, Mapping
from html import escape

from nicegui import ui

from api.page.charts.axes import ChartOptions


def button(text: str, press: Callable[[], object], *, main: bool = False, key: str | None = None) -> ui.element:
    """A large button; `key` presses it from the keyboard."""
    element = ui.element("button").classes("act main" if main else "act").props('type="button"')
    if key is not None:
        element.props(f'data-key="{key}"')
    with element:
        ui.html(f"{escape(text)}{_hint(key)}", sanitize=False, tag="span")
    element.on("click", press)
    return element


def enable(element: ui.element, enabled: bool) -> None:
    """Enable or disable a button."""
    if enabled:
        element.props(remove="disabled")
    else:
        element.props("disabled")


def choice(
    label: str, name: str, options: Mapping[str, str], choose: Callable[[str], None], chosen: str | None = None
) -> None:
    """A list with a label, to choose one of `options` (texts by value); at first `chosen`, or the first one."""
    with ui.element("label").classes("field"):
        ui.html(escape(label), sanitize=False, tag="span")
        chooser = ui.element("select").props(f'name="{escape(name)}"')
        with chooser:
            for value, words in options.items():
                option = ui.html(escape(words), sanitize=False, tag="option").props(f'value="{escape(value)}"')
                if value == chosen:
                    option.props("selected")
        chooser.on("change", lambda event: choose(str(event.args)), js_handler="(event) => emit(event.target.value)")


def chart(caption: str, options: ChartOptions, name: str, *, height: str = "21rem") -> ui.echart:
    """A chart with its caption, and buttons that save it as a picture called `name`.

    It is hidden as long as it has no options.
    """
    with ui.element("figure").classes("w-full") as figure:
        ui.html(escape(caption), sanitize=False, tag="figcaption")
        drawn = ui.echart(options).classes("chart").style(f"height:{height}")
        drawn.props["role"], drawn.props["aria-label"] = "img", caption
        ui.html(
            "".join(
                f'<button type="button" data-picture="{form}" data-name="{escape(name)}" '
                f'aria-label="save {escape(caption)} as {form.upper()}">{form.upper()}</button>'
                for form in ("png", "svg")
            ),
            sanitize=False,
        ).classes("chart-tools")
    figure.set_visibility(bool(options))  # in place of a white void, nothing
    return drawn


def redraw(drawn: ui.echart, options: ChartOptions, caption: str = "") -> None:
    """Replace the options of a chart, and its caption where one is given, and show it if it was empty before."""
    assert drawn.parent_slot is not None, "it is in a figure"
    figure = drawn.parent_slot.parent
    figure.set_visibility(True)
    if caption:
        (title, *_) = figure.default_slot.children
        assert isinstance(title, ui.html), "a chart has its caption above it"
        title.set_content(escape(caption))
        drawn.props["aria-label"] = caption
    drawn.options.clear()
    drawn.options.update(options)
    drawn.update()


def _hint(key: str | None) -> str:
    names = {" ": "space"}
    return "" if key is None else f' <span class="key">({names.get(key, key)})</span>'
