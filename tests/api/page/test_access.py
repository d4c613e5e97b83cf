"""Access to the page: a stranger costs nothing, and a database that is silent stops neither the page nor STOP."""

import signal
import time
from collections.abc import Callable, Iterator

import httpx
import pytest
from playwright.sync_api import expect
from psycopg.sql import SQL, Identifier

from store.catalogue import Catalogue
from store.measurements.runs import start_run
from store.service.jobs import add_job, finish_job, take_job
from store.service.keys import add_key
from store.states import Scope
from tests.api.page.technician import Service, Tab, serving
from tests.postgresql_server import NotInstalledError, Server, running_server
from tests.waiting import LONG

SOCKET = "/page/_nicegui_ws/socket.io/?EIO=4&transport=polling"
NUMBER = 30 * "9"
HEADINGS = ["In short", "Modes", "Accelerances", "Joints", "Tester", "Direct against inverse", "Do with this run"]
"""Of a view with every part of the results."""


@pytest.fixture(scope="module")
def empty(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service without a rig."""
    folder = tmp_path_factory.mktemp("door")
    (folder / "jointlab.toml").write_text("", encoding="utf-8")
    with serving(folder) as service:
        yield service


@pytest.fixture(scope="module")
def on_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Service, Server]]:
    """A service without a rig on PostgreSQL, with a run."""
    folder = tmp_path_factory.mktemp("server")
    (folder / "jointlab.toml").write_text("", encoding="utf-8")
    try:
        with running_server() as server:
            server.execute("CREATE DATABASE {}", "door")
            with serving(folder, server.url("door"), patience=5.0) as service:
                with Catalogue.open(service.database, service.waveforms) as catalogue, catalogue.writing() as session:
                    start_run(session, kind="import", title="seen", article="beam", setup={})
                yield service, server
    except NotInstalledError as error:
        pytest.skip(str(error))


@pytest.mark.parametrize("path", ["/page", "/page/", "/page/measure", "/page/nowhere", "/page/results?run=1"])
def test_a_stranger_is_led_to_the_form(empty: Service, path: str) -> None:
    answer = httpx.get(empty.address + path, timeout=LONG)
    assert (answer.status_code, answer.headers["location"].split("?")[0]) == (307, "/page/log-in")


@pytest.mark.parametrize("path", [SOCKET, "/page/files/1", "/page/tables/1/modes.csv"])
def test_a_stranger_gets_no_socket_and_no_file(empty: Service, path: str) -> None:
    assert httpx.get(empty.address + path, timeout=LONG).status_code == 401


def test_a_key_that_may_not_read_is_refused(empty: Service) -> None:
    with Catalogue.open(empty.database) as catalogue, catalogue.writing() as session:
        _, secret = add_key(session, "who only controls", [Scope.CONTROL])
    with empty.browser(secret) as browser:
        answer = browser.get(SOCKET)
    assert answer.status_code == 403


def test_an_address_of_no_view_says_so_and_has_the_ways_to_all_views(
    empty: Service, open_tab: Callable[[Service], Tab]
) -> None:
    tab = open_tab(empty)
    tab.log_in()
    page = tab.go("/page/overlays?run=1")
    expect(page.get_by_role("heading", name="No such page")).to_be_visible()
    expect(page.get_by_role("main")).to_contain_text("There is none at /page/overlays.")
    page.get_by_role("link", name="Runs", exact=True).click()
    expect(page.get_by_role("heading", name="Runs")).to_be_visible()
    assert not tab.errors


@pytest.mark.parametrize(
    "path",
    [
        f"/page/results?run={NUMBER}", f"/page/results?run={5000 * '9'}", f"/page/hammer?run={NUMBER}",
        f"/page/gap?diagnosis={NUMBER}", f"/page/measure?next={NUMBER}", f"/page/measure?like={NUMBER}",
        f"/page/gap?investigation={NUMBER}", f"/page/measure?investigation={NUMBER}",
        f"/page/runs?before={NUMBER}", "/page/results?run=0", f"/page/results?run={5 * chr(0x661)}",
        f"/page/instruments?examination={NUMBER}", "/page/instruments?examination=abc", "/page/gap?diagnosis=abc",
        "/page/measure?like=abc", "/page/runs?before=abc", "/page/runs?article=a&master=I&curve=abc",
    ],
)  # fmt: skip
def test_a_number_that_nothing_can_have_is_said_in_words(empty: Service, path: str) -> None:
    with empty.browser() as browser:
        answer = browser.get(path)
    assert answer.status_code == 200, answer.text


def test_a_run_that_the_address_names_by_no_number_is_said_not_to_be_there(
    on_server: tuple[Service, Server], open_tab: Callable[[Service], Tab]
) -> None:
    service, _ = on_server
    tab = open_tab(service)
    tab.log_in()
    page = tab.go("/page/results?run=abc")
    expect(page.get_by_text("nothing has the number abc that the address gives as run")).to_be_visible()
    expect(page.get_by_text("Run 1: seen")).to_have_count(0)
    tab.go("/page/results?run=")
    expect(page.get_by_text("Run 1: seen")).to_be_visible()


@pytest.mark.parametrize("path", [f"/page/files/{NUMBER}", f"/page/tables/{NUMBER}/modes.csv"])
def test_a_file_of_a_number_that_nothing_can_have_is_not_asked_for(empty: Service, path: str) -> None:
    with empty.browser() as browser:
        answer = browser.get(path)
    assert answer.status_code == 422


def test_a_silent_database_is_shown_and_stop_answers_all_the_same(
    on_server: tuple[Service, Server], open_tab: Callable[[Service], Tab]
) -> None:
    service, server = on_server
    tab = open_tab(service)
    tab.log_in()
    page = tab.go("/page/results?run=1")
    expect(page.get_by_text("Run 1: seen")).to_be_visible()
    with service.browser() as browser:
        cookies = browser.cookies
    server.send(signal.SIGSTOP)
    try:
        with httpx.Client(base_url=service.address, cookies=cookies, timeout=LONG) as client:
            for _ in range(10):
                assert client.post("/api/rig/stop").status_code == 409  # it drives no rig
                time.sleep(0.1)
            refused = client.get("/page/measure")
        assert (refused.status_code, "has not answered" in refused.text, "STOP" in refused.text) == (503, True, True)
        expect(page.get_by_role("alert").first).to_contain_text("the database has not answered")
    finally:
        server.send(signal.SIGCONT)
    expect(page.get_by_text("has not answered")).to_be_hidden()


def test_results_that_come_late_are_shown_as_soon_as_the_database_answers(
    on_server: tuple[Service, Server], open_tab: Callable[[Service], Tab]
) -> None:
    service, server = on_server
    tab = open_tab(service)
    tab.log_in()
    with server.connect("door") as other, other.transaction():
        other.execute("LOCK TABLE analyses IN ACCESS EXCLUSIVE MODE")
        page = tab.go("/page/results?run=1&part=Modes")
        expect(page.get_by_role("alert").first).to_contain_text("the database has not answered")
        expect(page.get_by_text("No results yet")).to_be_hidden()
    expect(page.get_by_text("No results yet")).to_be_visible()
    expect(page.locator("h2", has_text="Modes")).to_have_count(1)
    expect(page.get_by_text("has not answered")).to_be_hidden()


def test_results_that_are_filled_anew_while_they_are_filled_are_drawn_once(
    on_server: tuple[Service, Server], open_tab: Callable[[Service], Tab]
) -> None:
    service, server = on_server
    tab = open_tab(service)
    tab.log_in()
    with Catalogue.open(service.database, service.waveforms) as catalogue:
        with catalogue.writing() as session:  # one transaction: no worker of the service sees the job waiting
            add_job(session, "diagnose", {"run": 1}, "ann")
            taken = take_job(session, ["diagnose"])
        assert taken is not None
        job, token = taken
        with server.connect("door") as other, other.transaction():
            other.execute("LOCK TABLE analyses IN ACCESS EXCLUSIVE MODE")
            page = tab.go("/page/results?run=1&part=Everything")
            newest = page.get_by_role("region", name="Jobs").get_by_role("row").nth(1)
            expect(newest).to_contain_text("running")
            with catalogue.writing() as session:
                finish_job(session, job.id, token, {"diagnosis": 1})
            expect(newest).to_contain_text("done")  # the second fill has begun, and waits like the first one
    expect(page.get_by_text("Measure both, hammer and sweep")).to_be_visible()  # the last part
    page.wait_for_timeout(1000)  # for what a fill would go on to draw
    assert page.locator("h2").all_inner_texts() == HEADINGS


@pytest.mark.parametrize(
    ("table", "path", "late", "forms"),
    [("diagnoses", "/page/gap", "No diagnosis yet", 0), ("specimens", "/page/runs", "Overlay the ticked runs", 1)],
)
def test_a_view_that_a_silent_database_left_empty_is_drawn_as_soon_as_it_answers(
    on_server: tuple[Service, Server], open_tab: Callable[[Service], Tab], table: str, path: str, late: str, forms: int
) -> None:
    service, server = on_server
    tab = open_tab(service)
    tab.log_in()
    with server.connect("door") as other, other.transaction():
        other.execute(SQL("LOCK TABLE {} IN ACCESS EXCLUSIVE MODE").format(Identifier(table)))
        page = tab.go(path)
        expect(page.get_by_role("alert").first).to_contain_text("the database has not answered")
        expect(page.get_by_text(late)).to_be_hidden()
    expect(page.get_by_text(late)).to_be_visible()
    expect(page.locator("form.filters")).to_have_count(forms)  # what was drawn before is drawn once
    expect(page.get_by_text("has not answered")).to_be_hidden()


def test_answers_of_the_page_raise_nothing_in_the_service(
    tmp_path_factory: pytest.TempPathFactory, capfd: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path_factory.mktemp("quiet")
    (folder / "jointlab.toml").write_text("", encoding="utf-8")
    with serving(folder) as service, service.browser() as browser:
        assert [browser.get(path).status_code for path in ("/page/", "/page/results?run=1")] == [200, 200]
    assert "Traceback" not in capfd.readouterr().err
