"""Access to the page: who asks for a view, a file or the socket is known before NiceGUI does anything about it.

Without a login, a view leads to the form. So a request of a stranger costs little. Open are the form itself and the
files of NiceGUI, which hold nothing of the laboratory. Floods are limited for each caller: by the key of a login, and
by the address of those without one.
"""

from concurrent.futures import ThreadPoolExecutor
from urllib.parse import urlsplit

from fastapi import Request
from fastapi.responses import RedirectResponse, Response
from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Receive, Send
from starlette.types import Scope as AsgiScope

from api.page.login import HOME, Login, log_in_address, log_in_form, login_of
from api.service.access import stranger
from api.service.context import Services
from api.service.deadlines import looked_up
from api.service.floods import TokenBuckets
from api.service.problems import AccessError, problem
from store.errors import StoreError
from store.states import Scope

FORMS = ("/page/log-in", "/page/log-out")
FILES_OF_NICEGUI = "/page/_nicegui/"
SOCKET = "/page/_nicegui_ws/"
NO_VIEWS = ("/page/files/", "/page/tables/", SOCKET)
"""Beginnings of paths where a refused request gets a problem document, not the form to log in."""
AT_ONCE, A_SECOND = 40.0, 8.0
"""Requests of one caller at once, and in each second from then on."""
_lookup = ThreadPoolExecutor(2, thread_name_prefix="page access")


class PageAccess:
    """Lets a request to the page in, with its login and caller in `state`, or answers it."""

    def __init__(self, app: ASGIApp, services: Services) -> None:
        self._app = app
        self._services = services
        self._buckets = TokenBuckets(AT_ONCE, A_SECOND)

    async def __call__(self, scope: AsgiScope, receive: Receive, send: Send) -> None:
        """Let one request in, or answer it."""
        if scope["type"] not in ("http", "websocket") or not _is_of_page(scope["path"]):
            await self._app(scope, receive, send)
            return
        connection = HTTPConnection(scope)
        login = login_of(self._services, connection)
        try:
            await self._admit(connection, login)
        except (AccessError, StoreError) as error:
            if scope["type"] == "websocket":
                await send({"type": "websocket.close"})
            else:
                await _refused(self._services, Request(scope), login.secret is not None, error)(scope, receive, send)
            return
        await self._app(scope, receive, send)

    async def _admit(self, connection: HTTPConnection, login: Login) -> None:
        """Check where a request comes from, who sends it, and how many came before.

        Raises:
            AccessError: it is not admitted.
            StoreError: the database does not answer.
        """
        path, origin = connection.url.path, connection.headers.get("origin")
        if origin is not None and urlsplit(origin).netloc != connection.headers.get("host"):
            raise AccessError(403, f"the page takes no requests of other pages, such as of {origin[:100]}")
        who = stranger(connection)
        if not path.startswith(FORMS):
            caller = await looked_up(_lookup, login.caller)
            if Scope.READ not in caller.scopes:
                raise AccessError(403, f"{caller.name} may not read; log in with a key that has {Scope.READ}")
            connection.state.login, connection.state.caller = login, caller
            who = caller.name if login.secret is not None else who
        if not path.startswith(SOCKET) and not self._buckets.take(who):
            raise AccessError(429, f"more than {A_SECOND:g} requests a second came from {who}; wait for some seconds")


def _is_of_page(path: str) -> bool:
    return (path == "/page" or path.startswith("/page/")) and not path.startswith(FILES_OF_NICEGUI)


def _refused(services: Services, request: Request, tried: bool, error: AccessError | StoreError) -> Response:
    path, status = request.url.path, error.status if isinstance(error, AccessError) else 503
    if path.startswith(NO_VIEWS):
        return problem(status, str(error))
    if status in (401, 403) and not path.startswith(FORMS):
        return RedirectResponse(log_in_address(request, str(error) if tried else ""))  # a stranger needs no reason
    return log_in_form(services, f"{error}. STOP works all the same.", HOME, status)
