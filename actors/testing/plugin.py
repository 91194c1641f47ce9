"""The pytest plugin that comes with callboard: a broker, nodes and a fault proxy as fixtures.

    async def test_add(broker, make_node):
        async with AdderNode():
            ...

pytest loads this module in every run wherever callboard is installed, so it imports nothing of callboard
until a fixture is used, and a missing pytest-asyncio is an error only in tests that use a fixture.
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
        async_fixture = pytest.fixture  # these fixtures never run: see _pytest_asyncio

CONNECT_TIMEOUT_SEC = 20.0
"""The broker runs already: only a very busy machine needs more than a moment."""

STOP_TIMEOUT_SEC = 1.0
"""Short, because after a test a node need not wait for a broker that a fault makes unreachable."""


class NodeFactory(Protocol):
    """Type of the fixture `make_node`."""

    async def __call__(self, name: str, **options: Any) -> Node:
        """Start a node and wait until it is in the graph.

        Args:
            name: Its name.
            options: As for `actors.Node`; by default it connects to the test's broker and ignores the command
                line.

        Returns:
            The node, entered.

        Raises:
            BrokerUnreachable: It did not connect in time. With `connect_timeout_sec=None` it does not wait
                for a connection.
            NodeNameTaken: The broker has a node of this name.
        """
        ...


@pytest.fixture
def _pytest_asyncio(pytestconfig: pytest.Config) -> None:
    """Fail with the name of the missing package, before pytest reports an unhandled async fixture."""
    if not pytestconfig.pluginmanager.hasplugin("asyncio"):
        from proto.extras import install_command  # noqa: PLC0415

        text = f"callboard's fixtures need pytest-asyncio: {install_command('testing', 'pytest-asyncio')}"
        pytest.fail(text, pytrace=False)


@pytest.fixture
def broker_options() -> BrokerOptions:
    """The options of the fixture `broker`; override it to change them. `port=0` takes a free port."""
    from broker import BrokerOptions  # noqa: PLC0415

    return BrokerOptions(port=0)


@async_fixture
async def broker(
    _pytest_asyncio: None, broker_options: BrokerOptions, monkeypatch: pytest.MonkeyPatch
) -> AsyncIterator[Broker]:
    """A running broker for this test.

    CALLBOARD_URL is its URL while the test runs, so that nodes and processes find it by default. The other
    CALLBOARD variables of the environment are removed, and ROS_DOMAIN_ID.
    """
    from actors.config import environment  # noqa: PLC0415
    from broker import Broker  # noqa: PLC0415

    async with Broker(broker_options) as running:
        for variable in environment.CHOOSING_VARIABLES:
            monkeypatch.delenv(variable, raising=False)
        monkeypatch.setenv("CALLBOARD_URL", running.url)
        yield running


@async_fixture
async def make_node(broker: Broker) -> AsyncIterator[NodeFactory]:
    """A function that starts nodes, which stop when the test ends. See `NodeFactory`."""
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
                    await node.get_graph()  # the reply contains the node, so everybody can see it now
                stack.push_async_exit(starting.pop_all())
            return node

        yield make


@async_fixture
async def node(make_node: NodeFactory) -> Node:
    """A running node named "test_node", connected to the broker."""
    return await make_node("test_node")


@async_fixture
async def fault_proxy(broker: Broker) -> AsyncIterator[FaultProxy]:
    """A proxy in front of the broker, for nodes that use its `url`."""
    from actors.testing.fault_proxy import FaultProxy  # noqa: PLC0415

    async with FaultProxy(broker.url) as running:
        yield running
