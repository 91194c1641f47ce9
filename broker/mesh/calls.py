"""The calls of this broker's nodes to servers of other brokers."""

from __future__ import annotations

from typing import NamedTuple


class MeshCall(NamedTuple):
    """A call without a reply: the number of its client, and the id of its server at the router."""

    client: int
    server: int


class MeshCalls:
    """The calls of one graph to other brokers, by the router's call ids.

    Each is also pending at the router, which limits them.
    """

    def __init__(self) -> None:
        self._calls: dict[int, MeshCall] = {}
        self._of_servers: dict[int, set[int]] = {}

    def __len__(self) -> int:
        return len(self._calls)

    def begin(self, call: int, client: int, server: int) -> None:
        """Note a call that has been sent."""
        self._calls[call] = MeshCall(client, server)
        self._of_servers.setdefault(server, set()).add(call)

    def server(self, call: int) -> int | None:
        """Return the id of the server of a call; None if the call has ended."""
        known = self._calls.get(call)
        return None if known is None else known.server

    def end(self, call: int) -> MeshCall | None:
        """Forget a call that is answered or cancelled, and return it; None if it has ended before."""
        ended = self._calls.pop(call, None)
        if ended is not None:
            calls = self._of_servers[ended.server]
            calls.discard(call)
            if not calls:
                del self._of_servers[ended.server]
        return ended

    def server_left(self, server: int) -> None:
        """Forget the calls to a server that has gone: the router has answered them."""
        for call in self._of_servers.pop(server, ()):
            del self._calls[call]
