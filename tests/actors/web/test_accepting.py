"""Connections that arrive faster than they are opened."""

from __future__ import annotations

import asyncio
import socket
from contextlib import ExitStack
from typing import TYPE_CHECKING

from actors.web.accepting import AddressQueues
from actors.web.listener import AddressBudget, WebListener
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


def test_the_oldest_of_an_address_makes_room() -> None:
    """Case 72: before it costs more than to be accepted; those of others stay."""
    queues = AddressQueues[int]()
    assert queues.add(QUIET, -1, 2) is None
    assert [queues.add(BUSY, number, 2) for number in range(4)] == [None, None, 0, 1]
    assert [queues.pop() for _ in range(len(queues))] == [-1, 2, 3]


class Handshake(asyncio.Transport):
    """A connection of an address that needs some shares, and records when it has each."""

    def __init__(self, budget: AddressBudget, address: str, shares: int, record: list[str]) -> None:
        super().__init__({"peername": (address, 1)})
        self._budget, self._address, self._shares, self._record = budget, address, shares, record
        budget.wait(self)

    def go_on_reading(self) -> None:
        """Called by the budget."""
        self._record.append(self._address)
        self._shares -= 1
        if self._shares:
            self._budget.wait(self)


async def test_handshakes_of_one_address_delay_no_other() -> None:
    """Case 72: of two hundred handshakes that an address has begun, one gets a share before another's."""
    record: list[str] = []
    budget = AddressBudget(asyncio.get_running_loop())
    for _ in range(200):
        Handshake(budget, "2001:db8::1", 1, record)
    for shares in (1, 2):
        Handshake(budget, "192.0.2.2", shares, record)
    await until(lambda: len(record) == 203)
    assert record[:4] == ["2001:db8::1", "192.0.2.2"] * 2
    assert not budget.contended


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
