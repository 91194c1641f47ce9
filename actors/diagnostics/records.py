"""A snapshot of a node's queues, counters and callback times, as plain data.

`Node.diagnostics()` takes it; nothing runs in the background. Counters are totals since the node was made, so
two snapshots give rates: `later.rates_since(earlier)`. `json.dumps` accepts the result of `as_dict()`.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Final, Protocol

from actors.diagnostics.shared_memory import SharedMemoryDiagnostics
from proto.renaming import former_name
from proto.wire.stats import increase

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

PUBLISHER_TOTALS: Final = ("published", "dropped")
SUBSCRIPTION_TOTALS: Final = ("received", "dropped", "expired", "lost", "lost_on_break", "undecodable")
SERVICE_TOTALS: Final = ("served", "errors")
CLIENT_TOTALS: Final = ("calls", "failed", "timeouts")
TIMER_TOTALS: Final = ("ticks", "skipped")
"""The fields that only grow, from which rates are computed."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Size:
    """The size of a map or queue of a node that no other field shows.

    Attributes:
        name: Its name.
        size: Its entries.
        limit: The most it may hold; None if the program's own entities, tasks and parameters, or the broker's
            limits, bound it.
    """

    name: str
    size: int
    limit: int | None = None


@dataclass(frozen=True, kw_only=True, slots=True)
class CallbackDiagnostics:
    """The time that a callback takes.

    Attributes:
        name: The function's name.
        calls: How often it has been called.
        busy_sec: Total seconds for which it has held the event loop, without the time in `await`.
        longest_sec: The longest such time without a break: one batch of plain callbacks, or a coroutine from
            one `await` to the next.
        longest_elapsed_sec: The longest time from start to end of a coroutine, with the time in `await`.
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
        matched: Matched subscriptions now.
        published: Messages published, in any thread.
        dropped: Messages dropped here, unsent; with those that the queue of a `ThreadPublisher` has dropped.
        queued: Unsent messages.
        queued_bytes: Their size, without those of this loop turn.
        queue_limit: Limit of unsent messages.
        credit: Messages that may be sent before the slowest KEEP_ALL reader grants more; None: unlimited.
        events: The callbacks of its events.
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
        """The key of its rates in `NodeRates`."""
        return self.topic


@dataclass(frozen=True, kw_only=True, slots=True)
class SubscriptionDiagnostics:
    """A subscription.

    Attributes:
        id: Its number in the node.
        topic: The full name of its topic.
        matched: Matched publishers now.
        received: Messages handed to the callback or the iterator.
        queued: Messages not yet handed over.
        queue_limit: Limit of these; with KEEP_ALL, the sum for the publishers matched now.
        running: Coroutine callbacks that run now.
        dropped: Messages dropped here because the reader was slow.
        expired: Messages that exceeded their lifespan in the queue.
        lost: Messages that did not arrive over an unbroken link.
        lost_on_break: Messages that did not arrive because a link broke.
        undecodable: Messages dropped because they were not valid, or left out so many fields that they would
            have taken far more memory than their bytes.
        callback: Its callback; None for a subscription that is iterated over.
        events: The callbacks of its events.
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
        """The key of its rates in `NodeRates`."""
        return self.topic


@dataclass(frozen=True, kw_only=True, slots=True)
class ServiceDiagnostics:
    """A service.

    Attributes:
        id: Its number in the node.
        service: Its full name.
        waiting: Requests that wait for the handler.
        waiting_bytes: Their size.
        queue_limit: Limit of waiting requests.
        running: Requests whose handler runs now.
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
        """The key of its rates in `NodeRates`."""
        return self.service


@dataclass(frozen=True, kw_only=True, slots=True)
class ClientDiagnostics:
    """A client.

    Attributes:
        id: Its number in the node.
        service: The full name of the service that it calls.
        matched: Matched servers now.
        pending: Calls in flight.
        calls: Calls made.
        failed: Calls that ended in an error, timeouts included.
        timeouts: Calls whose deadline passed.
        late: Replies that arrived after the end of their call.
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
        """The key of its rates in `NodeRates`."""
        return self.service


@dataclass(frozen=True, kw_only=True, slots=True)
class TimerDiagnostics:
    """A timer.

    Attributes:
        id: Its number in the process.
        period_sec: Its period.
        ticks: Callbacks run.
        skipped: Ticks without a callback, because the last one still ran or waited.
        callback: Its callback.
    """

    id: int
    period_sec: float
    ticks: int
    skipped: int
    callback: CallbackDiagnostics

    @property
    def name(self) -> str:
        """The key of its rates in `NodeRates`."""
        return self.callback.name


@dataclass(frozen=True, kw_only=True, slots=True)
class MailboxDiagnostics:
    """The state of the node's mailbox.

    Attributes:
        busy: Whether a coroutine callback runs that excludes others.
        waiting: Subscriptions, services and timers with callbacks to run.
        suspended: Coroutine callbacks that wait for a call, or to be resumed after it.
        workers: Tasks that run coroutine callbacks, or are kept to run the next one.
    """

    busy: bool
    waiting: int
    suspended: int
    workers: int


@dataclass(frozen=True, kw_only=True, slots=True)
class LagDiagnostics:
    """The delay of the event loop's timers, measured several times a second while connected.

    Attributes:
        last_sec: The last measurement.
        longest_sec: The longest of the last minute.
    """

    last_sec: float
    longest_sec: float


@dataclass(frozen=True, kw_only=True, slots=True)
class NodeRates:
    """Events per second between two snapshots, by the name of topic, service or timer callback.

    Entities with the same name in the node are added up; entities destroyed in between are not included.

    Attributes:
        interval_sec: Seconds between the snapshots.
        busy: The fraction of it for which callbacks held the event loop, 0 to 1.
        callback_errors: Callbacks that raised, per second.
        publishers: By topic, the rate of each total.
        subscriptions: By topic, the rate of each total.
        services: By service, the rate of each total.
        clients: By service, the rate of each total.
        timers: By callback, the rate of each total.
    """

    interval_sec: float
    busy: float
    callback_errors: float
    publishers: dict[str, dict[str, float]]
    subscriptions: dict[str, dict[str, float]]
    services: dict[str, dict[str, float]]
    clients: dict[str, dict[str, float]]
    timers: dict[str, dict[str, float]]
    seconds = former_name("seconds", "interval_sec")

    def as_dict(self) -> dict[str, Any]:
        """Return dicts and numbers; `seconds`, the former `interval_sec`, stays for one version."""
        return {**asdict(self), "seconds": self.interval_sec}


@dataclass(frozen=True, kw_only=True, slots=True)
class NodeDiagnostics:
    """A snapshot of a node.

    Attributes:
        node: Its full name.
        broker: The URL of its broker, or the URLs that it tries.
        connected: Whether it has a session with a broker.
        connections: Sessions so far; more than 1 after a lost session.
        stamp_ns: Time of the snapshot in ns since the epoch.
        uptime_sec: Seconds since the node was made, by a steady clock.
        callback_errors: Callbacks that raised.
        outbox_bytes: Unsent bytes of control frames, requests and replies.
        mailbox: The state of its callbacks.
        loop_lag: The delay of the event loop.
        publishers, subscriptions, services, clients, timers: Its entities.
        sizes: Sizes of its other queues and maps, with their limits.
        shared_memory: Its large messages in shared memory.
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
    shared_memory: SharedMemoryDiagnostics = field(default_factory=SharedMemoryDiagnostics)

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
        """Return the snapshot as dicts, tuples, strings and numbers."""
        return asdict(self)

    def rates_since(self, earlier: NodeDiagnostics) -> NodeRates:
        """Return the events per second since an earlier snapshot of the same node.

        Counters that were reset in between, by a new start of the node, count from zero.

        Args:
            earlier: The earlier snapshot.

        Raises:
            ValueError: `earlier` is not earlier, or is of another node.
        """
        seconds = self.uptime_sec - earlier.uptime_sec
        if seconds <= 0 or self.node != earlier.node:
            raise ValueError("Rates need an earlier snapshot of the same node")
        return NodeRates(
            interval_sec=seconds,
            busy=max(0.0, _busy(self) - _busy(earlier)) / seconds,
            callback_errors=increase(("callback_errors",), earlier, self)["callback_errors"] / seconds,
            publishers=_rates(PUBLISHER_TOTALS, earlier.publishers, self.publishers, seconds),
            subscriptions=_rates(SUBSCRIPTION_TOTALS, earlier.subscriptions, self.subscriptions, seconds),
            services=_rates(SERVICE_TOTALS, earlier.services, self.services, seconds),
            clients=_rates(CLIENT_TOTALS, earlier.clients, self.clients, seconds),
            timers=_rates(TIMER_TOTALS, earlier.timers, self.timers, seconds),
        )


class _Counted(Protocol):
    """A record with totals."""

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
