"""Logging in to the page by a key: the browser keeps a session in a cookie that no script can read.

The session ends by itself, by logging out, and with its key.
"""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Annotated
from urllib.parse import quote

import jinja2
from fastapi import FastAPI, Form, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response
from starlette.requests import HTTPConnection

from api.service.access import (
    Caller,
    authenticate,
    caller_with,
    is_at_this_computer,
    known_key,
    name_of,
    stranger,
)
from api.service.context import Services
from api.service.deadlines import looked_up
from api.service.problems import AccessError
from jointlab.burst_log import AuditEvent
from rig.instruments import EXTERNAL
from store.errors import StoreError
from store.service.audit import add_audit_entry
from store.service.keys import begin_page_session, end_page_session, key_of_page_session

COOKIE = "jointlab-session"
HOME = "/page/"
_lookup = ThreadPoolExecutor(2, thread_name_prefix="log-in")


@dataclass(frozen=True)
class Login:
    """The login of a browser. It is checked again for every action, because sessions and keys end.

    Attributes:
        secret: of the session; None where there is none.
        here: whether the browser is at this computer.
    """

    services: Services
    secret: str | None
    here: bool

    def caller(self) -> Caller:
        """The caller with the key of this session.

        Raises:
            AccessError: the session or its key has ended, or a key is needed.
        """
        if self.secret is None:
            return authenticate(self.services, None, self.here)
        with self.services.catalogue.reading() as session:
            key = key_of_page_session(session, self.secret, self.services.now())
        if key is None:
            raise AccessError(401, "this log-in has ended; log in again")
        return caller_with(self.services, key)


def login_of(services: Services, request: HTTPConnection) -> Login:
    """The login of the browser that sent a request or opens a socket."""
    return Login(services, request.cookies.get(COOKIE), is_at_this_computer(request))


@cache
def file_text(name: str) -> str:
    """A file of this package; it does not change while the service runs."""
    return resources.files("api.page").joinpath(name).read_text(encoding="utf-8")


def stop_button(services: Services) -> str:
    """The STOP button: it asks the service and, by its port, the drive process itself. Without a rig there is none."""
    answer = '<iframe name="stopped" hidden title="answer to STOP"></iframe>'
    if services.runs is None:
        return answer
    drive = services.runs.drive
    failed = "STOP FAILED: the actuator may still move. Press the red button on the machine."
    does, done = "end the run and bring the actuator to rest", "The actuator is at rest."
    if drive.tester_url is None:
        does, done = "end the run", "This rig drives no tester."
    elif drive.tester_url == EXTERNAL:
        does, failed = (
            "end the run",
            "STOP does not reach this machine, it is not driven from here. Press its own stop.",
        )
    return f"""<form class="stop" method="post" action="/api/rig/stop" target="stopped" data-port="{drive.stop_port}">
<button aria-label="STOP: {does}">STOP</button>
<output role="status" data-done="Stopped. {done}" data-failed="{failed}"></output></form>
{answer}"""


def log_in_form(services: Services, trouble: str, target: str, status: int = 200) -> HTMLResponse:
    """The form to log in, which says what the trouble is and leads to `target`; STOP is on it, too."""
    css, js = file_text("page.css"), file_text("page.js")
    return HTMLResponse(
        _template().render(css=css, js=js, stop=stop_button(services), trouble=trouble, next=target), status
    )


@cache
def _template() -> jinja2.Template:
    environment = jinja2.Environment(loader=jinja2.PackageLoader("api.page", ""), autoescape=True)
    return environment.get_template("log_in.html")


def add_log_in(app: FastAPI, services: Services) -> None:
    """Routes to log in and out: plain forms, which need no socket."""

    @app.get("/page/log-in", include_in_schema=False)
    def ask(request: Request, why: str = "", next: str = HOME) -> Response:
        """The form."""
        return log_in_form(services, why, _own_address(next, request))

    @app.post("/page/log-in", include_in_schema=False)
    async def log_in(request: Request, key: Annotated[str, Form()], next: Annotated[str, Form()] = HOME) -> Response:
        """Begin a session in place of the one before, if the key opens something."""
        target, before = _own_address(next, request), request.cookies.get(COOKIE)
        try:
            secret = await looked_up(_lookup, _begin_session, services, key.strip(), before)
        except AccessError as error:
            services.bursts.note(
                services.catalogue, AuditEvent(stranger(request), "log in", "page", f"refused: {error}")
            )
            return log_in_form(services, str(error), target, error.status)
        except StoreError as error:
            return log_in_form(services, str(error), target, 503)
        answer = RedirectResponse(target, 303)
        answer.set_cookie(
            COOKIE, secret, max_age=int(services.session_lasts.total_seconds()), httponly=True, samesite="strict",
            secure=request.url.scheme == "https",
        )  # fmt: skip
        return answer

    @app.post("/page/log-out", include_in_schema=False)
    async def log_out(request: Request) -> Response:
        """End the session."""
        await looked_up(_lookup, _end_session, services, request.cookies.get(COOKIE))
        answer = RedirectResponse("/page/log-in", 303)
        answer.delete_cookie(COOKIE)
        return answer


def _begin_session(services: Services, key: str, before: str | None) -> str:
    """Begin a session for who has this key, and note it; its secret. Raises AccessError where the key opens nothing."""
    now = services.now()
    found = services.catalogue.read(known_key, key)
    caller = caller_with(services, found)
    with services.catalogue.writing() as session:
        if before is not None:
            end_page_session(session, before, now)
        add_audit_entry(session, who=caller.name, action="log in", target="page", outcome="done")
        return begin_page_session(session, found, now, services.session_lasts)


def _end_session(services: Services, secret: str | None) -> None:
    """End a session, and note it; one that has ended stays as it is."""
    if secret is None:
        return
    now = services.now()
    with services.catalogue.writing() as session:
        key = key_of_page_session(session, secret, now)
        if key is not None:
            end_page_session(session, secret, now)
            add_audit_entry(session, who=name_of(key), action="log out", target="page", outcome="done")


def log_in_address(request: Request, why: str) -> str:
    """The address of the form, which leads back to this page."""
    target = f"/page{request.url.path.removeprefix('/page')}" + (f"?{request.url.query}" if request.url.query else "")
    return f"/page/log-in?why={quote(why)}&next={quote(target)}"


def _own_address(target: str, request: Request) -> str:
    """`target` if it is an address on this page, else the address of the dashboard."""
    return target if target.startswith("/page") and "\\" not in target and request.url.hostname else HOME
