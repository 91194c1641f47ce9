"""The pytest plugin that comes with callboard: a broker, nodes and a fault proxy as fixtures.

    async def test_add(broker, make_node):
        async with AdderNode():
            ...

pytest loads this module in every run of everybody who has callboard installed, so it loads nothing of
callboard until a fixture is used, and it is silent when pytest-asyncio, which the fixtures need, is missing.
"""

from __future__ import annotations

from contextlib import AsyncExitStack
from typing import TYPE_CHECKING, Any, Protocol

import pytest

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from pytest_asyncio import fixture as async_fixture

    from actors.node.node import Node
    from actors.testing.fault_proxy import FaultProxy
    from broker import Broker, BrokerOptions
else:
    try:
        from pytest_asyncio import fixture as async_fixture
    except ImportError:
        async_fixture = pytest.fixture  # what it decorates never comes to run: see _pytest_asyncio

CONNECT_TIMEOUT_SEC = 20.0
"""The broker is there: only a very busy machine needs a part of this."""

STOP_TIMEOUT_SEC = 1.0
"""A node of a test that is over need not wait long for a broker that a fault keeps away."""


class NodeFactory(Protocol):
    """What the fixture `make_node` is."""

    async def __call__(self, name: str, **options: Any) -> Node:
        """Start a node and wait until it is in the graph.

        Args:
            name: Its name.
            options: As for `actors.Node`. Unless they say something else, it goes to the test's broker and
                takes nothing from the command line.

        Raises:
            BrokerUnreachable: There was no connection in time. With `connect_timeout_sec=None` it does not
                wait for one.
            NodeNameTaken: The broker has a node of this name.
        """
        ...


@pytest.fixture
def _pytest_asyncio(pytestconfig: pytest.Config) -> None:
    """Say what is missing before pytest finds an asynchronous fixture that nobody runs."""
    if not pytestconfig.pluginmanager.hasplugin("asyncio"):
        pytest.fail(
            "callboard's fixtures need pytest-asyncio: pip install 'callboard[testing]'", pytrace=False
        )


@pytest.fixture
def broker_options() -> BrokerOptions:
    """The options of the fixture `broker`. Override it for others; `port=0` takes a free port."""
    from broker import BrokerOptions  # noqa: PLC0415

    return BrokerOptions(port=0)


@async_fixture
async def broker(
    _pytest_asyncio: None, broker_options: BrokerOptions, monkeypatch: pytest.MonkeyPatch
) -> AsyncIterator[Broker]:
    """A running broker of the test's own.

    CALLBOARD_URL says where it is while the test runs, so that nodes and processes which are told nothing
    find it. The other CALLBOARD variables of the environment are away.
    """
    from actors.config import environment  # noqa: PLC0415
    from broker import Broker  # noqa: PLC0415

    async with Broker(broker_options) as running:
        for variable in environment.VARIABLES:
            monkeypatch.delenv(variable, raising=False)
        monkeypatch.setenv("CALLBOARD_URL", running.url)
        yield running


@async_fixture
async def make_node(broker: Broker) -> AsyncIterator[NodeFactory]:
    """Start nodes, as many as wanted, in the test; they stop when it ends. See `NodeFactory`."""
    from actors.node.node import Node  # noqa: PLC0415

    defaults: dict[str, Any] = {
        "url": broker.url,
        "domain": 0,
        "use_global_arguments": False,
        "connect_timeout_sec": CONNECT_TIMEOUT_SEC,
        "stop_timeout_sec": STOP_TIMEOUT_SEC,
    }
    async with AsyncExitStack() as stack:

        async def make(name: str, **options: Any) -> Node:
            async with AsyncExitStack() as starting:
                node = await starting.enter_async_context(Node(name, **{**defaults, **options}))
                if node.connected:
                    await node.get_graph()  # the answer contains the node: everybody can see it now
                stack.push_async_exit(starting.pop_all())
            return node

        yield make


@async_fixture
async def node(make_node: NodeFactory) -> Node:
    """A running node, connected to the broker. Its name is "test_node"."""
    return await make_node("test_node")


@async_fixture
async def fault_proxy(broker: Broker) -> AsyncIterator[FaultProxy]:
    """A proxy before the broker. Only who is told its `url` goes through it."""
    from actors.testing.fault_proxy import FaultProxy  # noqa: PLC0415

    async with FaultProxy(broker.url) as running:
        yield running
