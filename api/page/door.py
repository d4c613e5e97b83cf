"""The door of the page: who asks for a view, a file or the socket is known before NiceGUI does anything about it.

Without a login, a view leads to the form. So a request of a stranger costs one lookup, in another thread. Open are the
form itself and the files of NiceGUI, which hold nothing of the laboratory.
"""

from concurrent.futures import ThreadPoolExecutor

from fastapi import Request
from fastapi.responses import RedirectResponse, Response
from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Receive, Send
from starlette.types import Scope as AsgiScope

from api.page.login import log_in_address, log_in_form, login_of
from api.service.access import LONGEST_LOOKUP
from api.service.context import Services
from api.service.deadlines import within
from api.service.problems import AccessError, problem
from store.errors import StoreError
from store.states import Scope

OPEN = ("/page/log-in", "/page/log-out", "/page/_nicegui/")
NO_VIEWS = ("/page/files/", "/page/tables/", "/page/_nicegui_ws/")
"""The paths whose requests are refused, not led to the form."""
_lookup = ThreadPoolExecutor(2, thread_name_prefix="door")


class Door:
    """Lets a request to the page in, with its login and caller in `state`, or answers it."""

    def __init__(self, app: ASGIApp, services: Services) -> None:
        self._app = app
        self._services = services

    async def __call__(self, scope: AsgiScope, receive: Receive, send: Send) -> None:
        """Let one request in, or answer it."""
        if scope["type"] not in ("http", "websocket") or not is_closed(scope["path"]):
            await self._app(scope, receive, send)
            return
        connection = HTTPConnection(scope)
        login = login_of(self._services, connection)
        try:
            caller = await within(LONGEST_LOOKUP, _lookup, login.caller)
            if Scope.READ not in caller.scopes:
                raise AccessError(403, f"{caller.name} may not read; log in with a key that has {Scope.READ}")
        except (AccessError, StoreError) as error:
            if scope["type"] == "websocket":
                await send({"type": "websocket.close"})
            else:
                await _refused(Request(scope), login.secret is not None, error)(scope, receive, send)
            return
        connection.state.login, connection.state.caller = login, caller
        await self._app(scope, receive, send)


def is_closed(path: str) -> bool:
    """Whether a path of the service is behind the door."""
    return (path == "/page" or path.startswith("/page/")) and not path.startswith(OPEN)


def _refused(request: Request, tried: bool, error: AccessError | StoreError) -> Response:
    status = error.status if isinstance(error, AccessError) else 503
    if request.url.path.startswith(NO_VIEWS):
        return problem(status, str(error))
    if status == 503:
        return log_in_form(f"{error}. STOP works all the same.", request.url.path, status)
    return RedirectResponse(log_in_address(request, str(error) if tried else ""))  # without a key there is no reason
