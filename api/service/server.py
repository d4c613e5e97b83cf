"""The web server in front of the application: what it takes from a network on which anybody may connect."""

import resource

import uvicorn
from fastapi import FastAPI

from api.service.bodies import LARGEST
from api.service.connections import GuardedProtocol

GRACE = 5
"""Seconds that requests have to end when the service is stopped."""


def make_server(app: FastAPI, grace: int = GRACE) -> uvicorn.Server:
    """A server of `app` that bounds connections, heads, bodies and messages of sockets."""
    return uvicorn.Server(
        uvicorn.Config(
            app, http=GuardedProtocol, ws_max_size=LARGEST, log_level="warning", timeout_graceful_shutdown=grace,
            server_header=False, proxy_headers=False,
        )
    )  # fmt: skip


def raise_descriptor_limit() -> int:
    """Let this process have as many open files and connections as the system allows it; the number."""
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    return hard
