"""A TCP proxy that stands between nodes and their broker and breaks what goes through it, on demand.

    async with FaultProxy(broker.url) as proxy, Node("far", url=proxy.url) as node:
        proxy.delay(0.1)
        proxy.black_hole(direction=Direction.TO_NODE)
        proxy.heal()
        proxy.reset()

It works on plain sockets, so that it decides itself when it reads, and holds little. The bytes of a direction
keep their order whatever happens.
"""

from __future__ import annotations

import asyncio
import os
import socket
import struct
from contextlib import suppress
from dataclasses import replace
from random import Random
from typing import TYPE_CHECKING, Any, Final, Self

from actors.errors import WaitTimeout
from actors.testing.link_faults import Direction, Faults, LinkFaults
from actors.testing.pipe import Pipe
from proto.url import BrokerUrl, parse_url

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

BACKLOG: Final = 128

MAX_CONNECTIONS: Final = 400
"""At a time; more are refused. Each takes two of a process's descriptors, of which there may be 1024."""

KERNEL_BYTES: Final = 64 * 1024
"""What the kernel is asked to hold in each of a socket's buffers. (Linux doubles it.)"""

_LINGER_ZERO: Final = struct.pack("hh" if os.name == "nt" else "ii", 1, 0)
"""Closing with this drops what is unsent and sends a reset."""

_WAYS: Final = (Direction.TO_BROKER, Direction.TO_NODE)


class ProxiedConnection(Faults):
    """One node's connection through the proxy. Its faults are its own; the proxy's later ones go over them.

    Attributes:
        number: Which it is of the proxy's connections, from 1.
        is_open: False when both sides are closed.
        was_reset: Whether `reset` has cut it.
        was_unreachable: Whether there was no broker behind it.
    """

    def __init__(self, number: int, node: socket.socket, pipes: dict[Direction, Pipe]) -> None:
        self.number = number
        self.is_open = True
        self.was_reset = False
        self.was_unreachable = False
        self._node = node
        self._broker: socket.socket | None = None
        self._pipes = pipes
        self._task: asyncio.Task[None] | None = None
        self._cut = False

    def start(self, group: asyncio.TaskGroup, target: BrokerUrl, on_end: Callable[[], None]) -> None:
        """Connect to the broker and carry bytes, in a task of the proxy's."""
        self._task = group.create_task(self._run(target))
        self._task.add_done_callback(lambda _: self._close())  # also if it never came to run
        self._task.add_done_callback(lambda _: on_end())

    async def _run(self, target: BrokerUrl) -> None:
        try:
            self._broker = await _dial(target)
        except OSError:
            self._cut = self.was_unreachable = True
            return
        try:
            async with asyncio.TaskGroup() as ways:
                ways.create_task(self._pipes[Direction.TO_BROKER].run(self._node, self._broker))
                ways.create_task(self._pipes[Direction.TO_NODE].run(self._broker, self._node))
        except* OSError:  # one side broke: so does the other
            self._cut = True

    def _close(self) -> None:
        self.is_open = False
        _close(self._node, reset=self._cut)
        if self._broker is not None:
            _close(self._broker, reset=self._cut)

    def forwarded_bytes(self, direction: Direction = Direction.BOTH) -> int:
        """Return how many bytes have been passed on so far."""
        return sum(pipe.forwarded_bytes for way, pipe in self._pipes.items() if way in direction)

    def held_bytes(self, direction: Direction = Direction.BOTH) -> int:
        """Return how many bytes have been read and not passed on: `pipe.HELD_BYTES` at most, each way."""
        return sum(pipe.held_bytes for way, pipe in self._pipes.items() if way in direction)

    def half_close(self, *, direction: Direction) -> None:
        """End one direction; see `Faults.half_close`."""
        for way, pipe in self._pipes.items():
            if way in direction:
                pipe.end()

    def reset(self) -> None:
        """Cut both sides; see `Faults.reset`. Once it is closed this does nothing."""
        if self._task is not None and self.is_open:
            self._cut = self.was_reset = True
            self._task.cancel()

    def close(self) -> None:
        """Close both sides without a reset; what is under way is lost."""
        if self._task is not None:
            self._task.cancel()

    def change(self, direction: Direction, **changes: Any) -> None:
        """Change fields of the weather of these directions."""
        for way, pipe in self._pipes.items():
            if way in direction:
                pipe.change(**changes)


class FaultProxy(Faults):
    """Listens on a free port of 127.0.0.1 while it is entered. Faults are for all connections and later ones.

    Args:
        target_url: The broker behind it, TCP or unix. It need not be there yet.
        seed: Decides the jitter: the same seed gives the same one to the same connection.

    Attributes:
        accepted: Connections that came so far, refused ones not counted.
        refused: Connections closed at once: after `refuse`, with no broker behind, over `MAX_CONNECTIONS`.
        resets: Connections that `reset` has cut.

    Raises:
        InvalidUrlError: The URL cannot be read.
    """

    def __init__(self, target_url: str, *, seed: int = 0) -> None:
        self.accepted = 0
        self.refused = 0
        self.resets = 0
        self._target = parse_url(target_url)
        self._seed = seed
        self._link_faults = dict.fromkeys(_WAYS, LinkFaults())
        self._refusing = False
        self._connections: dict[ProxiedConnection, None] = {}
        self._past_bytes = dict.fromkeys(_WAYS, 0)
        """Passed on by connections that have ended."""
        self._group: asyncio.TaskGroup | None = None
        self._accepting: asyncio.Task[None] | None = None
        self._listener: socket.socket | None = None
        self._waiters: dict[asyncio.Event, None] = {}

    @property
    def url(self) -> str:
        """What nodes take for the broker's URL. RuntimeError if it does not listen."""
        if self._listener is None:
            raise RuntimeError("The proxy is not listening: use `async with FaultProxy(url) as proxy:`")
        return str(BrokerUrl(*self._listener.getsockname()))

    @property
    def connections(self) -> tuple[ProxiedConnection, ...]:
        """Those that are open, the oldest first."""
        return tuple(self._connections)

    def forwarded_bytes(self, direction: Direction = Direction.BOTH) -> int:
        """Return how many bytes have been passed on so far, on all connections there were."""
        past = sum(size for way, size in self._past_bytes.items() if way in direction)
        return past + sum(connection.forwarded_bytes(direction) for connection in self._connections)

    # Its life

    async def __aenter__(self) -> Self:
        """Listen."""
        if self._group is not None:
            raise RuntimeError("The proxy is listening already")
        self._listener = _listen()
        self._group = asyncio.TaskGroup()
        await self._group.__aenter__()
        self._accepting = self._group.create_task(self._accept(self._listener))
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close the listening socket and every connection."""
        assert self._group is not None
        assert self._accepting is not None
        assert self._listener is not None
        self._accepting.cancel()
        for connection in self.connections:
            connection.close()
        group, self._group = self._group, None
        try:
            await group.__aexit__(None, None, None)
        finally:
            self._listener.close()
            self._listener = None

    async def _accept(self, listener: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        while True:
            try:
                node, _ = await loop.sock_accept(listener)
            except ConnectionError:  # it has gone again already
                continue
            if self._refusing or len(self._connections) >= MAX_CONNECTIONS:
                self.refused += 1
                _close(node, reset=True)
            else:
                self._admit(node)
            self._wake()

    def _admit(self, node: socket.socket) -> None:
        assert self._group is not None
        self.accepted += 1
        number = self.accepted
        pipes = {
            way: Pipe(link_faults, Random(f"{self._seed} {number} {way}"), self._wake)  # noqa: S311
            for way, link_faults in self._link_faults.items()
        }
        connection = ProxiedConnection(number, node, pipes)
        self._connections[connection] = None
        connection.start(self._group, self._target, lambda: self._ended(connection))

    def _ended(self, connection: ProxiedConnection) -> None:
        del self._connections[connection]
        for way in _WAYS:
            self._past_bytes[way] += connection.forwarded_bytes(way)
        if connection.was_reset:
            self.resets += 1
        elif connection.was_unreachable:
            self.accepted -= 1
            self.refused += 1
        self._wake()

    # Its faults

    def refuse(self) -> None:
        """Reset every new connection at once, as if no broker were there; the others stay."""
        self._refusing = True

    def reset(self) -> None:
        """Cut every connection; see `Faults.reset`."""
        for connection in self._connections:
            connection.reset()

    def half_close(self, *, direction: Direction) -> None:
        """End one direction of every connection; see `Faults.half_close`."""
        for connection in self._connections:
            connection.half_close(direction=direction)

    def heal(self, *, direction: Direction = Direction.BOTH) -> None:
        """End every delay, drip and black hole, and for both directions also `refuse`."""
        super().heal(direction=direction)
        if direction is Direction.BOTH:
            self._refusing = False

    def change(self, direction: Direction, **changes: Any) -> None:
        """Change fields of the weather of these directions, for all connections and later ones."""
        for way in _WAYS:
            if way in direction:
                self._link_faults[way] = replace(self._link_faults[way], **changes)
        for connection in self._connections:
            connection.change(direction, **changes)

    # Waiting for it

    async def wait_until(self, condition: Callable[[], object], timeout_sec: float = 20.0) -> None:
        """Wait until the condition holds; it is looked at whenever a connection or a byte count has changed.

        Raises:
            WaitTimeout: It did not hold in time.
        """
        looks = asyncio.Event()
        self._waiters[looks] = None
        try:
            async with asyncio.timeout(timeout_sec):
                while not condition():
                    looks.clear()
                    await looks.wait()
        except TimeoutError:
            raise WaitTimeout(
                f"What was waited for at the proxy did not happen in {timeout_sec:g} s"
            ) from None
        finally:
            del self._waiters[looks]

    def _wake(self) -> None:
        for looks in self._waiters:
            looks.set()


def _listen() -> socket.socket:
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setblocking(False)  # noqa: FBT003 - socket's own
    _tune(listener)
    listener.bind(("127.0.0.1", 0))
    listener.listen(BACKLOG)
    return listener


async def _dial(target: BrokerUrl) -> socket.socket:
    """Connect to the broker, by IPv4 if it has a name."""
    place: str | tuple[str, int] = target.path or (target.host, target.port)
    family = socket.AF_INET6 if ":" in target.host else socket.AF_INET
    if target.path:
        family = socket.AF_UNIX
    sock = socket.socket(family, socket.SOCK_STREAM)
    try:
        sock.setblocking(False)  # noqa: FBT003 - socket's own
        _tune(sock)
        await asyncio.get_running_loop().sock_connect(sock, place)
    except BaseException:
        sock.close()
        raise
    return sock


def _tune(sock: socket.socket) -> None:
    """Pass small things on at once, and let the kernel hold little; what is accepted inherits this."""
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, KERNEL_BYTES)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, KERNEL_BYTES)
    if sock.family in {socket.AF_INET, socket.AF_INET6}:
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)


def _close(sock: socket.socket, *, reset: bool) -> None:
    if reset and sock.family in {socket.AF_INET, socket.AF_INET6}:
        with suppress(OSError):
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _LINGER_ZERO)
    sock.close()
