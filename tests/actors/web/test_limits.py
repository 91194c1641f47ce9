"""Clients that are slow, or send too much."""

from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

from actors.web import limits, log_reader, topic_feed
from tests.actors.meeting import DEADLINE_SEC
from tests.actors.web.site import Site

if TYPE_CHECKING:
    from types import ModuleType

    from tests.actors.meeting import Meeting


@pytest.mark.parametrize(
    "header", [b"X: " + b"x" * 20_000, b"\r\n".join(b"X%d: 1" % number for number in range(1000))]
)
async def test_huge_headers_are_refused(site: Site, header: bytes) -> None:
    """A long one, and many."""
    line = await site.first_line(b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n" + header + b"\r\n\r\n")
    assert line.split()[1] == b"400"


async def test_headers_that_do_not_arrive_are_given_up(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those of a first request, and of one that is behind another: the connection is closed."""
    monkeypatch.setattr(limits, "KEEPALIVE_SEC", 1.0)
    async with AsyncExitStack() as stack:
        site = await Site(stack, meeting).open()
        for before in (b"", b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"):
            async with asyncio.timeout(DEADLINE_SEC):
                reader, writer = await asyncio.open_connection("127.0.0.1", site.server.port)
                writer.write(before + b"GET /healthz HTTP/1.1\r\nHost: localhost\r\nX-Slow: ")
                answers = await reader.read()
                writer.close()
            assert answers.count(b"200 OK") == bool(before)


@pytest.mark.parametrize(
    ("path", "module", "limit"),
    [("/api/topics/any/echo", topic_feed, "MAX_TOPICS"), ("/api/log", log_reader, "MAX_READERS")],
)
async def test_a_reader_too_many_may_come_back(
    site: Site, monkeypatch: pytest.MonkeyPatch, path: str, module: ModuleType, limit: str
) -> None:
    """The status says that the request is right, and the server has no place for it now."""
    monkeypatch.setattr(module, limit, 0)
    assert "already" in (await site.json(path, 503))["error"]
