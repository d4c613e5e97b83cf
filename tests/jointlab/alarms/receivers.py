"""Receivers of messages on real sockets: a web server and a mail server that do as they are told."""

import base64
import socket
import socketserver
import ssl
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer


@dataclass
class Received:
    """What a web server got, and what it answers: the statuses in this order, the last one from then on."""

    url: str = ""
    statuses: list[int] = field(default_factory=lambda: [200])
    bodies: list[bytes] = field(default_factory=list)
    headers: list[dict[str, str]] = field(default_factory=list)


@contextmanager
def web_server() -> Iterator[Received]:
    """A receiver of webhooks."""
    received = Received()

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            received.headers.append(dict(self.headers))
            status = received.statuses.pop(0) if len(received.statuses) > 1 else received.statuses[0]
            received.bodies.append(self.rfile.read(int(self.headers["Content-Length"])))
            self.send_response(status)
            self.end_headers()

        def log_message(self, *_: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        received.url = f"http://127.0.0.1:{server.server_port}/alarms?room=2"
        with _serving(server):
            yield received


@contextmanager
def silent_server(said: bytes = b"") -> Iterator[int]:
    """A port that accepts, and answers nothing, or a byte of `said` every 0.05 s without an end."""
    over = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.settimeout(0.05)

        def drip() -> None:
            connections, number = list[socket.socket](), 0
            while not over.is_set():
                with suppress(TimeoutError):
                    connections.append(listener.accept()[0])
                for each in connections if said else ():
                    try:
                        each.send(said[number % len(said) :][:1])
                    except OSError:
                        each.close()
                        connections.remove(each)
                        break
                number += 1
            for each in connections:
                each.close()

        thread = threading.Thread(target=drip)
        thread.start()
        try:
            yield listener.getsockname()[1]
        finally:
            over.set()
            thread.join()


@dataclass
class Post:
    """What a mail server got, and whom it refuses.

    Attributes:
        refused: recipients that it does not take, after the messages that it defers.
        deferred: messages that it does not take now.
        logins: what was given to log in, decoded.
        encrypted: for each message, whether it came over TLS.
    """

    port: int = 0
    refused: set[str] = field(default_factory=set)
    deferred: int = 0
    messages: list[str] = field(default_factory=list)
    logins: list[str] = field(default_factory=list)
    encrypted: list[bool] = field(default_factory=list)


@contextmanager
def mail_server(tls: ssl.SSLContext | None = None) -> Iterator[Post]:
    """A mail server (RFC 5321), with STARTTLS and log-in where `tls` is given."""
    post = Post()

    class Handler(socketserver.StreamRequestHandler):
        def handle(self) -> None:
            self._encrypted = self._over = False
            self._say("220 here")
            self._converse()

        def _converse(self) -> None:
            while not self._over and (line := self.rfile.readline()):
                verb, _, rest = line.decode("ascii").strip().partition(" ")
                if verb.upper() == "QUIT":
                    return
                self._commands().get(verb.upper(), self._ask)(rest)

        def _commands(self) -> dict[str, Callable[[str], None]]:
            return {
                "EHLO": self._greet, "STARTTLS": self._encrypt, "AUTH": self._log_in,
                "MAIL": lambda _: self._say("250 ok"), "RCPT": self._recipient, "DATA": self._take,
                "RSET": lambda _: self._say("250 ok"),
            }  # fmt: skip

        def _greet(self, _: str) -> None:
            extra = [] if tls is None else ["AUTH PLAIN"] if self._encrypted else ["STARTTLS"]
            lines = ["here", *extra]
            for line in lines[:-1]:
                self._say(f"250-{line}")
            self._say(f"250 {lines[-1]}")

        def _encrypt(self, _: str) -> None:
            assert tls is not None
            self._say("220 go on")
            self._over = True  # of what is not encrypted
            with (
                suppress(OSError),
                tls.wrap_socket(self.connection, server_side=True) as line,
                line.makefile("rb") as self.rfile,
                line.makefile("wb") as self.wfile,
            ):
                self._encrypted, self._over = True, False
                self._converse()
                self._over = True

        def _log_in(self, given: str) -> None:
            post.logins.append(base64.b64decode(given.split()[1]).decode())
            self._say("235 welcome")

        def _recipient(self, given: str) -> None:
            refused = any(f"<{each}>" in given for each in post.refused)
            self._say("550 nobody of that name" if refused else "250 ok")

        def _take(self, _: str) -> None:
            self._say("354 go on")
            lines = list[bytes]()
            while (line := self.rfile.readline()) not in (b".\r\n", b""):
                lines.append(line)
            if post.deferred:
                post.deferred -= 1
                self._say("451 later")
                return
            post.messages.append(b"".join(lines).decode("ascii"))
            post.encrypted.append(self._encrypted)
            self._say("250 taken")

        def _ask(self, _: str) -> None:
            self._say("500 what")

        def _say(self, line: str) -> None:
            self.wfile.write(line.encode("ascii") + b"\r\n")
            self.wfile.flush()

    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), Handler) as server:
        server.daemon_threads = True
        post.port = server.server_address[1]
        with _serving(server):
            yield post


@contextmanager
def _serving(server: socketserver.BaseServer) -> Iterator[None]:
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    try:
        yield
    finally:
        server.shutdown()
        thread.join()
