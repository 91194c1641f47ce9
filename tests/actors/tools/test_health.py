"""Everything is looked at, whatever stands at the broker's place."""

from __future__ import annotations

import asyncio
import socket
import threading
from typing import TYPE_CHECKING

import pytest

from actors.interfaces.std_msgs.msg import Int32, String
from actors.node.node import Node
from actors.tools.check import Check
from actors.tools.health import all_good, examine
from broker import Broker, BrokerOptions
from proto.errors import ErrorCode
from proto.wire import frames
from proto.wire.codec import encode
from tests.certificates import Authority

if TYPE_CHECKING:
    from pathlib import Path

pytestmark = pytest.mark.usefixtures("patience")


async def look(
    url: str | None = None, domain: int | None = None, context: str | None = None
) -> dict[str, Check]:
    """Examine in a thread; return the last check of each name."""
    return {check.name: check for check in await asyncio.to_thread(examine, url, domain, context)}


async def test_with_a_broker_everything_is_checked() -> None:
    """What the broker knows is there; nothing is wrong with an empty one."""
    async with Broker(BrokerOptions(port=0)) as broker:
        checks = await look(broker.url)
        assert checks["broker"].finding.startswith(broker.url)
    assert {"python", "versions", "clock", "load", "links", "messages", "types", "qos"} <= set(checks)
    assert all_good(checks.values())


async def test_a_conflict_of_types_is_wrong() -> None:
    """Found through a real broker, in the domain that is asked about only."""
    async with (
        Broker(BrokerOptions(port=0)) as broker,
        Node("a", url=broker.url) as a,
        Node("b", url=broker.url) as b,
    ):
        a.create_publisher(String, "chatter", 1)
        b.create_publisher(Int32, "chatter", 1)
        await a.get_graph()
        await b.get_graph()
        checks = await look(broker.url)
        elsewhere = await look(broker.url, 7)
    assert checks["types"].status == "fail"
    assert not all_good(checks.values())
    assert elsewhere["types"].status == "ok"


async def test_no_broker_says_how_to_start_one() -> None:
    """And where that place comes from."""
    with socket.socket() as unheard:
        unheard.bind(("127.0.0.1", 0))
        port = unheard.getsockname()[1]
        checks = await look(f"callboard://127.0.0.1:{port}")
    assert checks["broker"] == Check(
        "broker",
        "fail",
        f"No broker at callboard://127.0.0.1:{port} (--url)",
        f"Start one with: callboard broker --port {port}",
    )


async def test_a_place_that_cannot_be_is_wrong() -> None:
    """A URL that cannot be read, a context that there is not: a finding, no exception."""
    assert (await look("http://x"))["broker"].status == "fail"
    assert (await look(None, context="nobody"))["broker"].finding == "No context 'nobody'"


async def test_an_unknown_authority_has_its_own_remedy(tmp_path: Path) -> None:
    """Not to start a broker where one is, nor to look for another program."""
    authority = Authority(tmp_path)
    async with Broker(authority.options(authority.issue("127.0.0.1"))) as broker:
        found = (await look(broker.url))["broker"]
    assert found.status == "fail"
    assert "from an authority unknown here" in found.finding
    assert found.remedy.startswith("export CALLBOARD_CA=/path/to/ca.pem")


@pytest.mark.parametrize(
    ("answer", "remedy"),
    [
        (b"HTTP/1.1 400 Bad Request\r\n\r\n", "see what listens there"),
        (encode(frames.Error(ErrorCode.VERSION, "this broker speaks 2")), "run the same version"),
    ],
)
async def test_something_else_at_the_brokers_place_is_wrong(answer: bytes, remedy: str) -> None:
    """Another program, or a broker of another time."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            with server.accept()[0] as peer:
                peer.recv(1)
                peer.sendall(answer)
                peer.recv(4096)  # until the other side hangs up

        thread = threading.Thread(target=serve)
        thread.start()
        checks = await look(f"callboard://127.0.0.1:{server.getsockname()[1]}")
        await asyncio.to_thread(thread.join)
    assert checks["broker"].status == "fail"
    assert checks["broker"].remedy.startswith(remedy)
