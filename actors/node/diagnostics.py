"""Collects `Node.diagnostics()` from all of a node's parts."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Protocol

from actors.callbacks.mailbox import IDLE_WORKERS
from actors.diagnostics.records import LagDiagnostics, MailboxDiagnostics, NodeDiagnostics, Size
from actors.diagnostics.shared_memory import SharedMemoryDiagnostics
from actors.endpoints.client.endpoint import ClientEndpoint
from actors.endpoints.context import NodeContext
from actors.endpoints.publisher.endpoint import PublisherEndpoint
from actors.endpoints.service.endpoint import DeclaredService
from actors.endpoints.subscription.endpoint import SubscriptionEndpoint
from actors.logging.logger import MAX_FILTERS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from actors.callbacks.mailbox import Mailbox
    from actors.endpoints.context import NodeEndpoint
    from actors.session.shared_memory import SharedMemory


class Holder(Protocol):
    """A part of a node that holds maps or queues."""

    def sizes(self) -> Iterable[tuple[str, int]]:
        """Return their names, and how full they are."""
        ...


def diagnose(context: NodeContext, *holders: Holder) -> NodeDiagnostics:
    """Return a node's state and counts, given its context and the parts that the context does not have."""
    link = context.link
    # Without a session there is no outbox; what waits then is in the queues of the publishers.
    outbox = None if link.channel is None else link.channel.outbox
    now = 0.0 if link.loop is None else link.loop.time()
    endpoints = sorted(_endpoints(context), key=lambda each: each.id)  # as they were made
    return NodeDiagnostics(
        node=context.full_name,
        broker=link.url or link.broker_urls,
        connected=link.connected,
        connections=link.connections,
        stamp_ns=time.time_ns(),
        uptime_sec=context.watch.elapsed_sec,
        callback_errors=context.callback_errors,
        outbox_bytes=0 if outbox is None else outbox.urgent_bytes + outbox.ordered_bytes,
        mailbox=_mailbox(context.mailbox),
        loop_lag=LagDiagnostics(last_sec=link.lag.last_sec, longest_sec=link.lag.longest_sec(now)),
        publishers=tuple(each.diagnostics() for each in endpoints if isinstance(each, PublisherEndpoint)),
        subscriptions=tuple(
            each.diagnostics() for each in endpoints if isinstance(each, SubscriptionEndpoint)
        ),
        services=tuple(each.diagnostics() for each in endpoints if isinstance(each, DeclaredService)),
        clients=tuple(each.diagnostics() for each in endpoints if isinstance(each, ClientEndpoint)),
        timers=tuple(timer.diagnostics() for timer in context.timers),
        sizes=(
            *_own(context),
            *(Size(name=name, size=size) for holder in (link, *holders) for name, size in holder.sizes()),
        ),
        shared_memory=_shared_memory(link.shared_memory),
    )


def _endpoints(context: NodeContext) -> Iterator[NodeEndpoint]:
    """Return the endpoints of a node, and those of its bare nodes, whose callbacks it runs."""
    for each in context.endpoints:
        yield from each.endpoints if isinstance(each, NodeContext) else (each,)


def _shared_memory(shared: SharedMemory) -> SharedMemoryDiagnostics:
    return SharedMemoryDiagnostics(
        active=shared.active,
        written=shared.written,
        sent=shared.sent,
        full=shared.full,
        received=shared.received,
        stale=shared.stale,
        problem=shared.problem,
    )


def _mailbox(mailbox: Mailbox) -> MailboxDiagnostics:
    return MailboxDiagnostics(
        busy=mailbox.busy,
        waiting=mailbox.waiting,
        suspended=mailbox.suspended,
        workers=mailbox.workers,
    )


def _own(context: NodeContext) -> Iterator[Size]:
    yield Size(name="entities", size=len(context.endpoints))
    yield Size(name="timers", size=len(context.timers))
    yield Size(name="departing publishers", size=len(context.departing))
    # Everything that grows is listed with its size, so that a leak shows up as a number that rises.
    yield Size(name="idle workers", size=context.mailbox.idle_workers, limit=IDLE_WORKERS)
    yield Size(name="log filters", size=context.log.filters, limit=MAX_FILTERS)
