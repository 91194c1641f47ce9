"""Accepts connections, and opens them one after the other, each address in turn.

The kernel returns connections in the order of their arrival, and to open one costs ten times as much as to
accept it. So all are accepted at once, and a burst of one address delays connections of others by one only.
"""

from __future__ import annotations

import asyncio
from collections import deque
from typing import TYPE_CHECKING, Generic, TypeVar

from actors.web import limits
from proto.aio.tasks import cancel_and_wait, keep_running
from proto.wire.addresses import Address, owned_by_one, parse_address

if TYPE_CHECKING:
    import socket
    from collections.abc import Callable, Sequence

Item = TypeVar("Item")


class AddressQueues(Generic[Item]):
    """A queue for each address or IPv6 network."""

    def __init__(self) -> None:
        self._queues: dict[Address, deque[Item]] = {}
        self._count = 0

    def __len__(self) -> int:
        """Return how many wait, of all addresses."""
        return self._count

    def add(self, source: Address, item: Item, limit: int | None = None) -> Item | None:
        """Add an item.

        Args:
            source: The address that it comes from.
            item: The item.
            limit: How many of the address may wait; None for any number.

        Returns:
            The oldest item of the address if it makes room; None if none must.
        """
        queue = self._queues.setdefault(source, deque())
        queue.append(item)
        if limit is not None and len(queue) > limit:
            return queue.popleft()
        self._count += 1
        return None

    def pop(self) -> Item:
        """Return the oldest item of the address whose turn it is; one must wait."""
        source = next(iter(self._queues))
        queue = self._queues.pop(source)
        if len(queue) > 1:
            self._queues[source] = queue  # after all others
        self._count -= 1
        return queue.popleft()


class Acceptor:
    """Accepts the connections of some sockets.

    Args:
        connect: Returns the protocol of a new connection.
        on_dropped: Called with the address of a connection that made room for another one.
    """

    def __init__(
        self, connect: Callable[[], asyncio.BaseProtocol], on_dropped: Callable[[Address], object]
    ) -> None:
        self._connect, self._on_dropped = connect, on_dropped
        self._queues = AddressQueues["socket.socket"]()
        self._arrived = asyncio.Event()
        self._sockets: Sequence[socket.socket] = ()
        self._tasks: list[asyncio.Task[None]] = []

    def start(self, sockets: Sequence[socket.socket]) -> None:
        """Accept connections from now on.

        Args:
            sockets: They listen and do not block; `stop` closes them.
        """
        self._sockets, loop = sockets, asyncio.get_running_loop()

        def accept(sock: socket.socket) -> asyncio.Task[None]:
            # If there is no file descriptor left, it is tried again a second later.
            return loop.create_task(keep_running("Accepting connections", lambda: self._accept(sock)))

        self._tasks = [*map(accept, sockets)]
        self._tasks.append(loop.create_task(keep_running("Opening connections", self._open)))

    async def stop(self) -> None:
        """Accept no more, and close connections that wait."""
        for task in self._tasks:
            await cancel_and_wait(task)
        while self._queues:
            self._queues.pop().close()
        for sock in self._sockets:  # after the tasks: the loop must not watch a closed socket
            sock.close()

    async def _accept(self, listening: socket.socket) -> None:
        loop = asyncio.get_running_loop()
        while True:
            # Those of many addresses may fill the queues; the kernel keeps the rest then.
            room = limits.MAX_CONNECTIONS - len(self._queues)
            for _ in range(min(limits.ACCEPTS_PER_TURN, room)):
                try:
                    sock, peer = await loop.sock_accept(listening)
                except ConnectionAbortedError:  # by the client
                    continue
                source = owned_by_one(parse_address(peer[0]))
                dropped = self._queues.add(source, sock, limits.MAX_HOLDER_CONNECTIONS)
                if dropped is not None:
                    self._on_dropped(source)
                    dropped.close()
                self._arrived.set()
            await asyncio.sleep(0)

    async def _open(self) -> None:
        loop = asyncio.get_running_loop()
        while True:
            await self._arrived.wait()
            while self._queues:
                sock = self._queues.pop()
                try:
                    await loop.connect_accepted_socket(self._connect, sock)
                except OSError:  # the client has gone
                    sock.close()
            self._arrived.clear()
