"""Sharing requests: the server with the fewest pending calls is next, and ties rotate."""

from __future__ import annotations

import random

from broker.routing.pool import Pool
from broker.routing.records import Peer, ServiceRecord
from proto.wire.codes import EntryKind


def make_server(number: int) -> ServiceRecord:
    """Make a server that owes nothing."""
    return ServiceRecord(key=number, id=number, peer=Peer(1), kind=EntryKind.SERVICE, node=None, name="/add")


def owe(pool: Pool[ServiceRecord], server: ServiceRecord, count: int) -> None:
    """Let a server owe this many answers."""
    server.pending.clear()
    server.pending.update(dict.fromkeys(range(count)))  # type: ignore[arg-type]
    pool.update(server)


def test_an_empty_pool_has_no_server() -> None:
    """Also after the last server has left."""
    pool = Pool[ServiceRecord]()
    assert pool.least_busy() is None
    server = make_server(1)
    pool.add(server)
    assert pool.least_busy() is server
    pool.remove(server)
    assert pool.least_busy() is None


def test_ties_rotate() -> None:
    """Servers with equally many pending calls are chosen one after the other."""
    pool = Pool[ServiceRecord]()
    servers = [make_server(number) for number in range(3)]
    for server in servers:
        pool.add(server)
    chosen: list[ServiceRecord] = []
    for _ in range(6):
        next_one = pool.least_busy()
        assert next_one is not None
        chosen.append(next_one)
        owe(pool, next_one, 1)
        owe(pool, next_one, 0)
    assert chosen == servers * 2


def test_a_second_server_counts_the_pending_calls_of_the_first() -> None:
    """A lone server is not counted; the count is right when another joins."""
    pool = Pool[ServiceRecord]()
    first, second = make_server(1), make_server(2)
    pool.add(first)
    owe(pool, first, 5)
    pool.add(second)
    assert pool.least_busy() is second
    owe(pool, second, 6)
    assert pool.least_busy() is first


def test_the_least_busy_is_always_chosen() -> None:
    """After any joins, leaves and calls the choice has the fewest pending calls."""
    chance = random.Random(7)
    pool = Pool[ServiceRecord]()
    present: list[ServiceRecord] = []
    for number in range(3000):
        act = chance.random()
        if act < 0.1 or not present:
            present.append(make_server(number))
            pool.add(present[-1])
        elif act < 0.18:
            pool.remove(present.pop(chance.randrange(len(present))))
        else:
            server = chance.choice(present)
            owe(pool, server, max(0, len(server.pending) + chance.choice((-1, 1, 1))))
        found = pool.least_busy()
        assert len(pool) == len(present)
        if present:
            assert found is not None
            assert len(found.pending) == min(len(each.pending) for each in present)
