"""An in-memory network: connections delay, split and coalesce bytes as the seed determines, and break.

A connection is two pipes. A pipe models the path between two asyncio transports: the sender's write buffer,
a window of bytes in the kernels, and the receiver's unread bytes. Bytes of one pipe keep their order;
pipes are independent of each other, so everything else may be reordered.

Connections are between *hosts*. The host is a context variable, which a node's tasks inherit; partitions and
crashes apply to hosts.
"""

from __future__ import annotations

import asyncio
import errno
import hashlib
from collections import deque
from contextlib import contextmanager
from contextvars import Context, ContextVar, copy_context
from dataclasses import dataclass
from random import Random
from typing import TYPE_CHECKING, Any, Final, cast

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

BROKER: Final = "broker"
HIGH_WATER: Final = 64 * 1024

_host: Final[ContextVar[str]] = ContextVar("simulated_host", default="nowhere")


_KERNEL: Final = Context()
"""Where what no process does happens: it goes on while processes are frozen."""


def host_in(context: Context) -> str:
    """Return the host of a context."""
    return context.get(_host, "nowhere")


@contextmanager
def on_host(name: str) -> Iterator[None]:
    """Connect and listen on this host in the block, and in tasks started in it."""
    token = _host.set(name)
    try:
        yield
    finally:
        _host.reset(token)


@dataclass(kw_only=True)
class LinkFaults:
    """How a pipe treats its bytes. Times in seconds, sizes in bytes."""

    delay: float = 0.0005
    jitter: float = 0.002
    segment: int = 64 * 1024
    window: int = 128 * 1024
    read: int = 512 * 1024
    """Largest size of one read."""
    read_pause: float = 0.0
    """Pause between two reads: a slow reader."""


_FIN: Final = "fin"
_RESET: Final = "reset"

_FINE: Final = 1000
"""After so many segments, or reads, a pipe takes larger ones: the point has been made."""

_COARSE: Final = 64 * 1024


class Pipe:
    """One direction of a connection.

    Attributes:
        link_faults: How it treats its bytes; may be changed at any time.
        unsent: The sender's write buffer.
    """

    def __init__(self, network: Network, name: str, link_faults: LinkFaults) -> None:
        self.link_faults = link_faults
        self.name = name
        self.source: MemoryTransport
        self.target: MemoryTransport
        self.unsent = bytearray()
        self._network = network
        self._random = Random(f"{network.seed} {name}")
        self._loop = network.loop
        self._flight: deque[bytes | str] = deque()
        self._due: deque[float] = deque()
        self._in_flight = 0
        self._arrived = bytearray()
        self._end: str | None = None
        self._segments = self._reads = 0
        self._last_arrival = 0.0
        self._read_due = False
        self._read_at = 0.0
        self._ended: str | None = None

    def write(self, data: bytes) -> None:
        """Take bytes from the sender into the window; bytes beyond it wait."""
        self.unsent += data
        self.pump()

    def pump(self) -> None:
        """Move unsent bytes into the window, in segments that arrive one after the other."""
        while self.unsent and self._ended is None:
            room = self.link_faults.window - self._in_flight - len(self._arrived)
            if room <= 0:
                return
            self._segments += 1
            most = self.link_faults.segment if self._segments < _FINE else _COARSE
            size = min(room, len(self.unsent), 1 + int(self._random.random() * most))
            segment = bytes(self.unsent[:size])
            del self.unsent[:size]
            self._in_flight += size
            self._send(segment)

    def end(self, kind: str) -> None:
        """Close the sender: FIN after the bytes in the kernel, or RST instead of them."""
        if self._ended == kind or self._ended == _RESET:
            return
        if kind == _RESET and self._ended is None:
            self._flight.clear()
            self._due.clear()
            self._in_flight = 0
        self._ended = kind
        self.unsent.clear()
        self._send(kind)

    def _send(self, item: bytes | str) -> None:
        link_faults = self.link_faults
        delay = link_faults.delay + self._random.random() * link_faults.jitter
        self._last_arrival = max(self._last_arrival, self._loop.time() + delay)
        self._flight.append(item)
        self._due.append(self._last_arrival)
        self._loop.call_at(self._last_arrival, self.arrive, context=_KERNEL)

    def arrive(self) -> None:
        """Deliver bytes whose travel time is over, unless the path is blocked: then later, like TCP."""
        # A loop runs a timer up to its clock's resolution early.
        now = self._loop.time() + 1e-6
        while self._due and self._due[0] <= now and not self._network.blocked(self):
            self._due.popleft()
            item = self._flight.popleft()
            if isinstance(item, bytes):
                self._in_flight -= len(item)
                if self.target.closed:
                    self.target.refuse()
                else:
                    self._arrived += item
            elif self._end != _RESET:
                self._end = item
                if item == _RESET:
                    self.target.reset_arrived()
            self.read_soon()

    def read_soon(self) -> None:
        """Let the receiver read, after its pause."""
        if self._read_due or not (self._arrived or self._end):
            return
        self._read_due = True
        if self._read_at <= self._loop.time():
            self._loop.call_soon(self._read, context=self.target.context)
        else:
            self._loop.call_at(self._read_at, self._read, context=self.target.context)

    def _read(self) -> None:
        self._read_due = False
        self._read_at = self._loop.time() + self.link_faults.read_pause
        if not self.target.reading:
            return
        if self._arrived:
            self._reads += 1
            coarse = self._reads > _FINE and not self.link_faults.read_pause
            most = max(_COARSE, self.link_faults.read) if coarse else self.link_faults.read
            size = self.target.take(self._arrived, 1 + int(self._random.random() * most))
            self._network.record(self.name, size)
            if self.unsent:
                self.pump()
            if self.source.waits:
                self._loop.call_soon(self.source.drained, context=self.source.context)
            self.read_soon()
        elif self._end is not None:
            kind, self._end = self._end, None
            self._network.record(self.name, kind)
            self.target.end_arrived(kind)

    @property
    def unread(self) -> int:
        """Number of bytes that have arrived and are unread."""
        return len(self._arrived)

    def discard(self) -> None:
        """Close the receiver and discard its unread bytes."""
        self._arrived.clear()


class MemoryTransport(asyncio.Transport):
    """One end of a connection, which behaves like asyncio's socket transport.

    Attributes:
        context: In which its protocol is called: that of whoever connected or listened, as a loop's readers.
    """

    def __init__(self, network: Network, out: Pipe, into: Pipe, peer: str, context: Context) -> None:
        host = host_in(context)
        super().__init__({"peername": (peer, 1), "sockname": (host, 1)})
        self.context = context
        self.host = host
        self.peer = peer
        self.server: MemoryServer | None = None
        self.reading = False
        """Not before it has a protocol: a frozen host accepts late."""
        self.closed = False
        self._network = network
        self._out = out
        self._into = into
        out.source = self
        into.target = self
        self._protocol: asyncio.BufferedProtocol
        self._closing = False
        self._reset = False
        self._paused = False
        self._high, self._low = HIGH_WATER, HIGH_WATER // 4

    def start(self, protocol: asyncio.BufferedProtocol) -> None:
        """Give the end to its protocol."""
        self._protocol = protocol
        self.reading = True
        protocol.connection_made(self)
        self._into.read_soon()

    # What a protocol uses

    def set_protocol(self, protocol: asyncio.BaseProtocol) -> None:
        """Part of asyncio.Transport."""
        self._protocol = cast("asyncio.BufferedProtocol", protocol)

    def get_protocol(self) -> asyncio.BaseProtocol:
        """Part of asyncio.Transport."""
        return self._protocol

    def is_closing(self) -> bool:
        """Part of asyncio.Transport."""
        return self._closing

    def is_reading(self) -> bool:
        """Part of asyncio.Transport."""
        return self.reading

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        """Part of asyncio.Transport."""
        self._high = HIGH_WATER if high is None else high
        self._low = self._high // 4 if low is None else low

    def get_write_buffer_limits(self) -> tuple[int, int]:
        """Part of asyncio.Transport."""
        return self._low, self._high

    def get_write_buffer_size(self) -> int:
        """Part of asyncio.Transport."""
        return len(self._out.unsent)

    def pause_reading(self) -> None:
        """Part of asyncio.Transport."""
        self.reading = False

    def resume_reading(self) -> None:
        """Part of asyncio.Transport."""
        if not self._closing and not self.reading:
            self.reading = True
            self._into.read_soon()

    def can_write_eof(self) -> bool:
        """Part of asyncio.Transport."""
        return False

    def write(self, data: Any) -> None:
        """Part of asyncio.Transport."""
        if self.closed:
            return
        if self._reset:
            self._lose(_reset_error())
            return
        self._out.write(bytes(data))
        if len(self._out.unsent) > self._high and not self._paused:
            self._paused = True
            self._protocol.pause_writing()

    def writelines(self, list_of_data: Any) -> None:
        """Part of asyncio.Transport."""
        self.write(b"".join(list_of_data))

    def close(self) -> None:
        """Part of asyncio.Transport: flush, then close."""
        if self._closing:
            return
        self._closing = True
        self.reading = False
        if not self._out.unsent:
            self._lose(None)

    def abort(self) -> None:
        """Part of asyncio.Transport: close now."""
        self._lose(None)

    # What the pipes tell

    def take(self, arrived: bytearray, most: int) -> int:
        """Read into the protocol's buffer; return how much."""
        buffer = memoryview(cast("memoryview", self._protocol.get_buffer(-1)))
        size = min(len(buffer), len(arrived), most)
        buffer[:size] = arrived[:size]
        del arrived[:size]
        self._protocol.buffer_updated(size)
        return size

    @property
    def waits(self) -> bool:
        """Whether the protocol must be notified when the write buffer has space."""
        return self._paused or (self._closing and not self.closed)

    def drained(self) -> None:
        """Handle that the pipe has taken bytes from the write buffer."""
        if self._paused and len(self._out.unsent) <= self._low and not self.closed:
            self._paused = False
            self._protocol.resume_writing()
        if self._closing and not self._out.unsent:
            self._lose(None)

    def refused(self) -> None:
        """Reset a connection whose listener was closed before it accepted it."""
        self.closed = self._closing = True
        self._out.end(_RESET)
        self._network.ended(self)

    def refuse(self) -> None:
        """Answer bytes for a closed end with a reset, as its kernel does."""
        self._out.end(_RESET)

    def reset_arrived(self) -> None:
        """Let writing fail from now on."""
        self._reset = True
        if self._closing:
            self._lose(_reset_error())

    def end_arrived(self, kind: str) -> None:
        """Handle that everything has been read."""
        if self.closed:
            return
        if kind == _RESET:
            self._lose(_reset_error())
        elif self._protocol.eof_received():
            self.reading = False
        else:
            self.close()

    # The end

    def cut(self) -> None:
        """Break the connection for both ends: each gets a reset."""
        self._out.end(_RESET)

    def _lose(self, error: Exception | None) -> None:
        if self.closed:
            return
        self.closed = self._closing = True
        self.reading = False
        self._out.end(_RESET if self._into.unread else _FIN)
        self._into.discard()
        self._network.ended(self)
        self._network.loop.call_soon(self._protocol.connection_lost, error, context=self.context)


def _reset_error() -> ConnectionResetError:
    return ConnectionResetError(errno.ECONNRESET, "Connection reset by peer")


class _Socket:
    """A server's socket in this network: a name."""

    family = 0

    def __init__(self, name: object) -> None:
        self._name = name

    def getsockname(self) -> object:
        """Return (host, port), or the path."""
        return self._name

    def fileno(self) -> int:
        """There is no descriptor."""
        return -1


class MemoryServer:
    """A listener that behaves like asyncio.Server (of 3.12: `wait_closed` waits for the connections)."""

    def __init__(self, network: Network, address: str, name: object, factory: Callable[[], Any]) -> None:
        self.context = copy_context()
        self.host = host_in(self.context)
        self.factory = factory
        self.address = address
        self.sockets: tuple[_Socket, ...] = (_Socket(name),)
        self._network = network

    def close(self) -> None:
        """Part of asyncio.Server."""
        self.sockets = ()
        self._network.unlisten(self)

    def is_serving(self) -> bool:
        """Part of asyncio.Server."""
        return bool(self.sockets)

    async def start_serving(self) -> None:
        """Part of asyncio.Server."""

    async def wait_closed(self) -> None:
        """Part of asyncio.Server."""
        while any(transport.server is self for transport in self._network.open):
            await self._network.change()


class Network:
    """All connections, and the faults that can be applied to them.

    Attributes:
        open: The transports that are not closed.
        connections: How many there have been.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, seed: int) -> None:
        self.loop = loop
        self.seed = seed
        self.open: dict[MemoryTransport, None] = {}
        self.connections = 0
        self.choose_link_faults: Callable[[Random], LinkFaults] = lambda _: LinkFaults()
        self._random = Random(f"{seed} network")
        self._listeners: dict[str, MemoryServer] = {}
        self.pipes: list[Pipe] = []
        self._holes: set[tuple[str, str]] = set()
        self._dead: set[str] = set()
        self._next_port = 40_000
        self._trace = hashlib.blake2b(digest_size=16)
        self._waiters: list[asyncio.Future[None]] = []

    def record(self, *what: object) -> None:
        """Add to the history, of which `digest` is the hash."""
        self._trace.update(f"{self.loop.time():.9f} {what}".encode())

    @property
    def digest(self) -> str:
        """A hash of everything that has happened so far."""
        return self._trace.hexdigest()

    # Connecting

    def listen(self, factory: Callable[[], Any], host: Any, port: int | None) -> MemoryServer:
        """Accept connections at host and port, or at a path (no port)."""
        if port == 0:
            self._next_port += 1
            port = self._next_port
        if isinstance(host, (list, tuple)):
            host = host[0]
        name: object = host if port is None else (host or "127.0.0.1", port)
        address = str(host) if port is None else f"{host or '127.0.0.1'}:{port}"
        if address in self._listeners:
            raise OSError(errno.EADDRINUSE, f"Address already in use: {address}")
        server = self._listeners[address] = MemoryServer(self, address, name, factory)
        self._dead.discard(server.host)
        return server

    def unlisten(self, server: MemoryServer) -> None:
        """Accept no more connections."""
        if self._listeners.get(server.address) is server:
            del self._listeners[server.address]

    async def connect(
        self, factory: Callable[[], Any], address: str
    ) -> tuple[MemoryTransport, asyncio.BaseProtocol]:
        """Connect from the current host; raise the OSError that a kernel would."""
        here = _host.get()
        await asyncio.sleep(0.0001 + 0.002 * self._random.random())
        while True:
            server = self._listeners.get(address)
            if here in self._dead:
                raise OSError(errno.ENETUNREACH, "Network is unreachable")
            there = BROKER if server is None else server.host
            if not {(here, there), (there, here)} & self._holes:
                break
            await self.change()
        if server is None:
            raise ConnectionRefusedError(errno.ECONNREFUSED, f"Connection refused: {address}")
        client, accepted = self._pair(here, server)
        self.loop.call_soon(self._accept, accepted, server, context=accepted.context)
        protocol = factory()
        client.start(protocol)
        return client, protocol

    def _accept(self, accepted: MemoryTransport, server: MemoryServer) -> None:
        if server.sockets:
            accepted.start(server.factory())
        else:
            accepted.refused()

    def _pair(self, here: str, server: MemoryServer) -> tuple[MemoryTransport, MemoryTransport]:
        number, there = self.connections, server.host
        self.connections += 1
        up = Pipe(self, f"{number} {here}>{there}", self.choose_link_faults(self._random))
        down = Pipe(self, f"{number} {there}>{here}", self.choose_link_faults(self._random))
        self.pipes += [up, down]
        client = MemoryTransport(self, up, down, there, copy_context())
        accepted = MemoryTransport(self, down, up, here, server.context.copy())
        accepted.server = server
        self.open[client] = self.open[accepted] = None
        self.record("connected", here, there)
        return client, accepted

    def ended(self, transport: MemoryTransport) -> None:
        """Handle that a transport has closed."""
        self.open.pop(transport, None)
        self._changed()

    async def change(self) -> None:
        """Wait until something about the network has changed."""
        waiter = self.loop.create_future()
        self._waiters.append(waiter)
        await waiter

    def _changed(self) -> None:
        waiters, self._waiters = self._waiters, []
        for waiter in waiters:
            if not waiter.done():
                waiter.set_result(None)

    # What goes wrong

    def blocked(self, pipe: Pipe) -> bool:
        """Return whether a pipe is blocked."""
        return (pipe.source.host, pipe.target.host) in self._holes

    def block(self, source: str, target: str) -> None:
        """Hold the bytes of one direction until `heal`."""
        self.record("block", source, target)
        self._holes.add((source, target))

    def partition(self, host: str) -> None:
        """Hold the bytes between a host and all others, including new connections."""
        others = {pipe.source.host for pipe in self.pipes} | {BROKER}
        for other in sorted(others - {host}):
            self.block(host, other)
            self.block(other, host)

    def drop(self, host: str) -> None:
        """Break every connection of a host, which may connect again at once."""
        self.record("drop", host)
        for transport in tuple(self.open):
            if host in {transport.host, transport.peer}:
                transport.cut()

    def crash(self, host: str, *, silent: bool = False) -> None:
        """Remove the host, with a reset to its peers or (power failure) without one."""
        self.record("crash", host, silent)
        if silent:
            self.partition(host)
        self.drop(host)
        self._dead.add(host)
        for server in tuple(self._listeners.values()):
            if server.host == host:
                server.close()
        self._changed()

    def slow_down(self, host: str, *, read: int, pause: float) -> None:
        """Limit the size and rate of a host's reads."""
        self.record("slow", host)
        for pipe in self.pipes:
            if pipe.target.host == host:
                pipe.link_faults.read, pipe.link_faults.read_pause = read, pause

    def heal(self) -> None:
        """Remove all black holes and slow readers."""
        self.record("heal")
        self._holes.clear()
        for pipe in self.pipes:
            pipe.link_faults.read, pipe.link_faults.read_pause = LinkFaults.read, 0.0
            pipe.arrive()
        self._changed()
