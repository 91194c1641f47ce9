"""Publishes what happens to a supervisor's children: to the log, the watchers and the topic."""

from __future__ import annotations

import weakref
from typing import TYPE_CHECKING, Final

from actors.errors import error_text
from actors.logging.logger import get_logger
from actors.processes.child_events import (
    ChildEvent,
    ChildEventKind,
    ChildEventMessage,
    ChildEvents,
    message_of,
)
from actors.qos.profile import DurabilityPolicy, QoSProfile
from proto.errors import CallboardError

if TYPE_CHECKING:
    from actors.logging.logger import Logger
    from actors.node.node import Node

TOPIC: Final = "~/child_events"

LATCHED_EVENTS: Final = 100
"""Events that a late subscriber still gets."""

_WARN_EVERY_SEC: Final = 1.0


class EventPublisher:
    """Publishes events of a supervisor's children.

    Args:
        name: The supervisor's name.
        node: Publishes the events on `TOPIC`; None: they are not published there.

    Attributes:
        lost: Events that could not be published; each is logged, at most one a second.
    """

    def __init__(self, name: str, node: Node | None) -> None:
        self.lost = 0
        self._log: Logger = get_logger(name)
        self._watchers: weakref.WeakSet[ChildEvents] = weakref.WeakSet()
        latched = QoSProfile(depth=LATCHED_EVENTS, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._publisher = None if node is None else node.create_publisher(ChildEventMessage, TOPIC, latched)

    def watcher(self, *, ended: bool) -> ChildEvents:
        """Return a new watcher, to which only a weak reference is kept."""
        watcher = ChildEvents(ended=ended)
        self._watchers.add(watcher)
        return watcher

    def notify(self, event: ChildEvent) -> None:
        """Log an event, and give it to the watchers and the topic."""
        self._write(event)
        for watcher in tuple(self._watchers):
            watcher.put(event)
        self._publish(event)

    def end(self) -> None:
        """End all watchers: there are no more events."""
        for watcher in tuple(self._watchers):
            watcher.end()

    def _publish(self, event: ChildEvent) -> None:
        publisher = self._publisher
        if publisher is None or publisher.destroyed:
            return
        try:
            publisher.publish(message_of(event))
        except Exception as error:  # noqa: BLE001 - supervision goes on without events
            self.lost += 1
            self._log.error(
                f"Lost child event number {self.lost}, it cannot be published: {error_text(error)}",
                throttle_duration_sec=_WARN_EVERY_SEC,
                exc_info=error,
            )

    def _write(self, event: ChildEvent) -> None:
        who, outcome = f"Child '{event.child}'", event.outcome
        match event.kind:
            case ChildEventKind.STARTED:
                self._log.info(f"{who} started" + (f" with pid {event.pid}" if event.pid else ""))
            case ChildEventKind.ENDED if outcome is not None and not outcome.normal:
                # An exit has a code, and needs no traceback, as does an error whose remedy is elsewhere.
                error = outcome.error if isinstance(outcome.error, Exception) else None
                if isinstance(error, CallboardError) and error.is_operational:
                    error = None
                self._log.error(f"{who} died: {event.reason}", exc_info=error)
            case ChildEventKind.ENDED:
                self._log.info(f"{who} ended: {event.reason}")
            case ChildEventKind.RESTARTING:
                self._log.warning(f"{who} will be started again in {event.delay_sec:.1f} s")
            case ChildEventKind.GIVEN_UP:
                self._log.error(f"{who} has died too often")
