"""Waitables: entities that programs define, which wait for guard conditions."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, Literal, TypeVar

from actors.ros.rclpy.entity import Entity

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.ros.rclpy.guard_condition import GuardCondition

T = TypeVar("T")


@dataclass(init=False, slots=True)
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


class WaitSet:
    """The guard conditions that a waitable waits for, and which of them were triggered.

    Args:
        waitable: The waitable.
    """

    def __init__(self, waitable: Waitable[Any]) -> None:
        self._waitable = waitable
        self._guards: list[GuardCondition] = []
        self._triggered: list[bool] = []

    def add_guard_condition(self, guard_condition: GuardCondition) -> int:
        """Wait for a guard condition that is not the node's; return its index."""
        # A trigger then queues the waitable, and not the guard condition, which has no callback group of
        # its own here.
        guard_condition.watcher = self._waitable
        self._guards.append(guard_condition)
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


class Waitable(Entity, Generic[T]):
    """An entity that programs define: override `add_to_wait_set`, `is_ready`, `take_data` and `execute`.

    After a trigger of one of its guard conditions, and after each `execute`, the executor calls
    `add_to_wait_set` and `is_ready`, then `take_data` and `execute` if it is ready.

    Args:
        callback_group: When `execute` may run.
    """

    def __init__(self, callback_group: CallbackGroup) -> None:
        super().__init__(callback_group)
        callback_group.add_entity(self)
        self._wait_set: WaitSet | None = None

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

    def has_work(self) -> bool:
        """Return whether the executor should call `take`."""
        # Once at the start: it may be ready before any trigger.
        return self._wait_set is None or self._wait_set.has_trigger()

    def take(self) -> Callable[[], Any] | None:
        """Return the next call of `execute`, if it is ready."""
        # A new one each time, as rclpy's executors make one for each wait; programs may add other
        # conditions each time.
        wait_set = self._wait_set = WaitSet(self)
        self.add_to_wait_set(wait_set)
        wait_set.collect()
        return partial(self._execute, self.take_data()) if self.is_ready(wait_set) else None

    async def _execute(self, taken_data: T) -> None:
        await self.execute(taken_data)
        # It may be ready again without a trigger, for example if it handles one item of several.
        self.notify()

    def detach(self) -> None:
        """Stop running when it is removed."""
        self._node = None
