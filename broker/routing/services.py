"""Services: which clients and servers match, decided when an endpoint is declared."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from broker.routing.matching import exceeds, may_match
from broker.routing.pool import Pool
from broker.routing.records import ClientRecord, ServiceGroup, ServiceRecord

if TYPE_CHECKING:
    from collections.abc import Iterable

    from broker.routing.notices import Notices


class PendingCalls(Protocol):
    """What services tell of endpoints that leave: `calls.Calls`, which picks servers here."""

    def client_left(self, client: ClientRecord) -> None:
        """End the calls of a client."""
        ...

    def server_left(self, server: ServiceRecord) -> None:
        """End the calls that wait for a server."""
        ...


class OneServer:
    """A pool for calls whose server is chosen already."""

    def __init__(self, server: ServiceRecord) -> None:
        self._server = server

    def least_busy(self) -> ServiceRecord:
        """Return the server."""
        return self._server


class Services:
    """All services of one graph.

    Args:
        notices: Reports about matching.
        calls: The graph's calls.
    """

    def __init__(self, notices: Notices, calls: PendingCalls) -> None:
        self._notices = notices
        self._calls = calls
        self._groups: dict[str, ServiceGroup] = {}

    def pool(self, client: ClientRecord) -> Pool[ServiceRecord] | None:
        """Return the servers for a client's calls: those of this broker, or else those of others."""
        group = self._groups.get(client.name)
        if group is None:
            return None
        of_type = client.type_name, client.type_hash
        own = group.pools.get((*of_type, False))
        if not group.apart:  # nearly always
            return own or (None if client.private else group.pools.get((*of_type, True)))
        others = None if client.private else group.pools.get((*of_type, True))
        for pool in (own, others):
            if pool is not None and (allowed := pool.without(client.apart)):
                return allowed
        return None

    def only(self, client: ClientRecord, server_key: int) -> OneServer | None:
        """Return one server for a client's calls; None if it is not there any more."""
        group = self._groups.get(client.name)
        server = None if group is None else group.servers.get(server_key)
        return OneServer(server) if server is not None and _fits(client, server) else None

    def exceeds(self, endpoint: ClientRecord | ServiceRecord, most: int) -> bool:
        """Return whether an endpoint, if it joined, would raise the `matches` of its peer above `most`."""
        group = self._groups.get(endpoint.name)
        if group is None:
            return False
        others: list[ClientRecord | ServiceRecord]
        others = [*(group.servers if isinstance(endpoint, ClientRecord) else group.clients).values()]
        return exceeds(endpoint.peer, others, lambda other: _fits(endpoint, other), most)

    def join(self, endpoint: ClientRecord | ServiceRecord) -> None:
        """Match a client or server that is new or back."""
        group = self._groups.get(endpoint.name)
        if group is None:
            group = self._groups[endpoint.name] = ServiceGroup()
        if isinstance(endpoint, ClientRecord):
            group.clients[endpoint.key] = endpoint
            if len(group.clients) == 1:
                for server in group.servers.values():
                    _join_pool(group, server)
            pairs = [(endpoint, server) for server in group.servers.values()]
        else:
            group.servers[endpoint.key] = endpoint
            group.apart += bool(endpoint.apart)
            if group.clients:
                _join_pool(group, endpoint)
            pairs = [(client, endpoint) for client in group.clients.values()]
        if not pairs:
            return
        self._notices.begin(endpoint)
        for client, server in pairs:
            if _fits(client, server):
                self._notices.set_count(client, client.peers + 1)
                self._notices.set_count(server, server.peers + 1)
            elif may_match(client, server):
                self._notices.report_types(client, "client", server, "server")
        self._notices.end()

    def leave(self, endpoint: ClientRecord | ServiceRecord) -> None:
        """Unmatch a client or server that is gone or suspended, and end its calls."""
        self._unmatch(endpoint)
        if isinstance(endpoint, ClientRecord):
            self._calls.client_left(endpoint)
        elif endpoint.pending:
            self._notices.flush()  # its clients learn that it is gone before their calls fail
            self._calls.server_left(endpoint)

    def retire(self, server: ServiceRecord) -> None:
        """Give a server no more requests; it may answer pending ones."""
        self._unmatch(server)
        server.retired = True

    def _unmatch(self, endpoint: ClientRecord | ServiceRecord) -> None:
        group = self._groups.get(endpoint.name)
        if group is None or (endpoint.key not in group.clients and endpoint.key not in group.servers):
            return
        counterparts: Iterable[ClientRecord | ServiceRecord]
        if isinstance(endpoint, ClientRecord):
            del group.clients[endpoint.key]
            if not group.clients:
                for server in group.servers.values():
                    _leave_pool(group, server)
            counterparts = group.servers.values()
        else:
            del group.servers[endpoint.key]
            group.apart -= bool(endpoint.apart)
            _leave_pool(group, endpoint)
            counterparts = group.clients.values()
        for other in counterparts:
            if _fits(endpoint, other):
                self._notices.set_count(other, other.peers - 1)
        self._notices.set_count(endpoint, 0)
        if not group.clients and not group.servers:
            del self._groups[endpoint.name]


def _join_pool(group: ServiceGroup, server: ServiceRecord) -> None:
    server.pool = group.pools.setdefault((server.type_name, server.type_hash, server.mirrored), Pool())
    server.pool.add(server)


def _leave_pool(group: ServiceGroup, server: ServiceRecord) -> None:
    pool, server.pool = server.pool, None
    if pool is not None:
        pool.remove(server)
        if not pool:
            del group.pools[server.type_name, server.type_hash, server.mirrored]


def _fits(one: ClientRecord | ServiceRecord, other: ClientRecord | ServiceRecord) -> bool:
    return _same_type(one, other) and may_match(one, other)


def _same_type(one: ClientRecord | ServiceRecord, other: ClientRecord | ServiceRecord) -> bool:
    return one.type_name == other.type_name and one.type_hash == other.type_hash
