"""Which callbacks of a node may run at the same time."""

from __future__ import annotations

import threading
import weakref
from typing import Protocol


class RefusedQueue(Protocol):
    """The work of an executor that a group has refused."""

    def wake(self) -> None:
        """Look at it again, as a callback has ended."""
        ...


class CallbackGroup:
    """Base of callback groups: an executor asks before it runs a callback. Subclasses decide."""

    def __init__(self) -> None:
        super().__init__()
        # Weak, as in rclpy: a group that a program keeps must not keep what was made with it.
        self.entities: set[weakref.ref[object]] = set()
        self.refused_in: set[RefusedQueue] = set()
        """The queues of executors to wake when a callback ends."""

    def add_entity(self, entity: object) -> None:
        """Add a subscription, timer, client, service, guard condition or waitable."""
        self.entities.add(weakref.ref(entity, self.entities.discard))

    def has_entity(self, entity: object) -> bool:
        """Return whether it has been added."""
        return weakref.ref(entity) in self.entities

    def can_execute(self, entity: object) -> bool:
        """Return whether a callback of the entity may run now."""
        raise NotImplementedError

    def beginning_execution(self, entity: object) -> bool:
        """Return whether a callback of the entity may run; if so, `ending_execution` is called after it."""
        raise NotImplementedError

    def ending_execution(self, entity: object) -> None:
        """Note that a callback of the entity has ended."""
        raise NotImplementedError


class ReentrantCallbackGroup(CallbackGroup):
    """Callbacks run at the same time as each other."""

    def can_execute(self, entity: object) -> bool:
        """Return True."""
        return True

    def beginning_execution(self, entity: object) -> bool:
        """Return True."""
        return True

    def ending_execution(self, entity: object) -> None:
        """Do nothing."""


class MutuallyExclusiveCallbackGroup(CallbackGroup):
    """Callbacks run one at a time."""

    def __init__(self) -> None:
        super().__init__()
        self._active: object | None = None
        self._lock = threading.Lock()

    def can_execute(self, entity: object) -> bool:
        """Return whether none runs."""
        # Without the lock: only a hint, and `beginning_execution` decides.
        return self._active is None

    def beginning_execution(self, entity: object) -> bool:
        """Begin, and return True, if none runs."""
        with self._lock:
            if self._active is None:
                self._active = entity
                return True
        return False

    def ending_execution(self, entity: object) -> None:
        """Let the next one run."""
        with self._lock:
            assert self._active is entity
            self._active = None
