"""Looks at all of a node's parts: what is behind `Node.diagnostics()`."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Protocol

from actors.diagnostics import LagDiagnostics, MailboxDiagnostics, NodeDiagnostics, Size
from actors.entities.client import Client
from actors.entities.publisher import Publisher
from actors.entities.service import Service
from actors.entities.subscription import Subscription
from actors.logger import MAX_FILTERS
from actors.mailbox import IDLE_WORKERS

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from actors.core import Core
    from actors.mailbox import Mailbox


class Holder(Protocol):
    """A part of a node that holds maps or queues."""

    def sizes(self) -> Iterable[Size]:
        """Say how full they are."""
        ...


def diagnose(core: Core, *holders: Holder) -> NodeDiagnostics:
    """Look at a node: its core, and those of its parts that the core does not know."""
    link = core.link
    outbox = None if link.channel is None else link.channel.outbox
    now = 0.0 if link.loop is None else link.loop.time()
    entities = tuple(core.entities)
    return NodeDiagnostics(
        node=core.full_name,
        broker=link.url or link.place,
        connected=link.connected,
        connections=link.connections,
        stamp_ns=time.time_ns(),
        uptime_sec=core.watch.elapsed_sec,
        callback_errors=core.callback_errors,
        outbox_bytes=0 if outbox is None else outbox.urgent_bytes + outbox.ordered_bytes,
        mailbox=_mailbox(core.mailbox),
        loop_lag=LagDiagnostics(last_sec=link.lag.last_sec, longest_sec=link.lag.longest_sec(now)),
        publishers=tuple(entity.diagnostics() for entity in entities if isinstance(entity, Publisher)),
        subscriptions=tuple(entity.diagnostics() for entity in entities if isinstance(entity, Subscription)),
        services=tuple(entity.diagnostics() for entity in entities if isinstance(entity, Service)),
        clients=tuple(entity.diagnostics() for entity in entities if isinstance(entity, Client)),
        timers=tuple(timer.diagnostics() for timer in core.timers),
        sizes=(*_own(core), *(size for holder in (link, *holders) for size in holder.sizes())),
    )


def _mailbox(mailbox: Mailbox) -> MailboxDiagnostics:
    return MailboxDiagnostics(
        busy=mailbox.busy,
        waiting=mailbox.waiting,
        suspended=mailbox.suspended,
        workers=mailbox.workers,
    )


def _own(core: Core) -> Iterator[Size]:
    yield Size(name="entities", size=len(core.entities))
    yield Size(name="timers", size=len(core.timers))
    yield Size(name="departing publishers", size=len(core.departing))
    yield Size(name="idle workers", size=core.mailbox.idle_workers, limit=IDLE_WORKERS)
    yield Size(name="log filters", size=core.log.filters, limit=MAX_FILTERS)
