"""Logging in to the page by a key, which the browser keeps in a cookie that no script can read."""

from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Annotated
from urllib.parse import quote

import jinja2
from fastapi import FastAPI, Form, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response
from starlette.requests import HTTPConnection

from api.service.access import Caller, authenticate, is_at_this_computer
from api.service.context import Services
from api.service.problems import AccessError

COOKIE = "jointlab-key"
HOME = "/page/"
DAYS = 86_400
STOP = """<form class="stop" method="post" action="/api/rig/stop" target="stopped">
<button aria-label="STOP: end the run and bring the actuator to rest">STOP</button>
<output role="status"></output></form>
<iframe name="stopped" hidden title="answer to STOP"></iframe>"""


@dataclass(frozen=True)
class Login:
    """The login of a browser. Its key is checked again for every action, because keys end and are revoked.

    Attributes:
        secret: of the key; None where there is none.
        here: whether the browser is at this computer.
    """

    services: Services
    secret: str | None
    here: bool

    def caller(self) -> Caller:
        """The caller with this key.

        Raises:
            AccessError: the key opens nothing, or one is needed.
        """
        return authenticate(self.services, self.secret, self.here)


def login_of(services: Services, request: HTTPConnection) -> Login:
    """The login of the browser that sent a request or opens a socket."""
    return Login(services, request.cookies.get(COOKIE), is_at_this_computer(request))


def file_text(name: str) -> str:
    """A file of this package."""
    return resources.files("api.page").joinpath(name).read_text(encoding="utf-8")


def log_in_form(trouble: str, target: str, status: int = 200) -> HTMLResponse:
    """The form to log in, which says what the trouble is and leads to `target`; STOP is on it, too."""
    css, js = file_text("page.css"), file_text("page.js")
    return HTMLResponse(_template().render(css=css, js=js, stop=STOP, trouble=trouble, next=target), status)


@cache
def _template() -> jinja2.Template:
    environment = jinja2.Environment(loader=jinja2.PackageLoader("api.page", ""), autoescape=True)
    return environment.get_template("log_in.html")


def add_log_in(app: FastAPI, services: Services) -> None:
    """Routes to log in and out: plain forms, which need no socket."""

    @app.get("/page/log-in", include_in_schema=False)
    def ask(request: Request, why: str = "", next: str = HOME) -> Response:
        """The form."""
        return log_in_form(why, _own_address(next, request))

    @app.post("/page/log-in", include_in_schema=False)
    def log_in(request: Request, key: Annotated[str, Form()], next: Annotated[str, Form()] = HOME) -> Response:
        """Keep the key in a cookie, if it opens something."""
        target, secret = _own_address(next, request), key.strip()
        try:
            authenticate(services, secret, is_at_this_computer(request))
        except AccessError as error:
            return log_in_form(str(error), target, error.status)
        answer = RedirectResponse(target, 303)
        answer.set_cookie(
            COOKIE, secret, max_age=30 * DAYS, httponly=True, samesite="strict", secure=request.url.scheme == "https"
        )  # fmt: skip
        return answer

    @app.post("/page/log-out", include_in_schema=False)
    def log_out() -> Response:
        """Forget the key."""
        answer = RedirectResponse("/page/log-in", 303)
        answer.delete_cookie(COOKIE)
        return answer


def log_in_address(request: Request, why: str) -> str:
    """The address of the form, which leads back to this page."""
    target = f"/page{request.url.path.removeprefix('/page')}" + (f"?{request.url.query}" if request.url.query else "")
    return f"/page/log-in?why={quote(why)}&next={quote(target)}"


def _own_address(target: str, request: Request) -> str:
    """`target` if it is an address on this page, else the address of the dashboard."""
    return target if target.startswith("/page") and "\\" not in target and request.url.hostname else HOME
