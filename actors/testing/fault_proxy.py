"""A TCP proxy between nodes and their broker that breaks connections on demand.

    async with FaultProxy(broker.url) as proxy, Node("far", url=proxy.url) as node:
        proxy.delay(0.1)
        proxy.black_hole(direction=Direction.TO_NODE)
        proxy.heal()
        proxy.reset()

It uses plain sockets, so that it controls when it reads and buffers little. The bytes of one direction always
keep their order.
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
from actors.testing.changes import ChangeSignal
from actors.testing.link_faults import Direction, Faults, LinkFaults
from actors.testing.pipe import Pipe
from proto.wire.url import BrokerUrl, parse_url

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import TracebackType

BACKLOG: Final = 128

MAX_CONNECTIONS: Final = 400
"""Open at a time; more are refused. Each takes two descriptors, and a process often has 1024."""

KERNEL_BYTES: Final = 64 * 1024
"""Requested size of each kernel buffer of a socket. (Linux doubles it.)"""

_LINGER_ZERO: Final = struct.pack("hh" if os.name == "nt" else "ii", 1, 0)
"""Closing with this option drops unsent bytes and sends a reset."""

_DIRECTIONS: Final = (Direction.TO_BROKER, Direction.TO_NODE)


class ProxiedConnection(Faults):
    """One node's connection through the proxy. Later faults of the proxy replace its own.

    Attributes:
        number: Its number among the proxy's connections, from 1.
        is_open: False once both sides are closed.
        was_reset: Whether `reset` has cut it.
        was_unreachable: Whether the proxy could not connect to the broker.
    """

    def __init__(self, number: int, _node: socket.socket, _pipes: dict[Direction, Pipe]) -> None:
        self.number = number
        self.is_open = True
        self.was_reset = False
        self.was_unreachable = False
        self._node = _node
        self._broker: socket.socket | None = None
        self._pipes = _pipes
        self._task: asyncio.Task[None] | None = None
        self._cut = False

    def start(self, group: asyncio.TaskGroup, target: BrokerUrl, on_end: Callable[[], None]) -> None:
        """Connect to the broker and carry bytes; the proxy calls this.

        Args:
            group: The proxy's tasks.
            target: The broker.
            on_end: Called when both sides are closed.
        """
        self._task = group.create_task(self._run(target))
        self._task.add_done_callback(lambda _: self._close())  # also if it was cancelled before it ran
        self._task.add_done_callback(lambda _: on_end())

    async def _run(self, target: BrokerUrl) -> None:
        try:
            self._broker = await _connect(target)
        except OSError:
            self._cut = self.was_unreachable = True
            return
        try:
            async with asyncio.TaskGroup() as group:
                group.create_task(self._pipes[Direction.TO_BROKER].run(self._node, self._broker))
                group.create_task(self._pipes[Direction.TO_NODE].run(self._broker, self._node))
        except* OSError:  # one side broke; break the other too
            self._cut = True

    def _close(self) -> None:
        self.is_open = False
        _close(self._node, reset=self._cut)
        if self._broker is not None:
            _close(self._broker, reset=self._cut)

    def _pipes_of(self, direction: Direction) -> Iterator[Pipe]:
        return (pipe for each, pipe in self._pipes.items() if each in direction)

    def forwarded_bytes(self, direction: Direction = Direction.BOTH) -> int:
        """Return how many bytes have been passed on so far.

        Args:
            direction: Which bytes.
        """
        return sum(pipe.forwarded_bytes for pipe in self._pipes_of(direction))

    def held_bytes(self, direction: Direction = Direction.BOTH) -> int:
        """Return how many bytes have been read and not passed on: `pipe.HELD_BYTES` at most per direction.

        Args:
            direction: Which bytes.
        """
        return sum(pipe.held_bytes for pipe in self._pipes_of(direction))

    def half_close(self, *, direction: Direction) -> None:
        """End one direction; see `Faults.half_close`.

        Args:
            direction: Which one.
        """
        for pipe in self._pipes_of(direction):
            pipe.end()

    def reset(self) -> None:
        """Cut both sides; see `Faults.reset`. Does nothing on a closed connection."""
        if self._task is not None and self.is_open:
            self._cut = self.was_reset = True
            self._task.cancel()

    def close(self) -> None:
        """Close both sides without a reset; bytes in transit are lost."""
        if self._task is not None:
            self._task.cancel()

    def change(self, direction: Direction, **changes: Any) -> None:
        """Change the faults of one or both directions; see `Faults.change`.

        Args:
            direction: Which bytes.
            changes: New values of fields of `LinkFaults`.
        """
        for pipe in self._pipes_of(direction):
            pipe.change(**changes)


class FaultProxy(Faults):
    """Listens on a free port of 127.0.0.1 while entered. Its faults apply to open and later connections.

    Args:
        target_url: The broker's URL, TCP or unix. The broker may start later.
        seed: Seed of the jitter; the same seed gives the same connection the same jitter.

    Attributes:
        accepted: Connections so far, without refused ones.
        refused: Connections closed at once: after `refuse`, without a broker, or over `MAX_CONNECTIONS`.
        resets: Connections cut by `reset`.

    Raises:
        InvalidUrlError: The URL cannot be read.
    """

    def __init__(self, target_url: str, *, seed: int = 0) -> None:
        self.accepted = 0
        self.refused = 0
        self.resets = 0
        self._target = parse_url(target_url)
        self._seed = seed
        self._link_faults = dict.fromkeys(_DIRECTIONS, LinkFaults())
        self._refusing = False
        self._connections: dict[ProxiedConnection, None] = {}
        self._past_bytes = dict.fromkeys(_DIRECTIONS, 0)
        """Passed on by ended connections."""
        self._group: asyncio.TaskGroup | None = None
        self._accepting: asyncio.Task[None] | None = None
        self._listener: socket.socket | None = None
        self._changes = ChangeSignal()

    @property
    def url(self) -> str:
        """The proxy's own URL, for nodes; RuntimeError while it does not listen."""
        if self._listener is None:
            raise RuntimeError("The proxy is not listening: use `async with FaultProxy(url) as proxy:`")
        host, port = self._listener.getsockname()
        return str(BrokerUrl(host, port, tls=self._target.tls))

    @property
    def connections(self) -> tuple[ProxiedConnection, ...]:
        """The open connections, the oldest first."""
        return tuple(self._connections)

    def forwarded_bytes(self, direction: Direction = Direction.BOTH) -> int:
        """Return how many bytes have been passed on so far, on all connections, ended ones too.

        Args:
            direction: Which bytes.
        """
        past = sum(size for each, size in self._past_bytes.items() if each in direction)
        return past + sum(connection.forwarded_bytes(direction) for connection in self._connections)

    async def __aenter__(self) -> Self:
        """Listen.

        Raises:
            RuntimeError: It is listening already.
        """
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
            except ConnectionError:  # the client has already gone
                continue
            if self._refusing or len(self._connections) >= MAX_CONNECTIONS:
                self.refused += 1
                _close(node, reset=True)
            else:
                self._admit(node)
            self._changes.notify()

    def _admit(self, node: socket.socket) -> None:
        assert self._group is not None
        self.accepted += 1
        number = self.accepted
        pipes = {
            each: Pipe(link_faults, Random(f"{self._seed} {number} {each}"), self._changes.notify)  # noqa: S311
            for each, link_faults in self._link_faults.items()
        }
        connection = ProxiedConnection(number, node, pipes)
        self._connections[connection] = None
        connection.start(self._group, self._target, lambda: self._ended(connection))

    def _ended(self, connection: ProxiedConnection) -> None:
        del self._connections[connection]
        for each in _DIRECTIONS:
            self._past_bytes[each] += connection.forwarded_bytes(each)
        if connection.was_reset:
            self.resets += 1
        elif connection.was_unreachable:
            self.accepted -= 1
            self.refused += 1
        self._changes.notify()

    def refuse(self) -> None:
        """Reset every new connection at once, as if there were no broker; open ones stay."""
        self._refusing = True

    def reset(self) -> None:
        """Cut every connection; see `Faults.reset`."""
        for connection in self._connections:
            connection.reset()

    def half_close(self, *, direction: Direction) -> None:
        """End one direction of every connection; see `Faults.half_close`.

        Args:
            direction: Which one.
        """
        for connection in self._connections:
            connection.half_close(direction=direction)

    def heal(self, *, direction: Direction = Direction.BOTH) -> None:
        """End every delay, drip and black hole, and for both directions also `refuse`.

        Args:
            direction: Which bytes.
        """
        super().heal(direction=direction)
        if direction is Direction.BOTH:
            self._refusing = False

    def change(self, direction: Direction, **changes: Any) -> None:
        """Change the faults of one or both directions, for all connections and later ones.

        Args:
            direction: Which bytes.
            changes: New values of fields of `LinkFaults`.
        """
        for each in _DIRECTIONS:
            if each in direction:
                self._link_faults[each] = replace(self._link_faults[each], **changes)
        for connection in self._connections:
            connection.change(direction, **changes)

    async def wait_until(self, condition: Callable[[], object], timeout_sec: float = 20.0) -> None:
        """Wait until a condition holds.

        Args:
            condition: Called at once and after each change of a connection or a byte count.
            timeout_sec: Deadline in seconds.

        Raises:
            WaitTimeout: It did not hold in time.
        """
        try:
            async with asyncio.timeout(timeout_sec):
                await self._changes.wait_for(lambda: True if condition() else None)
        except TimeoutError:
            raise WaitTimeout(f"The condition at the proxy did not hold within {timeout_sec:g} s") from None


def _listen() -> socket.socket:
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setblocking(False)  # noqa: FBT003 - socket's own
    _tune(listener)
    listener.bind(("127.0.0.1", 0))
    listener.listen(BACKLOG)
    return listener


async def _connect(target: BrokerUrl) -> socket.socket:
    """Connect to the broker; a host name is resolved to IPv4."""
    address: str | tuple[str, int] = target.path or (target.host, target.port)
    family = socket.AF_INET6 if ":" in target.host else socket.AF_INET
    if target.path:
        family = socket.AF_UNIX
    sock = socket.socket(family, socket.SOCK_STREAM)
    try:
        sock.setblocking(False)  # noqa: FBT003 - socket's own
        _tune(sock)
        await asyncio.get_running_loop().sock_connect(sock, address)
    except BaseException:
        sock.close()
        raise
    return sock


def _tune(sock: socket.socket) -> None:
    """Send small pieces at once and keep kernel buffers small; accepted sockets inherit this."""
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, KERNEL_BYTES)
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, KERNEL_BYTES)
    if sock.family in {socket.AF_INET, socket.AF_INET6}:
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)


def _close(sock: socket.socket, *, reset: bool) -> None:
    if reset and sock.family in {socket.AF_INET, socket.AF_INET6}:
        with suppress(OSError):
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, _LINGER_ZERO)
    sock.close()
