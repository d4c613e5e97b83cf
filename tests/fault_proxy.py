"""A bad line: a TCP proxy on the loopback address that delays, loses, slices, changes or resets what passes through it.

It knows nothing of what it carries, so it stands in front of Modbus TCP as well as of gRPC. What it does wrong follows
from its seed and from what passes.
"""

import asyncio
import random
import socket
import struct
import threading
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from enum import IntFlag

LARGEST_PIECE = 65536  # bytes that are read at once
LOST_KEPT = 100  # pieces that vanished
SLICE_PAUSE = 0.5e-3  # s between two slices, so that they arrive one by one


class Way(IntFlag):
    """Which way something passes."""

    NONE = 0
    REQUESTS = 1
    REPLIES = 2
    BOTH = 3


@dataclass(frozen=True)
class Impairment:
    """What is wrong with the line; nothing by default. A piece is what arrives at once.

    Attributes:
        latency: s that every piece is late, each way.
        jitter: s, the most that it is later still.
        slices: bytes that pass at once; 0 for no limit.
        lost: which way pieces vanish while the connection stays; both is a black hole.
        flipped: which way every piece has one bit changed.
        reset: which way a piece makes the line reset the connection.
        pieces: how many pieces it befalls before the line is sound again; 0 for all.
    """

    latency: float = 0.0
    jitter: float = 0.0
    slices: int = 0
    lost: Way = Way.NONE
    flipped: Way = Way.NONE
    reset: Way = Way.NONE
    pieces: int = 0

    def befalls(self, way: Way) -> bool:
        """Whether a piece that passes `way` suffers."""
        both = self.latency or self.jitter or self.slices
        return bool(both) or way in self.lost | self.flipped | self.reset


SOUND = Impairment()


class FaultProxy:
    """A line to `target` ("host:port" or the path of a Unix socket), with a thread of its own, until it is stopped.

    Attributes:
        address: "host:port" for clients to connect to instead.
        flips: how many bits it has changed so far.
        lost: the last pieces that vanished.
    """

    def __init__(self, target: str, seed: int = 0) -> None:
        self.flips = 0
        self.lost = deque[bytes](maxlen=LOST_KEPT)
        self._target = target
        self._random = random.Random(seed)
        self._impairment = SOUND
        self._left = 0
        self._refusing = False
        self._ends: set[asyncio.StreamWriter] = set()
        self._lines: set[asyncio.Task[None]] = set()
        self._started = threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._serve()), name="fault proxy", daemon=True)
        self._thread.start()
        self._started.wait()

    def impair(self, impairment: Impairment) -> None:
        """Let the line be as bad as `impairment` from the next piece on."""
        self._impairment, self._left = impairment, impairment.pieces

    def repair(self) -> None:
        """Let the line be sound and take connections again; what is lost stays lost."""
        self._impairment, self._refusing = SOUND, False

    def cut(self) -> None:
        """Reset every connection, and any new one, until `repair`; returns when that is done."""
        self._refusing = True
        asyncio.run_coroutine_threadsafe(self._reset(), self._loop).result()

    def stop(self) -> None:
        """Reset every connection, close the port and end the thread."""
        self._loop.call_soon_threadsafe(self._stopping.set)
        self._thread.join()

    async def _serve(self) -> None:
        self._loop, self._stopping = asyncio.get_running_loop(), asyncio.Event()
        with socket.create_server(("127.0.0.1", 0)) as listener:
            listener.setblocking(False)
            host, port = listener.getsockname()
            self.address = f"{host}:{port}"
            self._loop.add_reader(listener, self._accept, listener)
            self._started.set()
            await self._stopping.wait()
            self._loop.remove_reader(listener)
        await asyncio.sleep(0)  # so that what was accepted last has begun, and can end
        await self._reset()
        for line in self._lines:
            line.cancel()
        await asyncio.gather(*self._lines, return_exceptions=True)

    def _accept(self, listener: socket.socket) -> None:
        connection, _ = listener.accept()
        line = self._loop.create_task(self._connect(connection))
        self._lines.add(line)
        line.add_done_callback(self._lines.discard)

    async def _connect(self, connection: socket.socket) -> None:
        reader, writer = await asyncio.open_connection(sock=connection)
        try:
            await self._join(reader, writer)
        except OSError:
            _abort(writer)
        finally:
            await _close(writer)

    async def _join(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        if self._refusing:
            raise ConnectionRefusedError
        far_reader, far_writer = await _connected(self._target)
        ends = {writer, far_writer}
        self._ends |= ends
        try:
            await asyncio.gather(
                self._pass(reader, far_writer, Way.REQUESTS, ends), self._pass(far_reader, writer, Way.REPLIES, ends)
            )
        finally:
            self._ends -= ends
            await _close(far_writer)

    async def _pass(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, way: Way, ends: set[asyncio.StreamWriter]
    ) -> None:
        """Carry pieces one way until an end closes; then tell the other end."""
        try:
            while piece := await reader.read(LARGEST_PIECE):
                bad = self._what_befalls(way)
                if way in bad.reset:
                    for end in ends:
                        _abort(end)
                    return
                if way in bad.lost:
                    self.lost.append(piece)
                    continue
                if bad.latency or bad.jitter:
                    await asyncio.sleep(bad.latency + bad.jitter * self._random.random())
                if way in bad.flipped:
                    piece = self._with_one_bit_flipped(piece)
                await _write(writer, piece, bad.slices)
            if writer.can_write_eof():
                writer.write_eof()
        except OSError:
            for end in ends:  # one end is gone; so is the other
                _abort(end)

    def _what_befalls(self, way: Way) -> Impairment:
        """The impairment that a piece passing `way` suffers; the last one that does makes the line sound."""
        bad = self._impairment
        if bad.pieces and bad.befalls(way):
            self._left -= 1
            if self._left <= 0:
                self._impairment = SOUND
        return bad

    def _with_one_bit_flipped(self, piece: bytes) -> bytes:
        self.flips += 1
        changed = bytearray(piece)
        changed[self._random.randrange(len(piece))] ^= 1 << self._random.randrange(8)
        return bytes(changed)

    async def _reset(self) -> None:
        for end in tuple(self._ends):
            _abort(end)


async def _connected(target: str) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    if target.startswith("/"):
        return await asyncio.open_unix_connection(target)
    host, _, port = target.rpartition(":")
    return await asyncio.open_connection(host, int(port))


async def _write(writer: asyncio.StreamWriter, piece: bytes, slices: int) -> None:
    size = slices or len(piece)
    for start in range(0, len(piece), size):
        writer.write(piece[start : start + size])
        await writer.drain()
        if slices:
            await asyncio.sleep(SLICE_PAUSE)


async def _close(end: asyncio.StreamWriter) -> None:
    end.close()
    with suppress(OSError):  # how it was closed does not matter any more
        await end.wait_closed()


def _abort(end: asyncio.StreamWriter) -> None:
    """Close with a reset, as a broken line does, not with a good-bye."""
    connection: socket.socket | None = end.get_extra_info("socket")
    if connection is not None and connection.fileno() >= 0:
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    end.transport.abort()
