"""The bad line: what it does to the bytes that pass, against a server that echoes them."""

import socket
import socketserver
import threading
import time
from collections.abc import Iterator

import pytest

from tests.fault_proxy import FaultProxy, Impairment, Way
from tests.ports import free_port


class _Echo(socketserver.BaseRequestHandler):
    def handle(self) -> None:
        try:
            while data := self.request.recv(65536):
                self.request.sendall(data)
        except ConnectionError:
            return  # the line broke


class _Server(socketserver.ThreadingTCPServer):
    daemon_threads = True


@pytest.fixture
def target() -> Iterator[str]:
    with _Server(("127.0.0.1", 0), _Echo) as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        yield f"127.0.0.1:{server.server_address[1]}"
        server.shutdown()
        thread.join()


@pytest.fixture
def proxy(target: str) -> Iterator[FaultProxy]:
    proxy = FaultProxy(target, seed=1)
    yield proxy
    proxy.stop()


def dial(proxy: FaultProxy, timeout: float = 60.0) -> socket.socket:
    host, port = proxy.address.split(":")
    line = socket.create_connection((host, int(port)), timeout)
    line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    return line


LONG = bytes(range(256)) * 8


def echo(line: socket.socket, data: bytes) -> bytes:
    line.sendall(data)
    got = b""
    while len(got) < len(data):
        piece = line.recv(65536)
        if not piece:
            break
        got += piece
    return got


def is_dead(proxy: FaultProxy) -> bool:
    """Whether a new connection is closed without a word."""
    try:
        with dial(proxy) as line:
            return echo(line, b"hello") == b""
    except (ConnectionResetError, BrokenPipeError):
        return True


def test_a_sound_line_passes_everything_both_ways_and_the_good_bye(proxy: FaultProxy) -> None:
    with dial(proxy) as line:
        assert echo(line, bytes(range(256)) * 1000) == bytes(range(256)) * 1000
        line.shutdown(socket.SHUT_WR)
        assert line.recv(1) == b""


def test_latency_delays_each_way(proxy: FaultProxy) -> None:
    proxy.impair(Impairment(latency=0.05, jitter=0.01))
    with dial(proxy) as line:
        began = time.monotonic()
        assert echo(line, b"hello") == b"hello"
        assert time.monotonic() - began >= 0.1


def test_slices_arrive_one_by_one_and_whole(proxy: FaultProxy) -> None:
    proxy.impair(Impairment(slices=1))
    with dial(proxy) as line:
        line.sendall(LONG)
        got = line.recv(len(LONG))
        assert len(got) < len(LONG)  # not all at once
        while len(got) < len(LONG):
            got += line.recv(len(LONG))
        assert got == LONG


def test_lost_replies_reach_nobody_while_the_connection_stays(proxy: FaultProxy) -> None:
    with dial(proxy, timeout=0.1) as line:
        proxy.impair(Impairment(lost=Way.REPLIES))
        line.sendall(b"lost")
        with pytest.raises(TimeoutError):
            line.recv(10)
        proxy.repair()
        assert echo(line, b"found") == b"found"


def test_one_bit_of_each_piece_flips_the_same_for_the_same_seed(target: str) -> None:
    seen = []
    for _ in range(2):
        proxy = FaultProxy(target, seed=5)
        proxy.impair(Impairment(flipped=Way.REPLIES))
        with dial(proxy) as line:
            seen.append(echo(line, b"\0" * 64))
        assert proxy.flips == 1
        proxy.stop()
    assert seen[0] == seen[1]
    assert sum(byte.bit_count() for byte in seen[0]) == 1


def test_a_fault_of_so_many_pieces_is_over_after_them(proxy: FaultProxy) -> None:
    proxy.impair(Impairment(flipped=Way.REPLIES, pieces=2))
    with dial(proxy) as line:
        flipped = [echo(line, b"\0" * 8) for _ in range(4)]
    assert [sum(byte.bit_count() for byte in got) for got in flipped] == [1, 1, 0, 0]


@pytest.mark.parametrize("way", [Way.REQUESTS, Way.REPLIES])
def test_a_reset_breaks_the_connection_and_a_new_one_works_after_mending(proxy: FaultProxy, way: Way) -> None:
    proxy.impair(Impairment(reset=way))
    with dial(proxy) as line, pytest.raises(ConnectionResetError):
        echo(line, b"hello")
    proxy.repair()
    with dial(proxy) as line:
        assert echo(line, b"hello") == b"hello"


def test_a_cut_line_resets_what_there_is_and_what_comes(proxy: FaultProxy) -> None:
    with dial(proxy) as line:
        assert echo(line, b"hello") == b"hello"
        proxy.cut()
        with pytest.raises(ConnectionResetError):
            echo(line, b"hello")
    assert is_dead(proxy)


def test_a_line_to_nobody_is_reset() -> None:
    proxy = FaultProxy(f"127.0.0.1:{free_port()}")
    assert is_dead(proxy)
    proxy.stop()


def test_it_stops_with_connections_open_and_pieces_under_way(target: str) -> None:
    proxy = FaultProxy(target)
    proxy.impair(Impairment(latency=30.0))
    with dial(proxy) as line:
        line.sendall(b"never")
        began = time.monotonic()
        proxy.stop()
        assert time.monotonic() - began < 25.0  # the piece would take 30 s
        assert "fault proxy" not in [thread.name for thread in threading.enumerate()]
