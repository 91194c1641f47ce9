"""QoS events of publishers and subscriptions, and their callbacks.

Names and fields are rclpy's. An event is a state with counts, not a log: a callback gets the counts as they
are now and how they have changed since it was last called, at most once per loop turn. It runs through the
node's mailbox like every other callback.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from actors.callbacks.callback_task import CallbackTask
from actors.callbacks.functions import ENDS_PROGRAM, as_coroutine, takes
from actors.qos.compatibility import QoSPolicyKind
from proto.wire.codes import NoticeKind

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.callbacks.source import Share
    from actors.diagnostics.records import CallbackDiagnostics
    from actors.endpoints.context import NodeContext
    from proto.wire import frames

EventCallback: TypeAlias = "Callable[[Any], Any]"


class MatchedInfo(NamedTuple):
    """How many counterparts there have been in all, and how many there are now."""

    total_count: int
    total_count_change: int
    current_count: int
    current_count_change: int


class DeadlineMissedInfo(NamedTuple):
    """Periods of the deadline without a message."""

    total_count: int
    total_count_change: int


class LivelinessLostInfo(NamedTuple):
    """How often a MANUAL_BY_TOPIC publisher has not asserted itself within its lease."""

    total_count: int
    total_count_change: int


class LivelinessChangedInfo(NamedTuple):
    """How many publishers are alive, and how many are attached or suspended but not alive."""

    alive_count: int
    alive_count_change: int
    not_alive_count: int
    not_alive_count_change: int


class MessageLostInfo(NamedTuple):
    """Messages that a subscription did not get: dropped for slowness anywhere, or lost on a break."""

    total_count: int
    total_count_change: int


class IncompatibleQoSInfo(NamedTuple):
    """Counterparts whose QoS does not fit; `last_policy_kind` is the last policy that did not."""

    total_count: int
    total_count_change: int
    last_policy_kind: QoSPolicyKind


class IncompatibleTypeInfo(NamedTuple):
    """Counterparts of another type, which are not matched."""

    total_count: int
    total_count_change: int


@dataclass(frozen=True, kw_only=True, slots=True)
class PublisherEventCallbacks:
    """Callbacks for the events of a publisher: `callback(info)`, `def` or `async def`.

    Args:
        deadline: It has not published within its deadline (DeadlineMissedInfo).
        liveliness: It has not asserted itself within its lease (LivelinessLostInfo).
        incompatible_qos: A subscription asks for more than it offers (IncompatibleQoSInfo).
        incompatible_type: A subscription of another type (IncompatibleTypeInfo).
        matched: A subscription was matched or unmatched (MatchedInfo).
        use_default_callbacks: Log incompatible QoS and types as warnings where no callback is given.
    """

    deadline: EventCallback | None = None
    liveliness: EventCallback | None = None
    incompatible_qos: EventCallback | None = None
    incompatible_type: EventCallback | None = None
    matched: EventCallback | None = None
    use_default_callbacks: bool = True


@dataclass(frozen=True, kw_only=True, slots=True)
class SubscriptionEventCallbacks:
    """Callbacks for the events of a subscription: `callback(info)`, `def` or `async def`.

    Args:
        deadline: No message was received within its deadline (DeadlineMissedInfo).
        liveliness: A publisher became alive or not alive, or is gone (LivelinessChangedInfo).
        incompatible_qos: A publisher offers less than it asks for (IncompatibleQoSInfo).
        incompatible_type: A publisher of another type (IncompatibleTypeInfo).
        matched: A publisher was matched or unmatched (MatchedInfo).
        message_lost: Messages were dropped or lost on their way (MessageLostInfo).
        use_default_callbacks: Log incompatible QoS and types as warnings where no callback is given.
    """

    deadline: EventCallback | None = None
    liveliness: EventCallback | None = None
    incompatible_qos: EventCallback | None = None
    incompatible_type: EventCallback | None = None
    matched: EventCallback | None = None
    message_lost: EventCallback | None = None
    use_default_callbacks: bool = True


class Event:
    """One kind of event of one endpoint: its counts, and those that its callback got last.

    Args:
        context: The node.
        what: Names the endpoint in messages.
        info: Makes the callback's argument from each count followed by its change.
        callback: The user's; without one events are only counted.
        width: How many counts there are.

    Attributes:
        counts: The counts as they are now.
        calls: Times the callback has been called.
        timing: How long it takes, if there is one.
    """

    __slots__ = (
        "_callback",
        "_context",
        "_due",
        "_info",
        "_reported",
        "_running",
        "calls",
        "counts",
        "posted",
        "timing",
    )

    concurrent = False  # CallbackSource

    def __init__(
        self,
        context: NodeContext,
        what: str,
        info: Callable[..., Any],
        callback: EventCallback | None,
        width: int = 1,
    ) -> None:
        if callback is not None:
            takes(callback, (1,), "event")
            self.timing = context.watch.of(callback, f"the events of {what}")
        self.counts: list[int] = [0] * width
        self.posted = False
        self._context = context
        self.calls = 0
        self._info = info
        self._callback = callback
        self._reported: list[int] = [0] * width
        self._due = False
        self._running = False

    @property
    def is_wanted(self) -> bool:
        """Whether there is a callback."""
        return self._callback is not None

    def diagnostics(self) -> CallbackDiagnostics:
        """Return how long the callback takes; there must be one."""
        return self.timing.diagnostics(self.calls)

    def add(self, *changes: int) -> None:
        """Add to the counts, and call the callback soon."""
        if not any(changes):
            return
        for index, change in enumerate(changes):
            self.counts[index] += change
        loop = self._context.link.loop
        if self._callback is not None and not self._due and loop is not None:
            self._due = True
            loop.call_soon(self._context.mailbox.post, self)

    def stop(self) -> None:
        """Call the callback no more."""
        self._callback = None

    def has_work(self) -> bool:
        """CallbackSource: whether the counts have changed, and the callback does not run."""
        return self._due and not self._running

    def dispatch(self, share: Share) -> CallbackTask | None:
        """CallbackSource: call the callback."""
        del share  # one callback is never too much
        if self._running:
            return None
        self._due = False
        callback = self._callback
        if callback is None or self.counts == self._reported:
            return None
        pairs = [(now, now - before) for now, before in zip(self.counts, self._reported, strict=True)]
        self._reported = list(self.counts)
        self.calls += 1
        try:
            result = callback(self._info(*(number for pair in pairs for number in pair)))
        except ENDS_PROGRAM:
            raise
        except BaseException as error:  # noqa: BLE001 - the user's: logged, counted, the node lives on
            self._context.callback_failed(self.timing.what, error)
            return None
        coroutine = as_coroutine(result)
        if coroutine is None:
            return None
        self._running = True
        return CallbackTask(self._context.mailbox, coroutine, self._ended, self.timing)

    def _ended(self, result: object, error: BaseException | None) -> None:
        del result
        self._running = False
        if error is not None:
            self._context.callback_failed(self.timing.what, error)
        if self.has_work():
            self._context.mailbox.post(self)


class EndpointEvents:
    """Events that publishers and subscriptions have in common."""

    def __init__(
        self,
        context: NodeContext,
        what: str,
        callbacks: PublisherEventCallbacks | SubscriptionEventCallbacks,
    ) -> None:
        self._context = context
        self._log_incompatible = callbacks.use_default_callbacks
        self._last_policy = QoSPolicyKind.INVALID
        self._earlier_total = 0
        """Counterparts in earlier sessions."""
        self._total = self._current = 0
        self.deadline = Event(context, what, DeadlineMissedInfo, callbacks.deadline)
        self.matched = Event(context, what, MatchedInfo, callbacks.matched, 2)
        self.incompatible_qos = Event(context, what, self._qos_info, callbacks.incompatible_qos)
        self.incompatible_type = Event(context, what, IncompatibleTypeInfo, callbacks.incompatible_type)

    def _qos_info(self, total: int, change: int) -> IncompatibleQoSInfo:
        return IncompatibleQoSInfo(total, change, self._last_policy)

    def matched_now(self, peers: int, total: int) -> None:
        """Count the counterparts, given those of now and those of the session in all."""
        total += self._earlier_total
        if (peers, total) != (self._current, self._total):
            self.matched.add(total - self._total, peers - self._current)
            self._current, self._total = peers, total

    def session_ended(self) -> None:
        """Count every counterpart as gone."""
        self._earlier_total = self._total
        self.matched_now(0, 0)

    def notice(self, notice: frames.Notice) -> None:
        """Count incompatible counterparts, and log them unless there is a callback."""
        event = None
        if notice.kind == NoticeKind.INCOMPATIBLE_QOS:
            self._last_policy = _policy_kind(notice.policy)
            event = self.incompatible_qos
        elif notice.kind == NoticeKind.INCOMPATIBLE_TYPE:
            event = self.incompatible_type
        if event is not None:
            event.add(notice.peers)
        if event is None or (self._log_incompatible and not event.is_wanted):
            self._context.warn_of(notice)

    def diagnostics(self) -> tuple[CallbackDiagnostics, ...]:
        """Return how long each callback takes."""
        return tuple(event.diagnostics() for event in self.all() if event.is_wanted)

    def stop(self) -> None:
        """Call no callbacks any more: the endpoint has been destroyed."""
        for event in self.all():
            event.stop()

    def all(self) -> list[Event]:
        """Return all events, with and without a callback."""
        return [self.deadline, self.matched, self.incompatible_qos, self.incompatible_type]


class PublisherEvents(EndpointEvents):
    """The events of a publisher."""

    def __init__(self, context: NodeContext, topic: str, callbacks: PublisherEventCallbacks) -> None:
        what = f"the publisher on '{topic}'"
        super().__init__(context, what, callbacks)
        self.liveliness = Event(context, what, LivelinessLostInfo, callbacks.liveliness)

    def all(self) -> list[Event]:
        """EndpointEvents: return all events."""
        return [*super().all(), self.liveliness]


class SubscriptionEvents(EndpointEvents):
    """The events of a subscription."""

    def __init__(self, context: NodeContext, topic: str, callbacks: SubscriptionEventCallbacks) -> None:
        what = f"the subscription to '{topic}'"
        super().__init__(context, what, callbacks)
        self.liveliness = Event(context, what, LivelinessChangedInfo, callbacks.liveliness, 2)
        self.message_lost = Event(context, what, MessageLostInfo, callbacks.message_lost)

    def all(self) -> list[Event]:
        """EndpointEvents: return all events."""
        return [*super().all(), self.liveliness, self.message_lost]


def _policy_kind(number: int) -> QoSPolicyKind:
    """Return the policy of a NOTICE; a later broker may have more of them."""
    try:
        return QoSPolicyKind(number)
    except ValueError:
        return QoSPolicyKind.INVALID
