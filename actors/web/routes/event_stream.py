"""Responses that go on: streams of server-sent events (https://html.spec.whatwg.org/#server-sent-events)."""

from __future__ import annotations

import asyncio
from typing import Final

import msgspec
from aiohttp import web

from actors.web.pieces import pieces

COMMENT_SEC: Final = 15.0
"""Without an event for so long, a comment is sent: proxies end silent streams, and a reader may have gone."""


class EventStream:
    """A stream of server-sent events.

    Args:
        response: The prepared response.

    Attributes:
        response: The same.
    """

    def __init__(self, response: web.StreamResponse) -> None:
        self.response = response

    @staticmethod
    async def begin(request: web.Request) -> EventStream:
        """Begin to respond to a request; an error from now on becomes an event `error`, see `respond`."""
        headers = {"Content-Type": "text/event-stream", "Cache-Control": "no-store"}
        stream = EventStream(web.StreamResponse(headers=headers))
        request[STREAM] = stream
        await stream.response.prepare(request)
        return stream

    async def send(self, document: object, event: str = "message") -> None:
        """Send one event, and wait while the reader is slow.

        Args:
            document: Its data, as JSON.
            event: Its kind.
        """
        await self.send_json(msgspec.json.encode(document), event)

    async def send_json(self, data: bytes, event: str = "message") -> None:
        """Send one event whose data has been encoded: long documents are encoded in a thread.

        Args:
            data: JSON without line ends.
            event: Its kind.
        """
        async for piece in pieces(b"event: %s\ndata: %s\n\n" % (event.encode(), data)):
            await self.response.write(piece)

    async def wait(self, news: asyncio.Event) -> None:
        """Wait for news, and clear it; send comments meanwhile."""
        while True:
            try:
                async with asyncio.timeout(COMMENT_SEC):
                    await news.wait()
            except TimeoutError:
                await self.response.write(b":\n\n")
            else:
                news.clear()
                return


STREAM: Final = web.RequestKey("STREAM", EventStream)
"""The stream that answers a request, if one has begun."""
