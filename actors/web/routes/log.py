"""The log of all nodes as a stream of events."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

import msgspec

from actors.web.live.session import UPDATE_PERIOD_SEC
from actors.web.log_reader import LogFilter
from actors.web.routes.event_stream import EventStream
from actors.web.routes.route import EVENTS, READING, Route
from actors.web.routes.state import state_of, workspace_of

if TYPE_CHECKING:
    from aiohttp import web


async def log(request: web.Request) -> web.StreamResponse:
    """Send the lines that are kept and new ones until the reader leaves; of `level`, `node` and `text`."""
    workspace, news = workspace_of(request), asyncio.Event()
    chosen = msgspec.convert(dict(request.query), LogFilter)
    with state_of(request).live_connection(request):
        reader = workspace.panels.logs.read(chosen, news.set)
        try:
            await reader.accepted()
            stream = await EventStream.begin(request)
            while True:
                await stream.wait(news)
                for line in reader.pop():
                    await stream.send(line)
                if reader.skipped:
                    skipped, reader.skipped = reader.skipped, 0
                    await stream.send({"skipped": skipped}, "skipped")
                await asyncio.sleep(UPDATE_PERIOD_SEC)
        finally:
            reader.close()


LOG_QUERY: Final = {"level": "The least level", "node": "A node's name", "text": "Part of the line"}
ROUTES: Final = (
    Route(
        "GET",
        "/api/log",
        log,
        summary="The lines that are kept and new ones as events",
        content=EVENTS,
        errors=("400", *READING),
        query=LOG_QUERY,
    ),
)
