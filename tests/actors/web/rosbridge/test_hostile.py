"""Clients of rosbridge that harm themselves only."""

from __future__ import annotations

import asyncio
import socket
from contextlib import AsyncExitStack, suppress
from typing import TYPE_CHECKING

import aiohttp
import pytest
from aiohttp import WSCloseCode, WSMsgType

from actors.interfaces.std_msgs.msg import String, UInt8MultiArray
from actors.interfaces.std_srvs.srv import Trigger
from actors.web import limits
from actors.web.options import WebOptions
from actors.web.rosbridge import outbox
from actors.web.rosbridge.session import MAX_FRAME_BYTES
from tests.actors.meeting import DEADLINE_SEC, MIB, until
from tests.actors.web.rosbridge.bridge import Bridge

if TYPE_CHECKING:
    from tests.actors.meeting import Meeting

MALFORMED = (
    "", "{", "[]", "null", "3", '"publish"', '{"op": null}', '{"op": "publish"}', "[" * 10_000, "\0",
    '{"op":' * 5000,
    '{"op": "publish", "topic": "/a", "msg": 3}',
    '{"op": "publish", "topic": "a", "msg": {"a": NaN}}',
    '{"op": "subscribe", "topic": {}}',
    '{"op": "\ud800"}',
    '{"op": "call_service", "service": "/a", "args": "x"}',
    '{"op": "fragment", "num": 5, "total": 1, "data": ""}',
    '{"op": "set_level", "level": 3}',
    '{"op": "auth", "mac": 3}',
)  # fmt: skip


@pytest.mark.parametrize("binary", [False, True])
async def test_malformed_frames(bridge: Bridge, binary: bool) -> None:
    """Each gets an error, or nothing; the connection goes on."""
    client = await bridge.connect()
    for text in MALFORMED:
        data = text.encode(errors="surrogatepass")
        if binary:
            await client.socket.send_bytes(data)
        elif "\ud800" not in text:
            await client.socket.send_str(text)
    await client.settled()


async def test_a_text_frame_that_is_not_utf_8_ends_its_connection(bridge: Bridge) -> None:
    """As the protocol of WebSockets says; others go on."""
    guilty, other = await bridge.connect(), await bridge.connect()
    await guilty.socket.send_frame(b"\xff\xfe", WSMsgType.TEXT)
    async with asyncio.timeout(DEADLINE_SEC):
        assert (await guilty.socket.receive()).type is WSMsgType.CLOSE
    assert guilty.socket.close_code == WSCloseCode.INVALID_TEXT
    await other.settled()


@pytest.mark.parametrize("read_only", [False, True])
async def test_a_frame_that_is_too_large_ends_its_connection(meeting: Meeting, *, read_only: bool) -> None:
    """With the code for it, before its bytes have arrived; the largest is read."""
    most = limits.MAX_READ_ONLY_MESSAGE_BYTES if read_only else MAX_FRAME_BYTES
    async with AsyncExitStack() as stack:
        options = WebOptions(port=0, page=False, tools=("rosbridge",), allow_control=not read_only)
        bridge = await Bridge(stack, meeting, options).open()
        client = await bridge.connect()
        await client.socket.send_bytes(b" " * most)
        assert (await client.next())["op"] == "status"
        reader, writer = await asyncio.open_connection("127.0.0.1", bridge.server.port)
        headers = (
            "Host: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        )
        writer.write(f"GET / HTTP/1.1\r\n{headers}Sec-WebSocket-Key: {'A' * 22}==\r\n\r\n".encode())
        async with asyncio.timeout(DEADLINE_SEC):
            await reader.readuntil(b"\r\n\r\n")
            writer.write(b"\x82\xff" + (most + 1).to_bytes(8, "big") + bytes(4))
            head = await reader.readexactly(4)
        assert (head[0], int.from_bytes(head[2:], "big")) == (0x88, WSCloseCode.MESSAGE_TOO_BIG)
        writer.close()
        await client.settled()


async def test_idle_clients_are_limited(bridge: Bridge, monkeypatch: pytest.MonkeyPatch) -> None:
    """One more is told so, until another one leaves."""
    monkeypatch.setattr(limits, "MAX_HOLDER_STREAMS", 20)
    clients = [await bridge.connect() for _ in range(20)]
    with pytest.raises(aiohttp.WSServerHandshakeError) as caught:
        await bridge.connect()
    assert caught.value.status == 503
    await clients[0].socket.close()
    async with asyncio.timeout(DEADLINE_SEC):
        while True:  # the server may notice a moment later than the client
            with suppress(aiohttp.WSServerHandshakeError):
                await (await bridge.connect()).settled()
                break


async def test_a_slow_reader_gets_the_newest(bridge: Bridge, meeting: Meeting) -> None:
    """And hears how much it has missed; a fast one gets everything, meanwhile."""
    node = await meeting.node("talker")
    publisher = node.create_publisher(UInt8MultiArray, "/large", 100)
    slow, fast = await bridge.connect(), await bridge.connect()
    await slow.send("set_level", level="warning")
    for client in (slow, fast):
        await client.send("subscribe", topic="/large", queue_length=2 if client is slow else 0)
        await client.settled()
    await until(lambda: publisher.get_subscription_count() == 1)
    sent = 60
    for number in range(sent):
        publisher.publish(UInt8MultiArray(data=number.to_bytes(1, "big") * (256 * 1024)))
        await fast.until(lambda found: found["op"] == "publish")
    got, missed = list[str](), 0
    while missed + len(got) < sent:
        found = await slow.next()
        if found["op"] == "publish":
            got.append(found["msg"]["data"][:4])
        else:
            missed += int(found["msg"].split()[0])
    assert missed > 0
    metrics = await (await bridge.client.get("/metrics")).text()
    assert f"callboard_web_dropped_messages_total {missed}.0" in metrics
    assert got[-1] == "Ozs7"  # base64 of three times 59


async def test_a_client_that_reads_no_replies_is_disconnected(
    bridge: Bridge, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """When too many wait for it; that is counted."""
    monkeypatch.setattr(outbox, "MAX_REPLY_BYTES", MIB)
    node = await meeting.node("server")

    def answer(_: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.message = "x" * MIB
        return response

    node.create_service(Trigger, "/large", answer)
    guilty, other = await bridge.connect(), await bridge.connect()
    await guilty.values("/large")
    for number in range(50):
        await guilty.send("call_service", id=number, service="/large")
    async with asyncio.timeout(DEADLINE_SEC):
        while 'reason="unread_bytes"} 1.0' not in await (await bridge.client.get("/metrics")).text():
            await asyncio.sleep(0.01)
    await other.settled()


async def test_a_flood_of_errors_is_not_queued(bridge: Bridge, monkeypatch: pytest.MonkeyPatch) -> None:
    """A client that does not read is not read, either: it fills the kernel's buffers; others are served."""
    monkeypatch.setattr(outbox, "PAUSE_REPLY_BYTES", 10_000)
    guilty, other = await bridge.connect(), await bridge.connect()
    guilty.socket.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65536)
    filler, sent = "x" * 900, 0

    async def flood() -> None:
        nonlocal sent
        for number in range(20_000):
            await guilty.send("unadvertise", id=f"{number} {filler}", topic="/a")
            sent += 1

    task = asyncio.get_running_loop().create_task(flood())
    before = -1
    while before < sent:  # until nothing is read of it while the other one gets 20 answers
        before = sent
        for _ in range(20):
            await other.settled()
    assert not task.done()
    task.cancel()
    await asyncio.wait([task])
    for number in range(sent):  # it is read again, and nothing was dropped
        assert (await guilty.next())["id"] == f"{number} {filler}"


async def test_a_flood_of_messages_leaves_others_their_turn(bridge: Bridge, meeting: Meeting) -> None:
    """And all of it arrives, as far as the publisher's queue allows."""
    node = await meeting.node("listener")
    count = 0

    def receive(_: String) -> None:
        nonlocal count
        count += 1

    node.create_subscription(String, "/flood", receive, 10_000)
    guilty, other = await bridge.connect(), await bridge.connect()
    await guilty.send("advertise", topic="/flood", type="std_msgs/String", queue_size=1000)
    for _ in range(1000):
        await guilty.send("publish", topic="/flood", msg={"data": "x"})
    await other.settled()
    await until(lambda: count == 1000)
