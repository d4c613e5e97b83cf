"""The web server in front of the application: its limits on a network where anybody may connect."""

import logging
import resource
import ssl
from collections.abc import Callable, Sequence
from ipaddress import IPv4Address, IPv6Address
from pathlib import Path

import uvicorn
from fastapi import FastAPI

from api.service.bodies import LARGEST
from api.service.connections import GuardedProtocol
from api.service.floods import TokenBuckets
from jointlab.errors import JointlabError

GRACE = 5
"""Seconds that requests have to end when the service is stopped."""


def make_server(
    app: FastAPI,
    *,
    tls: ssl.SSLContext | None = None,
    trusted_proxies: Sequence[IPv4Address | IPv6Address] = (),
    grace: int = GRACE,
    beat: Callable[[], None] | None = None,
) -> uvicorn.Server:
    """A server of `app` that bounds connections, heads, bodies and messages of sockets.

    Args:
        tls: of an encrypted service.
        trusted_proxies: addresses from which the headers X-Forwarded-For and X-Forwarded-Proto are believed.
        grace: seconds that requests have to end when the service is stopped.
        beat: called by the event loop ten times a second, as long as that works.
    """
    config = uvicorn.Config(
        app, http=GuardedProtocol, ws_max_size=LARGEST, log_config=None, log_level="warning", server_header=False,
        timeout_graceful_shutdown=grace, proxy_headers=bool(trusted_proxies),
        forwarded_allow_ips=[*map(str, trusted_proxies)],
        ssl_context_factory=None if tls is None else lambda _config, _default: tls,
    )  # fmt: skip
    logging.getLogger("uvicorn.error").addFilter(_FEW)
    return _Server(config, beat)


class _Server(uvicorn.Server):
    """A server whose event loop tells that it works."""

    def __init__(self, config: uvicorn.Config, beat: Callable[[], None] | None) -> None:
        super().__init__(config)
        self._beat = beat

    async def on_tick(self, counter: int) -> bool:
        """The work that uvicorn does ten times a second; its own callbacks go by a clock that may be set back."""
        if self._beat is not None:
            self._beat()
        return await super().on_tick(counter)


class _FewWarnings(logging.Filter):
    """Passes few of the same warning, because clients decide how many bad requests there are."""

    def __init__(self) -> None:
        super().__init__()
        self._buckets = TokenBuckets(10, 1 / 60)

    def filter(self, record: logging.LogRecord) -> bool:
        """Whether a record is written."""
        return record.levelno != logging.WARNING or self._buckets.take(str(record.msg))


_FEW = _FewWarnings()


def tls_of(certificate: Path, key: Path) -> ssl.SSLContext:
    """TLS 1.2 and newer with this certificate (with its chain) and its key, both PEM files.

    Raises:
        JointlabError: they cannot be read, or do not fit each other.
    """
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    try:
        context.load_cert_chain(certificate, key, password="")  # without a password it would ask at the terminal
    except (OSError, ssl.SSLError) as error:
        raise JointlabError(f"{certificate} and {key} make no TLS: {error}; give PEM files that fit") from error
    return context


def raise_descriptor_limit() -> int:
    """Let this process have as many open files and connections as the system allows it; the number."""
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))
    return hard
