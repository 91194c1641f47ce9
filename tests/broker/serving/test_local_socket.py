"""The unix socket beside a broker's port: who uses it, and what its connections are allowed."""

from __future__ import annotations

import asyncio
import socket
import sys
from contextlib import AsyncExitStack, closing, nullcontext
from typing import TYPE_CHECKING, Any, cast

import pytest

from actors import Node, NotAuthorized, PublisherRefused
from actors.interfaces.std_msgs.msg import String
from broker import Broker, BrokerOptions
from broker.access.credentials import hash_token
from proto.aio.local_socket import connect_beside, listen_beside, local_name
from proto.errors import ErrorCode
from proto.wire import frames
from proto.wire.url import parse_url
from tests.broker.rawclient import DEADLINE_SEC, RawClient, hello
from tests.certificates import Authority
from tests.ports import held_port
from tests.seams.nodes import link_of
from tests.system import change_user

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="only Linux has abstract names"),
    pytest.mark.usefixtures("patience"),
]


def family(node: Node) -> Any:
    """Return what connects a node with its broker."""
    channel = link_of(node).channel
    assert channel is not None
    return channel.extra_info("socket").family


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost"])
async def test_a_node_on_the_brokers_machine_uses_it(host: str) -> None:
    """The URL stays that of the port."""
    async with Broker(BrokerOptions(host=host, port=0)) as broker:
        port = parse_url(broker.url).port
        async with Node("talker", url=f"callboard://{host}:{port}") as node:
            assert family(node) == socket.AF_UNIX
            assert link_of(node).url == f"callboard://{host}:{port}"


async def test_a_node_goes_on_by_tcp_and_comes_back() -> None:
    """A broker that starts again without the socket, and then with it, keeps its nodes."""
    async with AsyncExitStack() as stack, asyncio.timeout(DEADLINE_SEC):
        node, port = None, stack.enter_context(held_port())
        for wanted in (socket.AF_UNIX, socket.AF_INET, socket.AF_UNIX):
            found = None
            while found != wanted:  # one that comes in the moment between port and socket goes on by TCP
                options = BrokerOptions(port=port, local_socket=wanted == socket.AF_UNIX)
                async with Broker(options) as broker:
                    if node is None:
                        node = await stack.enter_async_context(Node("talker", url=broker.url))
                    while not node.connected:
                        await link_of(node).changed()
                    found = family(node)
                while node.connected:
                    await link_of(node).changed()


@pytest.mark.parametrize("offered", [True, False])
async def test_it_can_be_turned_off(*, offered: bool) -> None:
    """`callboard broker --no-local-socket`."""
    async with Broker(BrokerOptions(port=0, local_socket=offered)) as broker:
        sock = connect_beside("127.0.0.1", parse_url(broker.url).port)
        assert (sock is not None) is offered
        if sock is not None:
            sock.close()


async def test_a_broker_with_tls_has_none(tmp_path: Path) -> None:
    """It would be a way in without a certificate."""
    async with Broker(Authority(tmp_path).options()) as broker:
        assert connect_beside("127.0.0.1", parse_url(broker.url).port) is None


async def test_it_ends_with_the_broker() -> None:
    """No name is left."""
    async with Broker(BrokerOptions(port=0)) as broker:
        port = parse_url(broker.url).port
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as sock, pytest.raises(ConnectionRefusedError):
        sock.connect(local_name("127.0.0.1", port))


async def test_a_name_that_another_process_has_leaves_tcp(caplog: pytest.LogCaptureFixture) -> None:
    """The broker starts all the same, and says why nodes use TCP."""
    with (
        held_port() as port,
        closing(cast("socket.socket", listen_beside("127.0.0.1", port, 8))) as rival,
    ):
        async with Broker(BrokerOptions(port=port)):
            assert f"No unix socket beside port {port}: Address already in use" in caplog.text
        rival.close()


RULES = """
[local]
user = "robot"
[users.robot]
roles = ["near", "far"]
[roles.near]
from = ["127.0.0.0/8"]
allow.publish = ["/near"]
allow.node = ["/**"]
[roles.far]
from = ["192.0.2.0/24"]
allow.publish = ["/far"]
"""


async def test_access_rules_take_it_for_the_loopback_device(tmp_path: Path) -> None:
    """Roles for networks apply as if the node had used the port."""
    file = tmp_path / "access.toml"
    file.write_text(RULES)
    async with (
        Broker(BrokerOptions(port=0, auth=file)) as broker,
        Node("talker", url=broker.url) as node,
    ):
        assert family(node) == socket.AF_UNIX
        near, far = node.create_publisher(String, "/near", 1), node.create_publisher(String, "/far", 1)
        await near.flush()
        with pytest.raises(PublisherRefused, match="/far"):
            await far.flush()


GATEWAY = f"""
[users.gateway]
tokens = ["{hash_token("t")}"]
roles = ["near", "far", "any"]
[roles.any]
allow.node = ["/**"]
"""


async def test_a_node_that_works_for_a_client_has_the_rights_of_both(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Case 83: a client elsewhere takes away what is for this machine; the broker's log names the client."""
    file = tmp_path / "access.toml"
    file.write_text(RULES + GATEWAY)
    async with Broker(BrokerOptions(port=0, auth=file)) as broker:
        with pytest.raises(NotAuthorized):
            async with Node("talker", url=broker.url, client_address="192.0.2.1", connect_timeout_sec=9):
                pass
        assert " for 192.0.2.1: this broker requires" in caplog.text
        for client, may in (("127.0.0.9", True), ("192.0.2.1", False)):
            async with Node("talker", url=broker.url, token="t", client_address=client) as node:
                near, far = (
                    node.create_publisher(String, "/near", 1),
                    node.create_publisher(String, "/far", 1),
                )
                with nullcontext() if may else pytest.raises(PublisherRefused, match="/near"):
                    await near.flush()
                with pytest.raises(PublisherRefused, match="/far"):
                    await far.flush()


async def test_another_user_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nodes use the socket of their own user's broker only: a connection of another user is no node's."""
    async with Broker(BrokerOptions(port=0)) as broker:
        change_user(monkeypatch)
        async with RawClient().connected(broker, beside=True) as client:
            client.send(hello())
            assert (await client.next(frames.Error)).code == ErrorCode.UNAUTHORIZED
