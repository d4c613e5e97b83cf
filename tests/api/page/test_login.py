"""Logging in to the page: a session, not the key, is in the browser, and it ends."""

from collections.abc import Iterator
from datetime import timedelta

import httpx
import pytest
from sqlalchemy import text

from api.page.access import AT_ONCE
from store.catalogue import Catalogue
from store.service.audit import AuditEntry, list_audit_entries
from store.service.keys import add_key, find_key, revoke_key
from store.states import Scope
from tests.api.page.technician import Service, serving
from tests.waiting import LONG, until

COOKIE = "jointlab-session"
SOCKET = "/page/_nicegui_ws/socket.io/?EIO=4&transport=polling"


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service without a rig whose sessions last for an hour."""
    folder = tmp_path_factory.mktemp("login")
    (folder / "jointlab.toml").write_text("[service]\nsession_hours = 1\n", encoding="utf-8")
    with serving(folder) as service:
        yield service


def log_ins(service: Service) -> list[AuditEntry]:
    with Catalogue.open(service.database) as catalogue, catalogue.reading() as session:
        return list_audit_entries(session, action="log in", limit=1000)[::-1]


def opens(service: Service, cookie: str) -> bool:
    answer = httpx.get(f"{service.address}/page/runs", cookies={COOKIE: cookie}, timeout=LONG)
    assert answer.status_code in (200, 307), answer.text
    return answer.status_code == 200


def test_the_cookie_is_not_the_key_and_no_script_reads_it(service: Service) -> None:
    answer = httpx.post(f"{service.address}/page/log-in", data={"key": service.key}, timeout=LONG)
    assert (answer.status_code, answer.headers["location"]) == (303, "/page/")
    (cookie,) = answer.headers.get_list("set-cookie")
    assert service.key not in cookie
    assert {"HttpOnly", "SameSite=strict", "Path=/", "Max-Age=3600"} <= set(cookie.split("; "))
    assert opens(service, answer.cookies[COOKIE])
    assert not opens(service, service.key)


def test_logging_out_ends_the_session_everywhere(service: Service) -> None:
    with service.browser() as browser:
        kept = browser.cookies[COOKIE]
        assert opens(service, kept)
        assert browser.post("/page/log-out").status_code == 303
        assert COOKIE not in browser.cookies
    assert not opens(service, kept)


def test_logging_in_again_ends_the_session_before(service: Service) -> None:
    with service.browser() as browser:
        before = browser.cookies[COOKIE]
        browser.post("/page/log-in", data={"key": service.key})
        assert opens(service, browser.cookies[COOKIE])
    assert not opens(service, before)


def test_a_session_ends_by_itself_and_with_its_key(service: Service) -> None:
    with Catalogue.open(service.database) as catalogue:
        with catalogue.writing() as session:
            key, secret = add_key(session, "for an hour", [Scope.READ])
        with service.browser(secret) as browser:
            cookie = browser.cookies[COOKIE]
        with catalogue.writing() as session:
            revoke_key(session, key.id)
        assert not opens(service, cookie)
        with service.browser() as browser:
            cookie = browser.cookies[COOKIE]
        with catalogue.writing() as session:
            own = find_key(session, service.key)
            assert own is not None
            past = own.created_at - timedelta(hours=1)
            session.execute(
                text("UPDATE page_sessions SET ends_at = :past WHERE key_id = :key"),
                {"past": past.replace(tzinfo=None), "key": own.id},
            )
        assert not opens(service, cookie)


def test_log_ins_that_fail_are_in_the_audit_log_in_few_rows(service: Service) -> None:
    before = len(log_ins(service))
    for _ in range(20):
        assert httpx.post(f"{service.address}/page/log-in", data={"key": "jl_guess"}, timeout=LONG).status_code == 401
    until(lambda: len(log_ins(service)) > before)
    noted = log_ins(service)[before:]
    assert len(noted) == 1
    assert (noted[0].who, noted[0].outcome[:7]) == ("unknown caller at 127.0.0.1", "refused")
    assert "jl_guess" not in repr(noted)


def test_a_flood_of_strangers_is_refused_and_a_technician_is_not(service: Service) -> None:
    with httpx.Client(base_url=service.address, timeout=LONG) as stranger, service.browser() as browser:
        flood = [stranger.get("/page/log-in").status_code for _ in range(4 * int(AT_ONCE))]
        assert set(flood) == {200, 429}
        assert browser.get("/page/runs").status_code == 200


@pytest.mark.parametrize("path", [SOCKET, "/page/runs", "/page/log-in"])
def test_another_page_gets_neither_view_nor_socket_in_a_readers_name(service: Service, path: str) -> None:
    with service.browser() as browser:
        foreign = browser.get(path, headers={"Origin": "http://evil.example"})
        assert foreign.status_code in (307, 403)
        assert "access-control-allow-origin" not in foreign.headers
        if path == SOCKET:
            own = browser.get(path, headers={"Origin": service.address})
            assert own.status_code == 200


def test_the_page_may_not_be_framed_and_loads_from_its_own_computer(service: Service) -> None:
    with service.browser() as browser:
        headers = browser.get("/page/runs").headers
    policy = headers["content-security-policy"]
    assert "frame-ancestors 'self'" in policy
    assert "connect-src 'self' http://127.0.0.1:*" in policy
    assert (headers["x-content-type-options"], headers["referrer-policy"]) == ("nosniff", "same-origin")
