"""The calls of this broker's nodes to servers of other brokers."""

from __future__ import annotations

from typing import NamedTuple


class MeshCall(NamedTuple):
    """A call without a reply: the number of its client, and the id of its server at the router."""

    client: int
    server: int


class MeshCalls:
    """The calls of one graph to other brokers, by the router's call ids."""

    def __init__(self) -> None:
        self._calls: dict[int, MeshCall] = {}

    def begin(self, call: int, client: int, server: int) -> None:
        """Note a call that has been sent."""
        self._calls[call] = MeshCall(client, server)

    def end(self, call: int) -> MeshCall | None:
        """Forget a call that is answered or cancelled, and return it; None if it has ended before."""
        return self._calls.pop(call, None)

    def server_left(self, server: int) -> None:
        """Forget the calls to a server that has gone: the router has answered them."""
        for call in [call for call, each in self._calls.items() if each.server == server]:
            del self._calls[call]
