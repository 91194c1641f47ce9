"""A broker and nodes in the test's own loop: what the tests of the runtime meet in."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, Final

import actors
from actors.callbacks.budget import CallbackBudget
from broker import Broker, BrokerOptions
from tests import waiting
from tests.ports import held_port
from tests.seams.nodes import link_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AsyncExitStack

DEADLINE_SEC: Final = waiting.DEADLINE_SEC
until: Final = waiting.until

MIB: Final = 1024 * 1024

KEEP_ALL: Final = actors.QoSProfile(history=actors.HistoryPolicy.KEEP_ALL)

BARE: Final[dict[str, Any]] = {
    "start_parameter_services": False,
    "enable_rosout": False,
    "start_diagnostics_service": False,
    "parameter_overrides": {"start_type_description_service": False},
}
"""Options of a node without the endpoints that every node has, for tests that count what they declare."""


class Blow(actors.Service, type_name="meeting/srv/Blow"):
    """Requests and replies of any size."""

    class Request(actors.Message):
        size: int = 0
        data: bytes = b""

    class Response(actors.Message):
        data: bytes = b""


async def turns(count: int = 5) -> None:
    """Let the loop turn a few times: for what has to happen without the network."""
    for _ in range(count):
        await asyncio.sleep(0)


def stop_budget_clock() -> None:
    """Let callbacks of the running loop take no time.

    On a busy machine a callback may use up the budget, which puts others off to a later turn of the loop.
    """
    set_budget_clock(lambda: 0.0)


def set_budget_clock(clock: Callable[[], float]) -> None:
    """Measure by this clock what callbacks of the running loop take, those of nodes that are made later."""
    CallbackBudget.of(asyncio.get_running_loop()).clock = clock


def latched(depth: int) -> actors.QoSProfile:
    """Return a profile whose last messages reach late joiners."""
    return actors.QoSProfile(depth=depth, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)


class Meeting:
    """A broker, and running nodes that end with the test.

    Args:
        stack: Ends them.
        **options: The broker's.
    """

    def __init__(self, stack: AsyncExitStack, **options: Any) -> None:
        self._stack = stack
        # Held, so that no other worker has it while no broker listens.
        options = {"port": stack.enter_context(held_port()), **options}
        self.broker = Broker(BrokerOptions(**options))
        self.url = ""

    async def open(self) -> None:
        """Start the broker."""
        await self.broker.__aenter__()
        self.url = self.broker.url

    async def stop_broker(self) -> None:
        """End the broker."""
        await self.broker.stop()

    async def restart_broker(self, **options: Any) -> None:
        """Start another broker where the first one was; it remembers nothing."""
        await self.broker.stop()
        port = int(self.url.rsplit(":", 1)[1])
        self.broker = Broker(BrokerOptions(port=port, **options))
        await self.broker.__aenter__()

    async def node(self, name: str, **options: Any) -> actors.Node:
        """Start a node and wait until it is connected."""
        node = await self._stack.enter_async_context(self.absent(name, **options))
        await until(lambda: node.connected)
        return node

    def absent(self, name: str, **options: Any) -> actors.Node:
        """Make a node that the test starts itself, by default without standard endpoints."""
        return actors.Node(name, **{"url": self.url, "use_global_arguments": False, **BARE, **options})

    async def settled(self, *nodes: actors.Node) -> None:
        """Wait until the broker has handled everything that these nodes have sent, and they its answers.

        Twice round: what one node's frames cause at another has arrived when its second answer has.
        """
        for _ in range(2):
            for node in nodes:
                link_of(node).flush()
                await link_of(node).round_trip()


async def matched(entity: Any, count: int = 1) -> None:
    """Wait until a publisher, subscription or client has this many counterparts."""
    await until(lambda: entity.peers == count)
