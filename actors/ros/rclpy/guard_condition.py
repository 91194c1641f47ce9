"""Guard conditions: callbacks that any thread may trigger."""

from __future__ import annotations

from typing import Any, TYPE_CHECKING, cast

from actors.ros.rclpy.destroyable import Handle
from actors.ros.rclpy.entity import Entity
from actors.ros.rclpy.imported_names import imported_names

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.ros.rclpy.context import Context

__getattr__ = imported_names(__name__, "CallbackGroup Context get_default_context")


class GuardHandle(Handle):
    """A handle by which the wait sets of waitables get guard conditions."""

    def __init__(self, guard: GuardCondition, *, is_valid: bool) -> None:
        super().__init__(is_valid=is_valid)
        self.guard = guard


class GuardCondition(Entity):
    """Runs a callback in the executor after `trigger`. Made by `Node.create_guard_condition`.

    Attributes:
        callback: The callback.
        watcher: The waitable that waits for it instead of a node.
    """

    def __init__(
        self,
        callback: Callable[[], Any] | None,
        callback_group: CallbackGroup | None,
        context: Context | None = None,
    ) -> None:
        # None in a waitable, which runs in its own group.
        super().__init__(cast("CallbackGroup", callback_group))
        self.callback = callback
        self.watcher: Entity | None = None
        self._triggered = False

    @property
    def handle(self) -> GuardHandle:
        """In place of rclpy's handle; waitables add it to wait sets."""
        return GuardHandle(self, is_valid=not self._is_destroyed)

    def trigger(self) -> None:
        """Run the callback soon, once for all triggers before that."""
        with self.handle:
            # Before it is queued: the executor may look at once.
            self._triggered = True
            self.notify()

    def notify(self) -> None:
        """Tell the executor, that of the watcher if there is one, that it was triggered."""
        if self.watcher is None:
            super().notify()
        else:
            self.watcher.notify()

    def has_work(self) -> bool:
        """Return whether it was triggered."""
        return self._triggered

    def take(self) -> Callable[[], Any] | None:
        """Return the callback if it was triggered."""
        return self.callback if self.consume_trigger() else None

    def consume_trigger(self) -> bool:
        """Return whether it was triggered since the last time."""
        # Cleared before the callback runs, so that a trigger during it leads to another call.
        triggered, self._triggered = self._triggered, False
        return triggered

    def destroy(self) -> None:
        """Run the callback no more."""
        super().destroy()
        self.callback = None
