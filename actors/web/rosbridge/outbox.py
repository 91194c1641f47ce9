"""The frames that wait for one client, and the task that sends them.

Replies are sent in order, and none is dropped: a client that does not read them is disconnected. Messages of
topics take turns, and a slow client gets the newest ones.
"""

from __future__ import annotations

import asyncio
from collections import deque
from contextlib import suppress
from typing import TYPE_CHECKING, Final, NamedTuple

from aiohttp import WSMsgType

from actors.web.rosbridge.frames import as_png, in_fragments
from actors.web.worker import TooMuchWorkError

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable

    from aiohttp.web import WebSocketResponse

    from actors.web.rosbridge.operations import Compression
    from actors.web.worker import WorkShare

MAX_REPLY_BYTES: Final = 16 * 1024 * 1024
"""Replies that wait for a client; it is disconnected beyond. One larger reply may wait alone."""

PAUSE_REPLY_BYTES: Final = 1024 * 1024
"""Replies that wait for a client, beyond which nothing more is read from it."""

FRAMES_PER_TURN: Final = 32
"""Frames of one client that are sent in one loop turn."""


class Reply(NamedTuple):
    """A frame that is not dropped.

    Attributes:
        frame: The operation in JSON.
        fragment_size: Characters of the data of a fragment; None for no fragments.
        compression: "png", or anything else for none: no client asks for CBOR replies.
    """

    frame: bytes
    fragment_size: int | None = None
    compression: Compression | None = None


class Outbox:
    """The frames for one client.

    Args:
        socket: The prepared WebSocket.
        work: Makes PNG files in a thread.
        on_overflow: Called once if more than `MAX_REPLY_BYTES` wait; it disconnects the client.
    """

    def __init__(
        self,
        socket: WebSocketResponse,
        work: WorkShare,
        on_overflow: Callable[[], object],
    ) -> None:
        self._socket, self._work, self._on_overflow = socket, work, on_overflow
        self._replies: deque[Reply] = deque()
        self._bytes = 0
        self._overflow = False
        self._news = asyncio.Event()
        self._room = asyncio.Event()
        self._room.set()
        self._sent = self._fragmented = 0

    def add(self, reply: Reply) -> None:
        """Send a reply when its turn comes."""
        if self._overflow:
            return
        self._replies.append(reply)
        self._bytes += len(reply.frame)
        if self._bytes > MAX_REPLY_BYTES and len(self._replies) > 1:
            self._overflow = True
            self._on_overflow()
        if self._bytes > PAUSE_REPLY_BYTES:
            self._room.clear()
        self._news.set()

    def wake(self) -> None:
        """Let `send_topics` be called: there may be a message of a topic."""
        self._news.set()

    async def room(self) -> None:
        """Wait until the client has read most of its replies."""
        await self._room.wait()

    async def run(self, send_topics: Callable[[], Awaitable[float | None]]) -> None:
        """Send until cancelled.

        Args:
            send_topics: Sends the messages of topics that wait, with `send`, and returns the seconds until
                the next one may be sent; None if none waits.

        Raises:
            ConnectionError: The client has gone.
        """
        timer: asyncio.TimerHandle | None = None
        try:
            while True:
                await self._news.wait()
                self._news.clear()
                await self._send_replies()
                delay_sec = await send_topics()
                if timer is not None:
                    timer.cancel()
                    timer = None
                if delay_sec is not None:
                    timer = asyncio.get_running_loop().call_later(delay_sec, self._news.set)
        finally:
            if timer is not None:
                timer.cancel()

    async def send(self, frame: bytes, fragment_size: int | None, *, binary: bool) -> None:
        """Send a frame, and wait while the client is slow.

        Args:
            frame: The operation.
            fragment_size: As for `Reply`.
            binary: Whether it is CBOR.
        """
        if binary or fragment_size is None or len(frame) <= fragment_size:
            await self._send(frame, WSMsgType.BINARY if binary else WSMsgType.TEXT)
            return
        self._fragmented += 1
        for fragment in in_fragments(frame, fragment_size, f"fragment:{self._fragmented}"):
            await self._send(fragment, WSMsgType.TEXT)

    async def _send(self, frame: bytes, kind: WSMsgType) -> None:
        await self._socket.send_frame(frame, kind)
        self._sent += 1
        if self._sent % FRAMES_PER_TURN == 0:
            await asyncio.sleep(0)

    async def _send_replies(self) -> None:
        while self._replies:
            reply = self._replies[0]
            frame = reply.frame
            if reply.compression == "png":
                with suppress(TooMuchWorkError):  # then it is sent as it is, which all clients understand
                    frame = await self._work.run(as_png, frame)
            await self.send(frame, reply.fragment_size, binary=False)
            self._replies.popleft()
            self._bytes -= len(reply.frame)
            if self._bytes <= PAUSE_REPLY_BYTES:
                self._room.set()
