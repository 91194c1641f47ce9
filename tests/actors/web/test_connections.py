"""Connections that are silent, half open, not read, or too many."""

from __future__ import annotations

import asyncio
import socket
import ssl
from contextlib import AsyncExitStack, asynccontextmanager
from typing import TYPE_CHECKING

import aiohttp
import pytest

from actors.interfaces.sensor_msgs.msg import CompressedImage, JointState
from actors.qos.profile import DurabilityPolicy, QoSProfile
from actors.web import limits
from actors.web.accepting import Acceptor
from actors.web.live.echo_panel import SHOWN_LENGTH
from actors.web.options import WebOptions
from actors.web.routes import echo
from proto.aio.tls import server_context
from tests.actors.meeting import DEADLINE_SEC, until
from tests.actors.web.site import Site
from tests.certificates import Authority

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Sequence
    from pathlib import Path

    from tests.actors.meeting import Meeting

ELSEWHERE = "127.0.0.2"
"""An address of this machine from which the attacks do not come."""

TOPICS = b"GET /api/topics HTTP/1.1\r\nHost: localhost\r\n\r\n"


@asynccontextmanager
async def connection(
    site: Site, address: str = "127.0.0.1", tls: ssl.SSLContext | None = None
) -> AsyncGenerator[tuple[asyncio.StreamReader, asyncio.StreamWriter]]:
    """Connect from an address; the kernel keeps little of what is not read."""
    sock = socket.socket()
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    sock.setblocking(False)
    sock.bind((address, 0))
    await asyncio.get_running_loop().sock_connect(sock, ("127.0.0.1", site.server.port))
    host = None if tls is None else "127.0.0.1"
    reader, writer = await asyncio.open_connection(sock=sock, limit=1024, ssl=tls, server_hostname=host)
    try:
        yield reader, writer
    finally:
        writer.close()


def send_little(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the kernel keep little of what servers send; how much it takes otherwise is chance."""
    start = Acceptor.start

    def start_with_little(self: Acceptor, sockets: Sequence[socket.socket]) -> None:
        for each in sockets:  # what they accept has the same
            each.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
        start(self, sockets)

    monkeypatch.setattr(Acceptor, "start", start_with_little)


async def ended(reader: asyncio.StreamReader) -> None:
    """Wait for the end of a connection."""
    async with asyncio.timeout(DEADLINE_SEC):
        try:
            while await reader.read(100_000):
                pass
        except ConnectionError:
            pass


async def status(site: Site, path: str, address: str) -> int:
    """Return the status of the answer to a request on a new connection from an address."""
    connector = aiohttp.TCPConnector(local_addr=(address, 0), force_close=True)
    async with (
        asyncio.timeout(DEADLINE_SEC),
        aiohttp.ClientSession(site.url, connector=connector) as client,
        client.get(path) as response,
    ):
        return response.status


async def metric(site: Site, name: str) -> float:
    """Return a number of `/metrics`."""
    async with site.client.get("/metrics") as response:
        (value,) = (
            line.split()[-1] for line in (await response.text()).splitlines() if line.startswith(name)
        )
        return float(value)


async def refusals(site: Site, reason: str) -> float:
    """Return how often a limit has been reached."""
    return await metric(site, f'callboard_web_refusals_total{{reason="{reason}"}}')


async def test_a_silent_connection_ends(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 72: it counts from the moment of accepting, and is counted when it is given up."""
    async with connection(site):
        assert await metric(site, "callboard_web_connections ") == 2
        monkeypatch.setattr(limits, "FIRST_BYTE_SEC", 0.2)
        async with connection(site) as (reader, _):
            await ended(reader)
    assert await refusals(site, "silent") == 1


async def test_silent_connections_make_room(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 72: for probes and pages, of the same address and of others."""
    monkeypatch.setattr(limits, "MAX_CONNECTIONS", 4)
    monkeypatch.setattr(limits, "MAX_HOLDER_CONNECTIONS", 3)
    async with AsyncExitStack() as stack:
        readers = [(await stack.enter_async_context(connection(site)))[0] for _ in range(10)]
        for reader in readers[:7]:
            await ended(reader)
        for address in ("127.0.0.1", ELSEWHERE, "127.0.0.3"):
            for path in ("/healthz", "/readyz", "/", "/api/topics"):
                assert await status(site, path, address) == 200
        assert await refusals(site, "made_room") >= 8


async def test_when_all_are_at_work_a_probe_is_answered(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 72: on the reserve. Other requests are told why not, and their connections end."""
    monkeypatch.setattr(limits, "MAX_CONNECTIONS", 2)
    async with site.client.ws_connect("/api/live"), site.client.ws_connect("/api/live"):
        for address in ("127.0.0.1", ELSEWHERE):
            assert await status(site, "/healthz", address) == 200
            assert await status(site, "/readyz", address) == 200
            assert await status(site, "/api/topics", address) == 503
        async with connection(site) as (reader, writer):
            writer.write(TOPICS)
            async with asyncio.timeout(DEADLINE_SEC):
                assert b"as many connections as it takes" in await reader.read()
    async with asyncio.timeout(DEADLINE_SEC):
        while await status(site, "/api/topics", ELSEWHERE) != 200:  # when the WebSockets have ended
            pass
    assert await refusals(site, "connections") >= 3


async def test_half_open_tls_counts_and_ends(
    meeting: Meeting, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 71: in whatever state the handshake is, there are as few as of others, for as long."""
    monkeypatch.setattr(limits, "MAX_HOLDER_CONNECTIONS", 4)
    authority = Authority(tmp_path)
    pair = authority.issue("127.0.0.1")
    trusted = ssl.create_default_context(cafile=authority.ca)
    hello = ssl.MemoryBIO()
    half = trusted.wrap_bio(ssl.MemoryBIO(), hello, server_hostname="127.0.0.1")
    with pytest.raises(ssl.SSLWantReadError):
        half.do_handshake()
    greeting = hello.read()
    async with AsyncExitStack() as stack:
        options = WebOptions(port=0, tls=server_context(pair.certificate, pair.key, None))
        site = await Site(stack, meeting, options).open()
        connector = aiohttp.TCPConnector(local_addr=(ELSEWHERE, 0), ssl=trusted)
        site.client = await stack.enter_async_context(aiohttp.ClientSession(site.url, connector=connector))
        readers: list[asyncio.StreamReader] = []
        for sent in (b"", greeting[:20], greeting) * 2:
            reader, writer = await stack.enter_async_context(connection(site))
            writer.write(sent)
            readers.append(reader)
        for reader in readers[:2]:
            await ended(reader)
        assert await metric(site, "callboard_web_connections ") == 5
        monkeypatch.setattr(limits, "FIRST_BYTE_SEC", 0.2)
        for sent in (b"", greeting[:20], greeting) * 2:
            reader, writer = await stack.enter_async_context(connection(site))
            writer.write(sent)
            readers.append(reader)
        for reader in readers:
            await ended(reader)
        assert await metric(site, "callboard_web_connections ") == 1
        silent = await refusals(site, "silent")  # more than four if the machine is slow
        assert (silent >= 4, silent + await refusals(site, "made_room")) == (True, 12)
        monkeypatch.setattr(limits, "FIRST_BYTE_SEC", DEADLINE_SEC)
        async with connection(site) as (reader, writer):
            writer.write(b"\x16" * 70)
            await ended(reader)
        assert await refusals(site, "tls") == 1


async def test_streams_have_a_limit_for_each_holder(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 76: who has too many keeps nobody else from reading."""
    monkeypatch.setattr(limits, "MAX_HOLDER_STREAMS", 2)
    elsewhere = aiohttp.TCPConnector(local_addr=(ELSEWHERE, 0))
    async with aiohttp.ClientSession(site.url, connector=elsewhere) as other:
        async with site.client.get("/api/log"), site.client.get("/api/topics/x/echo"):
            assert "At most 2 browsers and streams" in (await site.json("/api/log", 503))["error"]
            assert await refusals(site, "streams") == 1
            async with other.ws_connect("/api/live"), other.get("/api/log") as response:
                assert response.status == 200
        async with asyncio.timeout(DEADLINE_SEC):
            while await status(site, "/api/log", "127.0.0.1") != 200:  # when both have ended
                pass


async def test_a_stream_that_is_not_read_ends(
    site: Site, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 76: it counts no more then."""
    monkeypatch.setattr(limits, "UNREAD_SEC", 0.2)
    monkeypatch.setattr(echo, "UPDATE_PERIOD_SEC", 0)
    node = await meeting.node("talker")
    publisher = node.create_publisher(JointState, "joints", 20)
    long = JointState(name=["x" * SHOWN_LENGTH] * 100)
    async with connection(site) as (reader, writer):
        writer.write(b"GET /api/topics/joints/echo HTTP/1.1\r\nHost: localhost\r\n\r\n")
        await until(publisher.get_subscription_count)
        async with asyncio.timeout(DEADLINE_SEC):
            while publisher.get_subscription_count():  # more than the kernel keeps for a connection
                publisher.publish(long)
                await node.get_graph()
        await ended(reader)
    assert await refusals(site, "unread") == 1


async def test_a_page_that_is_not_read_ends(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 76: also an answer that is complete, on a connection with more requests."""
    monkeypatch.setattr(limits, "UNREAD_SEC", 0.2)
    async with connection(site) as (_, writer):
        async with asyncio.timeout(DEADLINE_SEC):
            while not await refusals(site, "unread"):
                writer.write(b"GET /vendor/cytoscape.esm.min.mjs HTTP/1.1\r\nHost: localhost\r\n\r\n" * 10)
                await asyncio.sleep(0)


@pytest.mark.parametrize("encrypted", [False, True])
async def test_what_is_not_read_has_a_limit_for_each_holder(
    meeting: Meeting, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, encrypted: bool
) -> None:
    """Case 76: large answers that wait for their readers: the largest ends, and nobody else's."""
    send_little(monkeypatch)
    monkeypatch.setattr(limits, "MAX_HOLDER_UNREAD_BYTES", 500_000)
    authority = Authority(tmp_path)
    pair = authority.issue("127.0.0.1")
    tls = server_context(pair.certificate, pair.key, None) if encrypted else None
    client_tls = ssl.create_default_context(cafile=authority.ca) if encrypted else None
    request = b"GET /vendor/cytoscape.esm.min.mjs HTTP/1.1\r\nHost: localhost\r\n\r\n" * 10
    async with AsyncExitStack() as stack:
        site = await Site(stack, meeting, WebOptions(port=0, tls=tls)).open()
        connector = aiohttp.TCPConnector(local_addr=(ELSEWHERE, 0), ssl=client_tls or True)
        site.client = await stack.enter_async_context(aiohttp.ClientSession(site.url, connector=connector))
        async with asyncio.timeout(DEADLINE_SEC):
            while not await refusals(site, "unread_bytes"):
                reader, writer = await stack.enter_async_context(connection(site, tls=client_tls))
                writer.write(request)
                await reader.readline()  # it is answered, before further ones take its place
        assert await refusals(site, "unread") == 0


async def test_a_large_answer_waits_once_for_all_readers(
    site: Site, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Case 76: it is sent in pieces, so that images on slow links take no memory, and arrive."""
    monkeypatch.setattr(limits, "MAX_HOLDER_UNREAD_BYTES", 500_000)
    size = b"\xff\xd8\xff\xc0\x00\x0b\x08\x00\x10\x00\x10\x01\x01\x11\x00"
    file = size + bytes(20_000_000)
    node = await meeting.node("camera")
    publisher = node.create_publisher(
        CompressedImage, "/camera", QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    )
    publisher.publish(CompressedImage(format="jpeg", data=file))
    await site.json_found("/api/topics/camera")
    async with AsyncExitStack() as stack:
        clients = [await stack.enter_async_context(connection(site)) for _ in range(3)]
        for reader, writer in clients:
            writer.write(b"GET /api/topics/camera/image HTTP/1.1\r\nHost: localhost\r\n\r\n")
            async with asyncio.timeout(DEADLINE_SEC):
                assert b" 200 " in await reader.readline()
        async with asyncio.timeout(DEADLINE_SEC):
            reader, _ = clients[0]
            await reader.readuntil(b"\r\n\r\n")
            assert await reader.readexactly(len(file)) == file
    assert await refusals(site, "unread_bytes") == 0


async def test_bodies_have_a_limit_for_each_holder(meeting: Meeting, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 73: also those of users: who sends large ones slowly keeps nobody else from sending."""
    monkeypatch.setattr(limits, "MAX_HOLDER_HELD_BYTES", 150)
    async with AsyncExitStack() as stack:
        site = await Site(stack, meeting, WebOptions(port=0, allow_control=True, token="secret")).open()
        head = b"POST /api/services/x HTTP/1.1\r\nHost: localhost\r\nAuthorization: Bearer secret\r\n"
        async with connection(site) as (_, writer):
            writer.write(head + b"Content-Length: 100\r\n\r\n")
            async with asyncio.timeout(DEADLINE_SEC):
                answer = b""
                while b" 503 " not in answer:  # as soon as the first one is there
                    async with connection(site) as (reader, second):
                        second.write(head + b"Content-Length: 100\r\n\r\n" + b"x" * 100)
                        answer = await reader.readline()
            async with connection(site, ELSEWHERE) as (reader, other):
                other.write(head + b"Content-Length: 100\r\n\r\n" + b"x" * 100)
                assert b" 400 " in await reader.readline()
        assert await refusals(site, "bodies") == 1
