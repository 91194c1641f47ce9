"""QoS events. Their callbacks run where the executor spins."""

from __future__ import annotations

import threading
from dataclasses import fields
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

from actors.endpoints.events import DeadlineMissedInfo as QoSOfferedDeadlineMissedInfo
from actors.endpoints.events import DeadlineMissedInfo as QoSRequestedDeadlineMissedInfo
from actors.endpoints.events import IncompatibleQoSInfo as QoSOfferedIncompatibleQoSInfo
from actors.endpoints.events import IncompatibleQoSInfo as QoSRequestedIncompatibleQoSInfo
from actors.endpoints.events import IncompatibleTypeInfo as IncompatibleTypeInfo
from actors.endpoints.events import LivelinessChangedInfo as QoSLivelinessChangedInfo
from actors.endpoints.events import LivelinessLostInfo as QoSLivelinessLostInfo
from actors.endpoints.events import MatchedInfo as QoSPublisherMatchedInfo
from actors.endpoints.events import MatchedInfo as QoSSubscriptionMatchedInfo
from actors.endpoints.events import MessageLostInfo as QoSMessageLostInfo
from actors.endpoints.events import PublisherEventCallbacks as PublisherEventCallbacks
from actors.endpoints.events import SubscriptionEventCallbacks as SubscriptionEventCallbacks
from actors.ros.rclpy.queued_calls import QueuedCalls

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = [
    "QoSLivelinessChangedInfo",
    "QoSLivelinessLostInfo",
    "QoSMessageLostInfo",
    "QoSOfferedDeadlineMissedInfo",
    "QoSOfferedIncompatibleQoSInfo",
    "QoSPublisherMatchedInfo",
    "QoSRequestedDeadlineMissedInfo",
    "QoSRequestedIncompatibleQoSInfo",
    "QoSSubscriptionMatchedInfo",
]


class UnsupportedEventTypeError(Exception):
    """rclpy raises this where the middleware lacks an event; callboard has all of them."""


CallbacksT = TypeVar("CallbacksT", PublisherEventCallbacks, SubscriptionEventCallbacks)


class EventCalls(QueuedCalls):
    """Calls of the event callbacks of one publisher or subscription. At most one of each kind waits."""

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self._lock = threading.Lock()
        self._pending: dict[str, Any] = {}

    def queued(self, callbacks: CallbacksT) -> CallbacksT:
        """Return callbacks for callboard, which let the executor make the calls."""
        given = {field.name: getattr(callbacks, field.name) for field in fields(callbacks)}
        made: dict[str, Any] = {
            name: partial(self._happened, name, value) if callable(value) else value
            for name, value in given.items()
        }
        return type(callbacks)(**made)

    def _happened(self, kind: str, callback: Callable[[Any], Any], info: Any) -> None:
        with self._lock:
            earlier = self._pending.get(kind)
            self._pending[kind] = info if earlier is None else _together(earlier, info)
        if earlier is None:
            self.enqueue(partial(self._call, kind, callback))

    def _call(self, kind: str, callback: Callable[[Any], Any]) -> Any:
        with self._lock:
            info = self._pending.pop(kind)
        return callback(info)

    def destroy(self) -> None:
        """Do nothing: the events end with the endpoint."""


def _together(earlier: Any, later: Any) -> Any:
    """Return the later counts, with the changes since before the earlier ones."""
    changes = {
        name: getattr(earlier, name) + getattr(later, name)
        for name in later._fields
        if name.endswith("_change")
    }
    return later._replace(**changes)
