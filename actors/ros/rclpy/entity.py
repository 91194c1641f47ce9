"""Entities, which have work from time to time; executors run it."""

from __future__ import annotations

import inspect
import weakref
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Protocol, cast

from actors.ros.rclpy.destroyable import Destroyable
from actors.ros.rclpy.task import FutureExecutor
from actors.threads.errors import ThreadStopped

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import MethodType

    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.threads.node_thread import NodeThread


class EntityQueue(Protocol):
    """The part of an executor's work queue that entities use."""

    def add(self, entity: Entity, /) -> None:
        """Run work of an entity soon; in any thread."""
        ...

    def timers_changed(self) -> None:
        """Look again at when timers are due."""
        ...


class EntityExecutor(FutureExecutor, Protocol):
    """The part of an executor that entities use."""

    @property
    def work(self) -> EntityQueue:
        """The queue of its work."""
        ...


class EntityNode(Protocol):
    """The part of a node that its entities use. A protocol, because nodes import this module."""

    @property
    def active_executor(self) -> EntityExecutor | None:
        """The executor that runs the callbacks of the node."""
        ...

    def remove_waitable(self, waitable: Any, /) -> None:
        """Run the callbacks of a waitable no more."""
        ...


class Entity(Destroyable):
    """A subscription, timer, client, service, guard condition or waitable of a node.

    Attributes:
        callback_group: Decides when its callbacks may run.
        queued_in: The queue in which it is, or None.
    """

    callback_group: CallbackGroup

    def __init__(self, callback_group: CallbackGroup) -> None:
        self.callback_group = callback_group
        self.queued_in: EntityQueue | None = None
        # Weak: nodes refer to their entities, and programs expect a node to be freed with its last
        # reference.
        self._node: weakref.ref[EntityNode] | None = None

    def attach(self, node: EntityNode) -> None:
        """Make it an entity of a node, whose executor runs it."""
        self._node = weakref.ref(node)
        self.callback_group.add_entity(self)
        self.notify()

    def detach(self) -> None:
        """Do nothing when it is removed: what it has begun is finished in the executor."""

    @property
    def node(self) -> EntityNode | None:
        """The node."""
        return None if self._node is None else self._node()

    @property
    def active_executor(self) -> EntityExecutor | None:
        """The executor that runs the callbacks of the node."""
        node = self.node
        return None if node is None else node.active_executor

    def notify(self) -> None:
        """Tell the executor that there may be work; in any thread."""
        executor = self.active_executor
        # Without a lock. Two threads may both get through, and the entity is then twice in the queue: the
        # second time it has no work, which costs a look.
        if executor is not None and self.queued_in is not executor.work:
            executor.work.add(self)

    def has_work(self) -> bool:
        """Return whether `take` would return something; called in any thread."""
        raise NotImplementedError

    def take(self) -> Callable[[], Any] | None:
        """Return the next piece of work, and remove it, or None. Called by the executor."""
        raise NotImplementedError


def destroy_with(entity: Entity, thread: NodeThread, destroy: Callable[[], object]) -> None:
    """Take callboard's endpoint out of service when its entity has no references any more.

    Its node may stay: a client that a program keeps needs it.
    """
    # Not at exit: the context ends then.
    weakref.finalize(entity, _destroy_soon, thread, destroy).atexit = False


def _destroy_soon(thread: NodeThread, destroy: Callable[[], object]) -> None:
    with suppress(ThreadStopped):
        thread.post(destroy)


def weakly(method: Callable[..., Any]) -> Any:
    """Return a function that calls a method without keeping its object; it returns None if that is gone.

    For callboard's node, which its thread holds: it would keep an entity, whose callback is often a method
    of the node of ROS 2, and so that node.

    Args:
        method: A bound method; the function is a coroutine function if it is one.
    """
    bound = cast("MethodType", method)
    function, owner = bound.__func__, weakref.ref(bound.__self__)

    def call(*args: Any) -> Any:
        alive = owner()
        return None if alive is None else function(alive, *args)

    async def call_async(*args: Any) -> Any:
        alive = owner()
        return None if alive is None else await function(alive, *args)

    made: Any = call_async if inspect.iscoroutinefunction(method) else call
    made.__qualname__, made.__signature__ = bound.__qualname__, inspect.signature(method)
    return made
