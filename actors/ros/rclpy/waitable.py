"""Waitables: entities that programs define, which wait for guard conditions."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar

from actors.ros.rclpy.entity import Entity
from actors.ros.rclpy.guard_condition import GuardHandle

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.ros.rclpy.callback_groups import CallbackGroup
    from types import TracebackType

    from actors.ros.rclpy.guard_condition import GuardCondition
    from actors.ros.rclpy.task import Future

T = TypeVar("T")


@dataclass(init=False, repr=False, slots=True)
class NumberOfEntities:
    """Numbers of the entities that a waitable has, by kind."""

    num_subscriptions: int
    num_guard_conditions: int
    num_timers: int
    num_clients: int
    num_services: int
    num_events: int

    def __init__(
        self,
        num_subs: int = 0,
        num_gcs: int = 0,
        num_timers: int = 0,
        num_clients: int = 0,
        num_services: int = 0,
        num_events: int = 0,
    ) -> None:
        self.num_subscriptions, self.num_guard_conditions, self.num_timers = num_subs, num_gcs, num_timers
        self.num_clients, self.num_services, self.num_events = num_clients, num_services, num_events

    def __add__(self, other: NumberOfEntities) -> NumberOfEntities:
        names = (each.name for each in fields(self))
        return NumberOfEntities(*(getattr(self, name) + getattr(other, name) for name in names))

    __iadd__ = __add__

    def __repr__(self) -> str:
        numbers = ", ".join(str(getattr(self, each.name)) for each in fields(self))
        return f"<NumberOfEntities({numbers})>"


class WaitSet:
    """The guard conditions that a waitable waits for, and which of them were triggered.

    Args:
        entity: The entity of the waitable.
    """

    def __init__(self, entity: Entity) -> None:
        self._entity = entity
        self._guards: list[GuardCondition] = []
        self._triggered: list[bool] = []

    def add_guard_condition(self, guard_condition: GuardHandle | GuardCondition) -> int:
        """Wait for a guard condition that is not the node's, given by its handle; return its index."""
        guard = guard_condition.guard if isinstance(guard_condition, GuardHandle) else guard_condition
        # A trigger then queues the waitable, and not the guard condition, which has no callback group of
        # its own here.
        guard.watcher = self._entity
        self._guards.append(guard)
        return len(self._guards) - 1

    def collect(self) -> None:
        """Consume the triggers: until then `is_ready` is false."""
        self._triggered = [each.consume_trigger() for each in self._guards]

    def has_trigger(self) -> bool:
        """Return whether a guard condition was triggered since `collect`."""
        return any(each.has_work() for each in self._guards)

    def is_ready(self, entity_type: Literal["guard_condition"], index: int) -> bool:
        """Return whether a guard condition was triggered before `collect`."""
        if entity_type != "guard_condition":
            raise ValueError(f"callboard's wait set has guard conditions only, and no '{entity_type}'")
        return self._triggered[index]


class Waitable(Generic[T]):
    """Something with work: programs override `add_to_wait_set`, `is_ready`, `take_data` and `execute`.

    After a trigger of one of its guard conditions, and after each `execute`, the executor calls
    `add_to_wait_set` and `is_ready`, then `take_data` and `execute` if it is ready.

    Args:
        callback_group: When `execute` may run.
    """

    def __init__(self, callback_group: CallbackGroup) -> None:
        self.callback_group = callback_group
        callback_group.add_entity(self)

    def __enter__(self) -> None:
        """Called by rclpy's executors; not by callboard's."""
        raise NotImplementedError("Must be implemented by subclass")

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc_val: BaseException | None,
        exc_tb: TracebackType | None,
    ) -> None:
        """Called by rclpy's executors; not by callboard's."""
        raise NotImplementedError("Must be implemented by subclass")

    def add_future(self, future: Future[Any]) -> None:
        """Do nothing: a future that `execute` completes calls its callbacks there."""

    def remove_future(self, future: Future[Any]) -> None:
        """Do nothing; see `add_future`."""

    def is_ready(self, wait_set: WaitSet) -> bool:
        """Return whether there is something to execute."""
        raise NotImplementedError("Must be implemented by subclass")

    def take_data(self) -> T:
        """Return what `execute` gets."""
        raise NotImplementedError("Must be implemented by subclass")

    async def execute(self, taken_data: T) -> None:
        """Do the work."""
        raise NotImplementedError("Must be implemented by subclass")

    def get_num_entities(self) -> NumberOfEntities:
        """Return how many entities it has; callboard does not ask."""
        raise NotImplementedError("Must be implemented by subclass")

    def add_to_wait_set(self, wait_set: WaitSet) -> None:
        """Add its guard conditions to a wait set, and keep their indices for `is_ready`."""
        raise NotImplementedError("Must be implemented by subclass")


class WaitableEntity(Entity):
    """Runs a waitable. An object of its own: programs give theirs any attributes, such as `node`.

    Args:
        waitable: The waitable.

    Attributes:
        waitable: The waitable.
    """

    def __init__(self, waitable: Waitable[Any]) -> None:
        super().__init__(waitable.callback_group)
        self.waitable = waitable
        self._wait_set: WaitSet | None = None

    def has_work(self) -> bool:
        """Return whether the executor should call `take`."""
        # Once at the start: it may be ready before any trigger.
        return self._wait_set is None or self._wait_set.has_trigger()

    def take(self) -> Callable[[], Any] | None:
        """Return the next call of `execute`, if it is ready."""
        # A new one each time, as rclpy's executors make one for each wait; programs may add other
        # conditions each time.
        wait_set = self._wait_set = WaitSet(self)
        self.waitable.add_to_wait_set(wait_set)
        wait_set.collect()
        if not self.waitable.is_ready(wait_set):
            return None
        return partial(self._execute, self.waitable.take_data())

    async def _execute(self, taken_data: Any) -> None:
        await self.waitable.execute(taken_data)
        # It may be ready again without a trigger, for example if it handles one item of several.
        self.notify()

    def detach(self) -> None:
        """Stop running when it is removed."""
        self._node = None
