"""`jointlab serve`: the REST service."""

from __future__ import annotations

import socket
from typing import Annotated

import typer
import uvicorn

from api.commands.terminal import open_catalogue, out
from api.errors import ApiError
from api.service import create_service


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("serve")(serve)


def serve(
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port on the loopback address; 0: any free one.")] = 8000,
) -> None:
    """Serve runs and results over REST on the loopback address, until interrupted (Ctrl-C)."""
    with open_catalogue() as catalogue, _listening(port) as listener:
        out.print(f"http://127.0.0.1:{listener.getsockname()[1]}/api/health, catalogue {catalogue.address}")
        config = uvicorn.Config(create_service(catalogue), log_level="warning")
        uvicorn.Server(config).run(sockets=[listener])


def _listening(port: int) -> socket.socket:
    try:
        return socket.create_server(("127.0.0.1", port))
    except OSError as error:
        raise ApiError(f"port {port} cannot be used: {error.strerror or error}; name another with --port") from error
