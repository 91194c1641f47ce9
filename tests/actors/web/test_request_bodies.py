"""Bodies of requests: who may send which, and what is never read."""

from __future__ import annotations

import asyncio
import zlib
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

from actors.web import limits
from actors.web.options import WebOptions
from tests.actors.meeting import DEADLINE_SEC
from tests.actors.web.site import Site

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from tests.actors.meeting import Meeting

TOKEN = "the-token-of-the-server"
HOST = b" HTTP/1.1\r\nHost: localhost\r\n"
LARGE = b"Content-Length: %d\r\n" % limits.MAX_BODY_BYTES


@pytest.fixture
async def site(meeting: Meeting) -> AsyncIterator[Site]:
    """A web server where everything needs a token."""
    async with AsyncExitStack() as stack:
        options = WebOptions(host="0.0.0.0", port=0, allow_control=True, token=TOKEN)
        yield await Site(stack, meeting, options).open()


async def exchange(site: Site, head: bytes, body: bytes = b"") -> bytes:
    """Return all that the server sends until it closes the connection, which stays open at this end."""
    async with asyncio.timeout(DEADLINE_SEC):
        reader, writer = await asyncio.open_connection("127.0.0.1", site.server.port)
        try:
            writer.write(head + b"\r\n" + body)
            answer = b""
            try:
                while found := await reader.read(1000):
                    answer += found
            except ConnectionError:  # the server did not read everything that was sent
                pass
            return answer
        finally:
            writer.close()


@pytest.mark.parametrize(
    ("first", "status"),
    [
        (b"GET /", b"413"),
        (b"GET /healthz", b"413"),
        (b"GET /api/topics", b"401"),
        (b"GET /metrics", b"401"),
        (b"POST /api/services/add", b"401"),
        (b"PATCH /api/nodes/arm/parameters", b"401"),
        (b"DELETE /api/session", b"413"),
        (b"POST /api/nothing", b"401"),
        (b"POST /nothing", b"413"),
        (b"POST /api/session", b"413"),
    ],
)
@pytest.mark.parametrize("sent", [b"", b" " * 100_000])
async def test_a_stranger_is_answered_by_the_headers(
    site: Site, monkeypatch: pytest.MonkeyPatch, first: bytes, status: bytes, sent: bytes
) -> None:
    """Case 73: nobody waits for a body that a stranger announces; the connection ends instead."""
    monkeypatch.setattr(limits, "LINGER_SEC", 0.05)
    answer = await exchange(site, first + HOST + LARGE, sent)
    assert answer.split()[1] == status
    assert b"connection: close" in answer.lower()


@pytest.mark.parametrize("authorization", [b"", b"Authorization: Bearer %s\r\n" % TOKEN.encode()])
@pytest.mark.parametrize("first", [b"POST /api/session", b"POST /api/services/add"])
@pytest.mark.parametrize("encoding", [b"gzip", b"deflate", b"br", b"zstd", b"GZIP", b"gzip, identity"])
async def test_a_compressed_body_is_refused(
    site: Site, monkeypatch: pytest.MonkeyPatch, authorization: bytes, first: bytes, encoding: bytes
) -> None:
    """Case 70: by its headers, whoever sends it."""
    monkeypatch.setattr(limits, "LINGER_SEC", 0.05)
    head = first + HOST + authorization + b"Content-Encoding: " + encoding + b"\r\nContent-Length: 100\r\n"
    answer = await exchange(site, head)
    refused = b"401" if not authorization and b"services" in first else b"415"
    assert answer.split()[1] == refused


async def test_a_compressed_body_is_not_decompressed(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 70: not either if it has arrived with the headers."""
    monkeypatch.setattr(zlib, "decompressobj", None)
    body = zlib.compress(b'{"token": "x"}')
    head = b"POST /api/session" + HOST + b"Content-Encoding: deflate\r\nConnection: close\r\n"
    answer = await exchange(site, head + b"Content-Length: %d\r\n" % len(body), body)
    assert answer.split()[1] == b"415"


@pytest.mark.parametrize("chunked", [False, True])
@pytest.mark.parametrize(
    ("first", "most"),
    [
        (b"POST /api/session", limits.MAX_SIGN_IN_BYTES),
        (b"POST /api/services/add", limits.MAX_BODY_BYTES),
    ],
)
async def test_a_huge_body_is_refused(
    site: Site, monkeypatch: pytest.MonkeyPatch, first: bytes, most: int, *, chunked: bool
) -> None:
    """Case 73: whether its length is announced or not."""
    monkeypatch.setattr(limits, "LINGER_SEC", 0.05)
    head = first + HOST + b"Authorization: Bearer %s\r\n" % TOKEN.encode()
    if chunked:
        head += b"Transfer-Encoding: chunked\r\n"
        answer = await exchange(site, head, b"%x\r\n%s\r\n" % (most + 1, b" " * (most + 1)))
    else:
        answer = await exchange(site, head + b"Content-Length: %d\r\n" % (most + 1))
    assert answer.split()[1] == b"413"
    assert f"more than {most} bytes".encode() in answer


async def test_a_body_that_does_not_arrive_is_given_up(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    """Case 73: it announces more than it sends, and others are served meanwhile."""
    monkeypatch.setattr(limits, "LINGER_SEC", 0.05)
    monkeypatch.setattr(limits, "SIGN_IN_SEC", 0.05)
    answer = await exchange(site, b"POST /api/session" + HOST + b"Content-Length: 100\r\n", b"{")
    assert answer.split()[1] == b"408"
    assert b"within 0.05 s" in answer
    assert await site.json("/healthz") == {"status": "ok"}


@pytest.mark.parametrize("wanted", [True, False])
async def test_a_client_that_waits_for_a_go_ahead_gets_one_if_its_body_is_wanted(
    site: Site, monkeypatch: pytest.MonkeyPatch, *, wanted: bool
) -> None:
    """Otherwise it never sends the body, as it gets the refusal first."""
    monkeypatch.setattr(limits, "LINGER_SEC", 0.05)
    monkeypatch.setattr(limits, "SIGN_IN_SEC", 0.05)
    size = 100 if wanted else limits.MAX_SIGN_IN_BYTES + 1
    head = b"POST /api/session" + HOST + b"Expect: 100-continue\r\nContent-Length: %d\r\n" % size
    assert (await exchange(site, head)).split()[1] == (b"100" if wanted else b"413")


async def test_a_refused_request_without_a_body_keeps_its_connection(site: Site) -> None:
    """The next one on it is answered."""
    async with asyncio.timeout(DEADLINE_SEC):
        reader, writer = await asyncio.open_connection("127.0.0.1", site.server.port)
        for _ in range(2):
            writer.write(b"GET /api/topics" + HOST + b"\r\n")
            assert (await reader.readuntil(b"}")).split()[1] == b"401"
        writer.close()
