"""The broker's periodic check: handshake timeouts, keepalive, suspension of silent links."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Final

from broker.serving.link import logger
from proto.aio.process import return_memory
from proto.errors import ErrorCode
from proto.liveness import PeerState
from proto.wire import frames

if TYPE_CHECKING:
    from broker.options import BrokerOptions
    from broker.routing.router import Router
    from broker.serving.dispatcher import Dispatcher
    from broker.serving.link import Link
    from proto.loop_lag import LoopLag

CHECKS_PER_KEEPALIVE: Final = 6
"""Checks of a link within the time that it may be silent."""

REJECTION_DELAY: Final = 0.2
"""The part of the handshake timeout after which a link without a user is refused, if its address has failed
often. Its client should still be waiting for the answer."""

RETURN_PERIOD_SEC: Final = 10.0
"""Freed memory is returned to the system at most once in this time, as it stops all else for milliseconds."""


class PeriodicCheck:
    """Checks the links of one run of a broker; one task for all of them.

    Args:
        dispatcher: The links and graphs.
        lag: Records how late each check is.
    """

    def __init__(self, dispatcher: Dispatcher, lag: LoopLag) -> None:
        self._dispatcher = dispatcher
        self._lag = lag
        self._next_round = 0.0
        self._next_return = 0.0

    @property
    def _options(self) -> BrokerOptions:
        return self._dispatcher.options  # a reload replaces them

    async def run(self) -> None:
        """Check until cancelled."""
        loop = asyncio.get_running_loop()
        options = self._options
        period = min(options.keepalive_sec, options.handshake_timeout_sec) / CHECKS_PER_KEEPALIVE
        expected = loop.time() + period
        while True:
            await asyncio.sleep(period)
            now = loop.time()
            self._lag.record(now, max(0.0, now - expected))
            # After a stall of this process (a debugger, a suspended laptop) the sockets have not been read
            # yet: every peer would look silent. Check at the next time.
            stalled, expected = now - expected > period, now + period
            if not stalled:
                self._check(now)
                self._dispatcher.flush()
                self.return_memory(now)
                self._dispatcher.report_omitted()

    def _check(self, now: float) -> None:
        """Check the links that something relies on, or all during a stop; the other links in rounds."""
        dispatcher, options = self._dispatcher, self._options
        for router in tuple(dispatcher.joined):
            lines, deliveries = router.check_stalls(now)
            dispatcher.deliver(router, deliveries)
            for line in lines:
                dispatcher.warnings.warn("stalled subscriptions", "%s", line)
        all_due = dispatcher.draining or any(router.graph.watched for router in dispatcher.joined)
        due = dict(dispatcher.handshaking)
        for router, joined in dispatcher.joined.items():
            due.update((joined[peer], None) for peer in router.relied_on if peer in joined)
        if all_due or now >= self._next_round:
            shortest = min(options.idle_keepalive_sec, options.suspend_close_sec)
            self._next_round = now + shortest / CHECKS_PER_KEEPALIVE
            for router in dispatcher.joined:
                router.routes.prune(at_least=0)
                router.routes.latched_expiry.check(now)
            due.update((each, None) for each in dispatcher.links if all_due or each.check_at <= now)
        # After `due` is complete: closing a link below changes the dicts that it is made of.
        self._check_partial(now)
        for link in due:
            try:
                self.check_link(link, now, all_due=all_due)
            except Exception:  # noqa: BLE001 - a bug; the other links must be checked all the same
                logger.exception("Closing %s: its periodic check failed", link)
                link.channel.abort()

    def return_memory(self, now: float) -> None:
        """Return freed memory to the system if a link that held much has ended, at most once in a while.

        Args:
            now: Loop time.
        """
        memory = self._dispatcher.memory
        if memory.freed and now >= self._next_return:
            memory.freed = False
            self._next_return = now + RETURN_PERIOD_SEC
            return_memory()

    def _check_partial(self, now: float) -> None:
        """Close the links that do not complete a message that they have begun to send."""
        limit = self._options.reassembly_timeout_sec
        for link in tuple(self._dispatcher.partial):
            reassembler = link.channel.reassembler
            if not reassembler.held_bytes:
                del self._dispatcher.partial[link]
            elif reassembler.idle_sec(now) > limit:
                self._dispatcher.limit_counts.reassembly_timeouts += 1
                text = f"a message is incomplete, and no part of it has arrived for {limit:g} s"
                link.fail(ErrorCode.TIMEOUT, f"{text} (the broker's --reassembly-timeout-sec)")
                reassembler.clear()

    def check_link(self, link: Link, now: float, *, all_due: bool) -> None:
        """Check one link's handshake, keepalive and suspension.

        Args:
            link: The link.
            now: Loop time.
            all_due: Whether the short keepalive applies even if nothing relies on the link.
        """
        options, router = self._options, link.router
        if router is None and link.session:
            pass  # it has left and still reads why; its channel ends that in time
        elif router is None:
            age = now - link.opened_at
            if link.rejected and age > REJECTION_DELAY * options.handshake_timeout_sec:
                link.refuse(ErrorCode.UNAUTHORIZED, link.rejected)
            elif age > options.handshake_timeout_sec:
                text = f"no finished handshake within {options.handshake_timeout_sec:g} s"
                link.fail(ErrorCode.TIMEOUT, text)
                link.channel.abort()  # TLS would wait for the end of its own handshake first
        elif link.channel.waiting:  # a sign of life; a suspended link is restored when its turn has come
            link.liveness.mark_alive(now)
        elif link.suspended_at is None:
            self._check_keepalive(link, router, now, all_due=all_due)
        elif now - link.suspended_at > options.suspend_close_sec:
            link.fail(ErrorCode.TIMEOUT, f"silent for {now - link.liveness.last_seen_at:.0f} s")
            link.channel.abort()
        elif now - link.suspended_at > options.name_grace_sec:
            router.release_names(link.peer)

    def _check_keepalive(self, link: Link, router: Router, now: float, *, all_due: bool) -> None:
        limit = self._options.keepalive_sec
        relied_on = link.peer in router.relied_on
        if not (all_due or relied_on):
            limit = max(limit, self._options.idle_keepalive_sec)
        state = link.liveness.check(now, link.channel.bytes_received, limit)
        # Bytes that arrived before anything relied on the link do not show that the peer is alive now.
        if link.was_relied_on and link.liveness.last_seen_at == now:
            router.mark_alive(link.peer)
        link.was_relied_on = link.peer in router.relied_on
        link.check_at = now
        if state is PeerState.PING_DUE:
            link.channel.send(frames.Ping(0))
        elif state is PeerState.SILENT:
            self._dispatcher.suspend(link, router, now)
        else:
            link.check_at = now + limit / CHECKS_PER_KEEPALIVE
