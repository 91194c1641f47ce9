"""QoS events. Their callbacks run where the executor spins."""

from __future__ import annotations

import threading
from dataclasses import dataclass, fields
from enum import IntEnum
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

from actors.endpoints import events as native
from actors.endpoints.events import DeadlineMissedInfo
from actors.endpoints.events import IncompatibleQoSInfo
from actors.endpoints.events import IncompatibleTypeInfo as IncompatibleTypeInfo
from actors.endpoints.events import LivelinessChangedInfo
from actors.endpoints.events import LivelinessLostInfo
from actors.endpoints.events import MatchedInfo
from actors.endpoints.events import MessageLostInfo
from actors.ros.rclpy.entity import weakly
from actors.ros.rclpy.queued_calls import QueuedCalls
from actors.ros.rclpy.imported_names import imported_names

if TYPE_CHECKING:
    from collections.abc import Callable

QoSLivelinessChangedInfo: TypeAlias = LivelinessChangedInfo
QoSLivelinessLostInfo: TypeAlias = LivelinessLostInfo
QoSMessageLostInfo: TypeAlias = MessageLostInfo
QoSOfferedDeadlineMissedInfo: TypeAlias = DeadlineMissedInfo
QoSOfferedIncompatibleQoSInfo: TypeAlias = IncompatibleQoSInfo
QoSPublisherMatchedInfo: TypeAlias = MatchedInfo
QoSRequestedDeadlineMissedInfo: TypeAlias = DeadlineMissedInfo
QoSRequestedIncompatibleQoSInfo: TypeAlias = IncompatibleQoSInfo
QoSSubscriptionMatchedInfo: TypeAlias = MatchedInfo

__getattr__ = imported_names(__name__, "CallbackGroup NumberOfEntities Waitable get_logger")


class QoSPublisherEventType(IntEnum):
    """The events of a publisher. callboard uses them nowhere: programs name them."""

    RCL_PUBLISHER_OFFERED_DEADLINE_MISSED = 0
    RCL_PUBLISHER_LIVELINESS_LOST = 1
    RCL_PUBLISHER_OFFERED_INCOMPATIBLE_QOS = 2
    RCL_PUBLISHER_INCOMPATIBLE_TYPE = 3
    RCL_PUBLISHER_MATCHED = 4


class QoSSubscriptionEventType(IntEnum):
    """The events of a subscription, for the same purpose."""

    RCL_SUBSCRIPTION_REQUESTED_DEADLINE_MISSED = 0
    RCL_SUBSCRIPTION_LIVELINESS_CHANGED = 1
    RCL_SUBSCRIPTION_REQUESTED_INCOMPATIBLE_QOS = 2
    RCL_SUBSCRIPTION_MESSAGE_LOST = 3
    RCL_SUBSCRIPTION_INCOMPATIBLE_TYPE = 4
    RCL_SUBSCRIPTION_MATCHED = 5


class UnsupportedEventTypeError(Exception):
    """rclpy raises this where the middleware lacks an event; callboard has all of them."""


@dataclass(kw_only=True)
class PublisherEventCallbacks:
    """Callbacks for the events of a publisher, as callboard's; they may be assigned until it is made."""

    deadline: Callable[[Any], Any] | None = None
    liveliness: Callable[[Any], Any] | None = None
    incompatible_qos: Callable[[Any], Any] | None = None
    incompatible_type: Callable[[Any], Any] | None = None
    matched: Callable[[Any], Any] | None = None
    use_default_callbacks: bool = True

    native_class = native.PublisherEventCallbacks


@dataclass(kw_only=True)
class SubscriptionEventCallbacks:
    """Callbacks for the events of a subscription, as callboard's; they may be assigned until it is made."""

    deadline: Callable[[Any], Any] | None = None
    liveliness: Callable[[Any], Any] | None = None
    incompatible_qos: Callable[[Any], Any] | None = None
    incompatible_type: Callable[[Any], Any] | None = None
    matched: Callable[[Any], Any] | None = None
    message_lost: Callable[[Any], Any] | None = None
    use_default_callbacks: bool = True

    native_class = native.SubscriptionEventCallbacks


class EventCalls(QueuedCalls):
    """Calls of the event callbacks of one publisher or subscription. At most one of each kind waits."""

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        # Events happen in the loop, and their calls are made where the executor spins.
        self._lock = threading.Lock()
        self._callbacks: dict[str, Callable[[Any], Any]] = {}
        self._pending: dict[str, Any] = {}

    def queued(self, callbacks: PublisherEventCallbacks | SubscriptionEventCallbacks) -> Any:
        """Return callboard's callbacks of the same events, which let the executor make the calls."""
        given = {field.name: getattr(callbacks, field.name) for field in fields(callbacks)}
        self._callbacks = {name: value for name, value in given.items() if callable(value)}
        happened = weakly(self._happened)
        # Values that are no callbacks, such as `use_default_callbacks`, pass through.
        made: dict[str, Any] = {
            name: partial(happened, name) if name in self._callbacks else value
            for name, value in given.items()
        }
        return callbacks.native_class(**made)

    def _happened(self, kind: str, info: Any) -> None:
        with self._lock:
            earlier = self._pending.get(kind)
            # Merged: events that come faster than they are handled do not fill the queue, and no count is
            # lost.
            self._pending[kind] = info if earlier is None else _merged(earlier, info)
        if earlier is None:
            self.enqueue(partial(self._call, kind))

    def _call(self, kind: str) -> Any:
        with self._lock:
            info = self._pending.pop(kind)
        return self._callbacks[kind](info)


def _merged(earlier: Any, later: Any) -> Any:
    """Return one event for two: the later counts, and the sums of the changes."""
    changes = {
        name: getattr(earlier, name) + getattr(later, name)
        for name in later._fields
        if name.endswith("_change")
    }
    return later._replace(**changes)
