"""`jointlab serve`: the REST service."""

from __future__ import annotations

from typing import Annotated

import typer
import uvicorn

from api.commands.terminal import open_catalogue, out
from api.service import create_service


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("serve")(serve)


def serve(port: Annotated[int, typer.Option(min=0, max=65535, help="Port on the loopback address.")] = 8000) -> None:
    """Serve runs and results over REST on the loopback address, until interrupted (Ctrl-C)."""
    with open_catalogue() as catalogue:
        out.print(f"http://127.0.0.1:{port}/api/health, catalogue {catalogue.address}")
        uvicorn.run(create_service(catalogue), host="127.0.0.1", port=port, log_level="warning")
