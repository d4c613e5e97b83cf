"""A technician edits a sequence as text: sees what is wrong, in which line, then keeps it and starts it."""

from pathlib import Path

from playwright.sync_api import Page, expect

from jointlab.sequences import built_in, to_yaml
from simlab.operator_server import OperatorClient
from tests.api.page.axe import grave_faults
from tests.api.page.technician import Tab

EDITOR = "/page/measure?sequence=paper&as=text"


def short_text(blows: int = 2) -> str:
    """The paper's article with one hammer step."""
    document = built_in("paper").model_dump(mode="json", exclude_none=True)
    document["steps"] = [{"step": "hammer", "points": ["1y"], "blows": blows}]
    return to_yaml(document | {"title": "Written by hand"})


def take_file(page: Page, folder: Path, text: str) -> None:
    """Choose a file on this computer."""
    file = folder / "own.yaml"
    file.write_text(text, encoding="utf-8")
    page.get_by_label("Take a file (YAML)").set_input_files(file)


def test_a_text_with_a_fault_is_not_started_and_its_lines_are_told(tab: Tab, tmp_path: Path) -> None:
    page = tab.go(EDITOR)
    expect(page.locator(".cm-content")).to_contain_text("The paper's campaign")
    expect(page.locator("#steps li")).to_have_count(2)
    text = short_text(blows=1)
    line = next(number for number, each in enumerate(text.splitlines(), 1) if "blows" in each)
    take_file(page, tmp_path, text)
    fault = f"line {line}, steps.0.hammer.blows: is 1; it has to be 2 or more"
    expect(page.locator(".faults li")).to_have_text([fault])
    expect(page.get_by_role("button", name="Start")).to_be_disabled()
    take_file(page, tmp_path, short_text().replace("title:", "titel:"))
    expect(page.locator(".faults li")).to_have_count(2)
    take_file(page, tmp_path, "a: [1")
    expect(page.locator(".faults li")).to_contain_text(["not valid YAML"])
    take_file(page, tmp_path, short_text().replace("1y", "99y"))
    expect(page.locator(".faults li")).to_contain_text(["no node for 99y"])


def test_a_text_is_written_kept_and_started(tab: Tab, bench: OperatorClient, tmp_path: Path) -> None:
    page = tab.go(EDITOR)
    take_file(page, tmp_path, short_text(blows=3))
    expect(page.locator("#steps li")).to_have_count(1)
    page.locator(".cm-content").click()
    page.keyboard.press("Control+End")
    page.keyboard.insert_text("  # written here")
    expect(page.get_by_role("button", name="Start")).to_be_enabled()
    page.get_by_label("Name to keep it under").fill("one point")
    page.get_by_role("button", name="Keep").click()
    expect(page.get_by_role("combobox", name="Sequence", exact=True)).to_have_value("one point")
    assert tab.get("/api/sequences/one point").json()["sequence"]["steps"][0]["blows"] == 3
    page.get_by_role("button", name="Start").click()
    expect(page.locator("#prompt")).to_have_text("Take the hammer to 1y")


def test_a_file_that_is_too_large_is_refused_in_words(tab: Tab, tmp_path: Path) -> None:
    page = tab.go(EDITOR)
    take_file(page, tmp_path, "#" * 200_000)
    expect(page.get_by_role("alert").filter(has_text="own.yaml has more than 100000 characters")).to_be_visible()
    expect(page.locator(".cm-content")).to_contain_text("The paper's campaign")


def test_help_for_a_key_is_beside_the_text_and_nothing_is_grave(tab: Tab) -> None:
    page = tab.go(EDITOR)
    page.get_by_text("step: hammer", exact=True).click()
    expect(page.locator(".help").get_by_text("accepted blows at each point; left out: 10")).to_be_visible()
    expect(page.locator("#steps li")).to_have_count(2)
    assert not grave_faults(page)


def test_keys_that_are_typed_press_no_button(tab: Tab, bench: OperatorClient, tmp_path: Path) -> None:
    page = tab.go(EDITOR)
    page.evaluate(
        "document.body.insertAdjacentHTML('beforeend', "
        '\'<button data-key=" " onclick="window.pressed = true">by key</button>\')'
    )
    page.locator(".cm-content").click()
    page.keyboard.type("a b")
    assert page.evaluate("window.pressed") is None
    page.locator("h1").click()
    page.keyboard.press(" ")
    assert page.evaluate("window.pressed") is True
