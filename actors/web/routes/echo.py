"""Topics as streams of events."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

from actors.web.json_encoding import encode_json
from actors.web.live.echo_panel import MESSAGES_PER_UPDATE, message_document
from actors.web.live.session import UPDATE_PERIOD_SEC
from actors.web.routes.event_stream import EventStream
from actors.web.routes.graph import name_in
from actors.web.routes.route import EVENTS, READING, Route
from actors.web.routes.state import state_of, workspace_of

if TYPE_CHECKING:
    from aiohttp import web

    from actors.web.topic_feed import Received, TopicReader


async def echo(request: web.Request) -> web.StreamResponse:
    """Send the messages of a topic until the reader leaves; a slow one gets the newest."""
    workspace, news = workspace_of(request), asyncio.Event()
    with state_of(request).live_connection(request):
        reader = workspace.feeds.read(
            name_in(request), MESSAGES_PER_UPDATE, news.set, request.query.get("type", "")
        )
        try:
            await reader.accepted()
            stream = await EventStream.begin(request)
            while True:
                await stream.wait(news)
                for received in reader.pop():
                    await stream.send_json(await workspace.work.run(_encoded, received, reader))
                if reader.skipped:
                    skipped, reader.skipped = reader.skipped, 0
                    await stream.send({"skipped": skipped}, "skipped")
                await asyncio.sleep(UPDATE_PERIOD_SEC)
        finally:
            reader.close()


def _encoded(received: Received, reader: TopicReader) -> bytes:
    return encode_json(message_document(received, reader))


ROUTES: Final = (
    Route(
        "GET",
        "/api/topics/{name:.+}/echo",
        echo,
        summary="The messages of a topic as events; a slow reader gets the newest",
        content=EVENTS,
        errors=("400", *READING),
        query={"type": "One type's messages only, if the topic has several"},
    ),
)
