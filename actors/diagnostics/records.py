"""What a node holds, drops and spends its time on, at one moment, as plain data.

`Node.diagnostics()` looks; nothing runs in the background for it. Counts are totals since the node was made,
so two looks give rates: `later.rates_since(earlier)`. `as_dict()` is ready for `json.dumps`.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Final, Protocol

from proto.stats import increase

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

PUBLISHER_TOTALS: Final = ("published", "dropped")
SUBSCRIPTION_TOTALS: Final = ("received", "dropped", "expired", "lost", "lost_on_break", "undecodable")
SERVICE_TOTALS: Final = ("served", "errors")
CLIENT_TOTALS: Final = ("calls", "failed", "timeouts")
TIMER_TOTALS: Final = ("ticks", "skipped")
"""The fields that only grow: what rates are made of."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Size:
    """One map or queue of a node that its other numbers do not show.

    Attributes:
        limit: The most it may hold. None: as much as whoever fills it has (the program's own entities, tasks
            and parameters, or what the broker allows).
    """

    name: str
    size: int
    limit: int | None = None


@dataclass(frozen=True, kw_only=True, slots=True)
class CallbackDiagnostics:
    """How long a callback takes.

    Attributes:
        name: The function's name.
        calls: How often it has been called.
        busy_sec: Seconds for which it has held the event loop, in all; what it waits in `await` is not in it.
        longest_sec: The longest time without a break: a batch of plain callbacks, or a coroutine from one
            `await` to the next.
        longest_elapsed_sec: For coroutines: the longest time since one began, waiting included.
        slow: How often it has held the loop for longer than the node's `slow_callback_sec`.
    """

    name: str
    calls: int
    busy_sec: float
    longest_sec: float
    longest_elapsed_sec: float
    slow: int


@dataclass(frozen=True, kw_only=True, slots=True)
class PublisherDiagnostics:
    """A publisher.

    Attributes:
        id: Its number in the node.
        topic: The full name of its topic.
        matched: Subscriptions that it reaches now.
        published: Messages published.
        dropped: Messages dropped here, unsent.
        queued: Messages that wait to be sent.
        queued_bytes: Their size, those of this loop turn aside.
        queue_limit: The most that may wait.
        credit: Messages that may leave before the slowest KEEP_ALL reader must give credit; None: unlimited.
        events: The callbacks of its events, those that it has.
    """

    id: int
    topic: str
    matched: int
    published: int
    dropped: int
    queued: int
    queued_bytes: int
    queue_limit: int
    credit: int | None
    events: tuple[CallbackDiagnostics, ...]

    @property
    def name(self) -> str:
        """What its rates stand under."""
        return self.topic


@dataclass(frozen=True, kw_only=True, slots=True)
class SubscriptionDiagnostics:
    """A subscription.

    Attributes:
        id: Its number in the node.
        topic: The full name of its topic.
        matched: Publishers that it hears now.
        received: Messages handed to the callback or the iterator.
        queued: Messages that wait for it.
        queue_limit: The most that may wait; with KEEP_ALL, of the publishers that are matched now.
        running: Coroutine callbacks under way.
        dropped: Messages dropped here, because the reader was slow.
        expired: Messages that got too old while they waited here.
        lost: Messages that never came over an unbroken link.
        lost_on_break: Messages that never came because a link broke.
        undecodable: Messages dropped because they were not valid.
        callback: None for a subscription that is iterated over.
        events: The callbacks of its events, those that it has.
    """

    id: int
    topic: str
    matched: int
    received: int
    queued: int
    queue_limit: int
    running: int
    dropped: int
    expired: int
    lost: int
    lost_on_break: int
    undecodable: int
    callback: CallbackDiagnostics | None
    events: tuple[CallbackDiagnostics, ...]

    @property
    def name(self) -> str:
        """What its rates stand under."""
        return self.topic


@dataclass(frozen=True, kw_only=True, slots=True)
class ServiceDiagnostics:
    """A service.

    Attributes:
        id: Its number in the node.
        service: Its full name.
        waiting: Requests that wait for the handler.
        waiting_bytes: Their size.
        queue_limit: The most that may wait.
        running: Requests whose handler is under way.
        served: Requests answered, errors included.
        errors: Requests answered with an error.
        callback: The handler.
    """

    id: int
    service: str
    waiting: int
    waiting_bytes: int
    queue_limit: int
    running: int
    served: int
    errors: int
    callback: CallbackDiagnostics

    @property
    def name(self) -> str:
        """What its rates stand under."""
        return self.service


@dataclass(frozen=True, kw_only=True, slots=True)
class ClientDiagnostics:
    """A client.

    Attributes:
        id: Its number in the node.
        service: The full name of the service that it calls.
        matched: Servers of it now.
        pending: Calls in flight.
        calls: Calls made.
        failed: Calls that have ended in an error, timeouts among them.
        timeouts: Calls whose deadline has passed.
        late: Replies that came when their call had ended already.
    """

    id: int
    service: str
    matched: int
    pending: int
    calls: int
    failed: int
    timeouts: int
    late: int

    @property
    def name(self) -> str:
        """What its rates stand under."""
        return self.service


@dataclass(frozen=True, kw_only=True, slots=True)
class TimerDiagnostics:
    """A timer.

    Attributes:
        id: Its number in the process.
        period_sec: Its period.
        ticks: Callbacks run.
        skipped: Ticks that passed unused, because the callback still ran or waited.
        callback: What it calls.
    """

    id: int
    period_sec: float
    ticks: int
    skipped: int
    callback: CallbackDiagnostics

    @property
    def name(self) -> str:
        """What its rates stand under."""
        return self.callback.name


@dataclass(frozen=True, kw_only=True, slots=True)
class MailboxDiagnostics:
    """What the node's callbacks do.

    Attributes:
        busy: Whether a coroutine callback is under way that lets no other run.
        waiting: Subscriptions, services and timers that have something to run.
        suspended: Coroutine callbacks that wait for a call, or for their turn after it.
        workers: Tasks that run coroutine callbacks, or are kept to run the next one.
    """

    busy: bool
    waiting: int
    suspended: int
    workers: int


@dataclass(frozen=True, kw_only=True, slots=True)
class LagDiagnostics:
    """How late the event loop is with what is due; looked at some times a second, with a broker only.

    Attributes:
        last_sec: At the last look.
        longest_sec: In the last minute.
    """

    last_sec: float
    longest_sec: float


@dataclass(frozen=True, kw_only=True, slots=True)
class NodeRates:
    """What happened per second between two looks, by the name of topic, service or timer callback.

    What has one name in the node is added up. Of entities that have gone in between nothing is known.

    Attributes:
        seconds: The time between the looks.
        busy: The part of it for which callbacks held the event loop, 0 to 1.
        callback_errors: Callbacks that raised, per second.
    """

    seconds: float
    busy: float
    callback_errors: float
    publishers: dict[str, dict[str, float]]
    subscriptions: dict[str, dict[str, float]]
    services: dict[str, dict[str, float]]
    clients: dict[str, dict[str, float]]
    timers: dict[str, dict[str, float]]

    def as_dict(self) -> dict[str, Any]:
        """Return the same as dicts and numbers."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True, slots=True)
class NodeDiagnostics:
    """A node at one moment.

    Attributes:
        node: Its full name.
        broker: The URL of its broker, or those that it tries.
        connected: Whether there is a session with a broker now.
        connections: Sessions so far; above 1 there was a loss.
        stamp_ns: When this was, in ns since the epoch.
        uptime_sec: Seconds since the node was made, by a steady clock.
        callback_errors: Callbacks that have raised.
        outbox_bytes: Control frames, requests and replies that wait to be sent.
        mailbox: What its callbacks do.
        loop_lag: How late the event loop is.
        publishers, subscriptions, services, clients, timers: What it has.
        sizes: Whatever else it holds, with its limits.
    """

    node: str
    broker: str
    connected: bool
    connections: int
    stamp_ns: int
    uptime_sec: float
    callback_errors: int
    outbox_bytes: int
    mailbox: MailboxDiagnostics
    loop_lag: LagDiagnostics
    publishers: tuple[PublisherDiagnostics, ...]
    subscriptions: tuple[SubscriptionDiagnostics, ...]
    services: tuple[ServiceDiagnostics, ...]
    clients: tuple[ClientDiagnostics, ...]
    timers: tuple[TimerDiagnostics, ...]
    sizes: tuple[Size, ...]

    @property
    def callbacks(self) -> tuple[CallbackDiagnostics, ...]:
        """Every callback of the node, the busiest first."""
        found = [
            *(
                subscription.callback
                for subscription in self.subscriptions
                if subscription.callback is not None
            ),
            *(service.callback for service in self.services),
            *(timer.callback for timer in self.timers),
            *(event for publisher in self.publishers for event in publisher.events),
            *(event for subscription in self.subscriptions for event in subscription.events),
        ]
        return tuple(sorted(found, key=lambda callback: callback.busy_sec, reverse=True))

    def as_dict(self) -> dict[str, Any]:
        """Return the same as dicts, tuples, strings and numbers."""
        return asdict(self)

    def rates_since(self, earlier: NodeDiagnostics) -> NodeRates:
        """Return what has happened per second since an earlier look at the same node.

        What has begun anew in between, in another life of the node, counts from zero.

        Raises:
            ValueError: `earlier` is not earlier, or another node's.
        """
        seconds = self.uptime_sec - earlier.uptime_sec
        if seconds <= 0 or self.node != earlier.node:
            raise ValueError("Rates need an earlier look at the same node")
        return NodeRates(
            seconds=seconds,
            busy=max(0.0, _busy(self) - _busy(earlier)) / seconds,
            callback_errors=increase(("callback_errors",), earlier, self)["callback_errors"] / seconds,
            publishers=_rates(PUBLISHER_TOTALS, earlier.publishers, self.publishers, seconds),
            subscriptions=_rates(SUBSCRIPTION_TOTALS, earlier.subscriptions, self.subscriptions, seconds),
            services=_rates(SERVICE_TOTALS, earlier.services, self.services, seconds),
            clients=_rates(CLIENT_TOTALS, earlier.clients, self.clients, seconds),
            timers=_rates(TIMER_TOTALS, earlier.timers, self.timers, seconds),
        )


class _Counted(Protocol):
    """What has totals."""

    @property
    def id(self) -> int: ...

    @property
    def name(self) -> str: ...


def _busy(node: NodeDiagnostics) -> float:
    return sum(callback.busy_sec for callback in node.callbacks)


def _rates(
    totals: Sequence[str], earlier: Iterable[_Counted], later: Iterable[_Counted], seconds: float
) -> dict[str, dict[str, float]]:
    before = {entity.id: entity for entity in earlier}
    rates: dict[str, dict[str, float]] = {}
    for entity in later:
        of_name = rates.setdefault(entity.name, dict.fromkeys(totals, 0.0))
        for total, change in increase(totals, before.get(entity.id), entity).items():
            of_name[total] += change / seconds
    return rates
