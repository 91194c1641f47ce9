"""Streams of events that are silent, or fail."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from aiohttp import web
from aiohttp.test_utils import TestServer

from actors.web.routes import event_stream
from actors.web.routes.event_stream import EventStream
from actors.web.routes.responses import NotFoundError, respond
from tests.actors.meeting import DEADLINE_SEC

if TYPE_CHECKING:
    import pytest

    from tests.actors.web.site import Site


async def test_a_silent_stream_has_comments(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    """So that proxies keep it, and a reader that has gone is noticed."""
    monkeypatch.setattr(event_stream, "COMMENT_SEC", 0.01)
    async with asyncio.timeout(DEADLINE_SEC), site.client.get("/api/topics/silence/echo") as response:
        assert await response.content.readuntil(b"\n\n") == b":\n\n"


async def test_an_error_after_the_beginning_is_an_event(site: Site) -> None:
    """The status has been sent already."""

    async def failing(request: web.Request) -> web.StreamResponse:
        await EventStream.begin(request)
        raise NotFoundError("it has gone")

    async def handler(request: web.Request) -> web.StreamResponse:
        return await respond(failing, request)

    app = web.Application()
    app.router.add_get("/", handler)
    async with TestServer(app) as server, site.client.get(server.make_url("/")) as response:
        assert (response.status, await response.text()) == (
            200,
            'event: error\ndata: {"error":"it has gone"}\n\n',
        )
