"""The servers that share the requests of one service; finds the one with the fewest pending calls in O(1).

Servers are kept on levels by their number of pending calls. Of the lowest level the server that has been
there longest is next, so that ties rotate. A lone server, the usual case, needs no levels.

A client whose node is kept apart from some of the servers (`NodeRecord.kept_apart`) gets the pool of the
others. That is made when such a client first calls, and kept while it differs.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

if TYPE_CHECKING:
    from collections.abc import Iterator


class Server(Protocol):
    """Anything with pending calls."""

    pending: dict[int, Any]

    @property
    def apart(self) -> str:
        """Clients with the same text do not call it, unless it is empty."""
        ...


ServerT = TypeVar("ServerT", bound=Server)


class Pool(Generic[ServerT]):
    """The servers of one type at one service name. Their `pending` are the calls they have not answered."""

    __slots__ = ("_apart", "_levels", "_lowest", "_parts", "_servers")

    def __init__(self) -> None:
        self._servers: dict[ServerT, int] = {}
        """Each server and its level."""
        self._levels: dict[int, dict[ServerT, None]] = {}
        self._lowest = 0
        self._apart: Counter[str] | None = None
        """How many servers have which `apart`, if it is not empty; None without any."""
        self._parts: dict[str, Pool[ServerT]] = {}
        """By `apart`, the servers with another one."""

    def __len__(self) -> int:
        return len(self._servers)

    def __iter__(self) -> Iterator[ServerT]:
        return iter(self._servers)

    def add(self, server: ServerT) -> None:
        """Add a server."""
        # With the second server the levels begin, and both are put on theirs: their calls may differ by now.
        self._servers[server] = 0
        if len(self._servers) == 2:
            for each in self._servers:
                self._put(each)
        elif len(self._servers) > 2:
            self._put(server)
        if server.apart:
            self._apart = self._apart or Counter()
            self._apart[server.apart] += 1
        for apart, part in self._parts.items():
            if apart != server.apart:
                part.add(server)

    def remove(self, server: ServerT) -> None:
        """Remove a server."""
        for apart, part in self._parts.items():
            if apart != server.apart:
                part.remove(server)
        if self._apart is not None and server.apart:
            self._apart[server.apart] -= 1
            if not self._apart[server.apart]:
                del self._apart[server.apart]
                self._parts.pop(server.apart, None)
            self._apart = self._apart or None
        level = self._servers.pop(server)
        if self._levels:
            self._unlist(server, level)
            if len(self._servers) == 1:
                self._levels.clear()

    def without(self, apart: str) -> Pool[ServerT]:
        """Return the servers that a client with this `apart` may call."""
        if not apart or self._apart is None or apart not in self._apart:
            return self
        part = self._parts.get(apart)
        if part is None:
            part = self._parts[apart] = Pool()
            for server in self._servers:
                if server.apart != apart:
                    part.add(server)
        return part

    def least_busy(self) -> ServerT | None:
        """Return the server for the next request, or None."""
        if not self._levels:
            return next(iter(self._servers), None)
        while self._lowest not in self._levels:
            self._lowest += 1
        return next(iter(self._levels[self._lowest]))

    def update(self, server: ServerT) -> None:
        """Note that a server has got a call, or has ended one."""
        # A retired server is in no pool any more, but still ends its pending calls.
        if self._levels and server in self._servers:
            self._unlist(server, self._servers[server])
            self._put(server)
        if self._parts:
            for apart, part in self._parts.items():
                if apart != server.apart:
                    part.update(server)

    def _put(self, server: ServerT) -> None:
        # To the end of its level: ties rotate.
        level = self._servers[server] = len(server.pending)
        self._levels.setdefault(level, {})[server] = None
        self._lowest = min(self._lowest, level)

    def _unlist(self, server: ServerT, level: int) -> None:
        on_level = self._levels[level]
        del on_level[server]
        if not on_level:
            del self._levels[level]
