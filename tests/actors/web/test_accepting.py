"""Connections that arrive faster than they are opened."""

from __future__ import annotations

import socket
from contextlib import ExitStack
from typing import TYPE_CHECKING

from actors.web import limits
from actors.web.accepting import AddressQueues
from actors.web.listener import WebListener
from proto.wire.addresses import parse_address
from tests.actors.meeting import until

if TYPE_CHECKING:
    import pytest

    from actors.web.connection import WebConnection
    from tests.actors.web.site import Site

BUSY, QUIET = parse_address("192.0.2.1"), parse_address("192.0.2.2")


def test_each_address_has_its_turn() -> None:
    """Case 72: of a hundred connections of one address, those of another wait for one each."""
    queues = AddressQueues[int]()
    for number in range(100):
        assert queues.add(BUSY, number) is None
    for number in (100, 101):
        assert queues.add(QUIET, number) is None
    assert [queues.pop() for _ in range(5)] == [0, 100, 1, 101, 2]
    assert [queues.pop() for _ in range(len(queues))] == [*range(3, 100)]


def test_the_oldest_of_an_address_makes_room(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 72: before it costs more than to be accepted; those of others stay."""
    monkeypatch.setattr(limits, "MAX_HOLDER_CONNECTIONS", 2)
    queues = AddressQueues[int]()
    assert queues.add(QUIET, -1) is None
    assert [queues.add(BUSY, number) for number in range(4)] == [None, None, 0, 1]
    assert [queues.pop() for _ in range(len(queues))] == [-1, 2, 3]


async def test_a_burst_of_one_address_delays_no_other(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 71 and 72: a connection of another address is opened second, although forty came before."""
    opened: list[str] = []
    original = WebListener.opened

    def record(self: WebListener, connection: WebConnection) -> None:
        opened.append(str(connection.source))
        original(self, connection)

    monkeypatch.setattr(WebListener, "opened", record)
    with ExitStack() as stack:
        for address in ("127.0.0.1",) * 40 + ("127.0.0.2",):
            target = ("127.0.0.1", site.server.port)
            stack.enter_context(socket.create_connection(target, source_address=(address, 0)))
        await until(lambda: len(opened) == 41)
    assert opened.index("127.0.0.2") == 1
