"""Connects a link to one of its brokers, tried in order, and reconnects it after every loss.

Pauses between attempts grow and are random, so that many nodes do not reconnect at the same moment.
"""

from __future__ import annotations

import asyncio
import math
import random
import secrets
from typing import TYPE_CHECKING, Final

from actors.config.credentials import Credentials
from actors.errors import BrokerUnreachable, NotAuthorized, TlsFailed
from actors.session import first_attempt
from actors.session.connection import BrokerConnection
from actors.session.start_hint import start_hint
from proto import limits
from proto.wire import frames
from proto.wire.identity import agent

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from actors.session.connection import LinkLog
    from actors.session.link import Link
    from proto.wire.url import BrokerUrl

FIRST_RETRY_SEC: Final = 0.05
LAST_RETRY_SEC: Final = 2.0
CONNECT_TIMEOUT_SEC: Final = 5.0
SOON_SEC: Final = 5.0
"""A connect timeout that ends this soon needs no warning before it: its error says the same."""

AGENT: Final = agent("callboard-python")


class Connector:
    """Keeps one link connected to one of several brokers, until it is closed.

    Args:
        link: The link.
        urls: Brokers, in the order in which to try them.
        domain: Which of a broker's disjoint graphs to join.
        client_address: As for `NodeOptions`.
        credentials: What to present to a broker; None for nothing.
        log: Gets one line when no broker answers, and one when one does again.
        jitter: Returns a random factor between 0 and 1 for the pauses between attempts.

    Attributes:
        trying: Whether an attempt is under way; False once all brokers have been tried without success.
        closing: Whether it makes no more attempts.
    """

    def __init__(
        self,
        link: Link,
        urls: Sequence[BrokerUrl],
        *,
        domain: int,
        client_address: str | None = None,
        credentials: Credentials | None = None,
        log: LinkLog,
        jitter: Callable[[], float] = random.random,
    ) -> None:
        self.trying = True
        self.closing = False
        self._link = link
        self._urls = tuple(urls)
        self._log = log
        self._credentials = credentials or Credentials()
        self._jitter = jitter
        options: dict[str, frames.Scalar] = {
            "agent": AGENT,
            "domain": domain,
            "instance": secrets.token_bytes(limits.INSTANCE_BYTES),
            "token": link.token,
        }
        if client_address is not None:
            options["client_address"] = client_address
        self._hello = frames.Hello(limits.PROTOCOL_VERSION, options)
        self._connection: BrokerConnection | None = None
        self._warned = False
        self._retry_sec = FIRST_RETRY_SEC
        self._refusal = ""
        """The text of the last ERROR; a repetition is not logged."""
        self._unwelcoming: BrokerUrl | None = None
        """A URL where something accepts connections but sends no WELCOME: no broker can start there."""
        self._error: Exception | None = None
        """Why the first broker could not be reached."""

    @property
    def ended(self) -> bool:
        """Whether there is no connection: neither a session nor an attempt at one."""
        return self._connection is None or self._connection.ended.is_set()

    async def first_attempt(self, done: Callable[[], bool]) -> None:
        """Wait until `done`, or until every broker has been tried; `FIRST_ANSWER_SEC` at most."""

        def attempt_ended() -> bool:
            return done() or not self.trying

        await first_attempt.wait(self._link, self._urls, attempt_ended, again_after_sec=CONNECT_TIMEOUT_SEC)

    async def run(self, *, connect_timeout_sec: float | None = None) -> None:
        """Connect, and connect again after every loss, until `leave`.

        Raises:
            BrokerUnreachable: No first session within `connect_timeout_sec`; TlsFailed because of TLS.
            NodeNameTaken: The broker refused the node's name at the first session.
            NotAuthorized: The first session needs other credentials.
            ProtocolError: The broker speaks another version.
            TlsFileError: A file for TLS cannot be used.
        """
        try:
            await self._keep_connected(connect_timeout_sec)
        finally:
            self._stop_trying()
            if self._link.loop is not None:
                first_attempt.wait_again(self._link.loop, self._urls)

    def _stop_trying(self) -> None:
        self.trying = False
        self._link.wake()

    async def _keep_connected(self, connect_timeout_sec: float | None) -> None:
        link = self._link
        loop = link.run()
        deadline = None if connect_timeout_sec is None else loop.time() + connect_timeout_sec
        share_until: float | None = loop.time() + first_attempt.FIRST_ANSWER_SEC
        while not self.closing:
            self.trying = True
            until = None if link.connections else deadline
            connection = await self._try_all(loop, until, share_until if until is None else until)
            share_until = None
            if connection is not None:
                await self._serve(connection, loop)
            if self.closing:
                return
            if connection is None:
                self._stop_trying()
                self._warn_once(left_sec=math.inf if deadline is None else deadline - loop.time())
            pause = self._retry_sec * (0.5 + 0.5 * self._jitter())
            if deadline is not None and not link.connections:
                pause = max(0.0, min(pause, deadline - loop.time()))
            await asyncio.sleep(pause)
            self._retry_sec = min(2 * self._retry_sec, LAST_RETRY_SEC)

    async def _try_all(
        self, loop: asyncio.AbstractEventLoop, deadline: float | None, share_until: float | None
    ) -> BrokerConnection | None:
        """Try each broker once, in order; return the first connection that becomes a session.

        Args:
            loop: The running loop.
            deadline: When the last of them must have answered; None: each has `CONNECT_TIMEOUT_SEC`.
            share_until: Until then each has an equal share of the time left, so that a broker that accepts
                connections and sends nothing leaves time for the others. None: no sharing.
        """
        for left, url in zip(range(len(self._urls), 0, -1), self._urls, strict=True):
            now = loop.time()
            until = share_until if left > 1 else deadline
            end = now + CONNECT_TIMEOUT_SEC
            if until is not None:
                end = min(end, now + (until - now) / left)
            connection = self._connection = BrokerConnection(
                self._link, url, self._hello, self._credentials, self._log
            )
            if await connection.open(self._link, end):
                self._connected(url, loop)
                return connection
            self._note_failure(connection)
            if self.closing:
                break
        return None

    async def _serve(self, connection: BrokerConnection, loop: asyncio.AbstractEventLoop) -> None:
        """Keep the session alive until it ends."""
        began = loop.time()
        try:
            await connection.keep_alive(self._link)
        finally:
            if not connection.ended.is_set() and not self.closing:
                connection.abort()
        if loop.time() - began > LAST_RETRY_SEC:
            self._retry_sec = FIRST_RETRY_SEC
            self._refusal = ""
        self._note_failure(connection)

    def _connected(self, url: BrokerUrl, loop: asyncio.AbstractEventLoop) -> None:
        if self._warned:
            self._log.info(f"Connected to the broker at {url}")
        self._warned = False
        self._unwelcoming = self._error = None
        first_attempt.wait_again(loop, self._urls)

    def _note_failure(self, connection: BrokerConnection) -> None:
        """Note why a connection ended; raise its error if further attempts would repeat it."""
        url, error = connection.url, connection.error
        if not connection.had_session:
            self._link.waits_for_name = False
        fatal = connection.fatal
        # A running node waits: the broker's rules or the token's file may become valid again.
        waits = isinstance(fatal, NotAuthorized) and self._link.connections > 0
        if fatal is not None and not waits:
            raise fatal  # which says the same; a server that tries tokens for others logs it once for many
        if connection.refusal and connection.refusal != self._refusal:
            self._refusal = connection.refusal
            self._log.warning(str(fatal) if waits else connection.refusal)
        if error is not None:
            if url == self._urls[0]:
                self._error = error
            if self._unwelcoming == url:
                self._unwelcoming = None  # nothing listens there any more
        elif connection.reached and not connection.had_session and self._unwelcoming is None:
            self._unwelcoming = url

    def _warn_once(self, *, left_sec: float) -> None:
        """Warn that no broker answers; raise if it is too late for the first session.

        Args:
            left_sec: The time left for the first session.
        """
        failure = self._error if isinstance(self._error, TlsFailed) else None
        is_first = not self._link.connections
        if is_first and left_sec <= 0:
            raise failure or BrokerUnreachable(f"No broker at {self._link.broker_urls}. {self._hint()}")
        if not self._warned and not (is_first and left_sec < SOON_SEC):
            self._warned = True
            text = f"No broker at {self._link.broker_urls}; waiting for one. {self._hint()}"
            self._log.warning(text if failure is None else f"{failure}. Trying again")

    def _hint(self) -> str:
        if self._unwelcoming is None:
            return start_hint(self._urls[0], self._error)
        return f"Something listens at {self._unwelcoming} and has not let this node in"

    def leave(self) -> None:
        """Make no more attempts, and end the connection behind everything that has been sent."""
        closing, self.closing = self.closing, True
        if not closing and self._connection is not None:
            self._connection.leave()

    def abort(self) -> None:
        """Make no more attempts, and end the connection now."""
        self.closing = True
        if self._connection is not None and not self._connection.ended.is_set():
            self._connection.abort()
