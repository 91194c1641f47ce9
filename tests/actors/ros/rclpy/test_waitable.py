"""Waitables of users, which wait for guard conditions."""

from __future__ import annotations

import threading
from collections import deque
from typing import TYPE_CHECKING

import pytest

from actors.ros.rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from actors.ros.rclpy.executors import SingleThreadedExecutor
from actors.ros.rclpy.guard_condition import GuardCondition
from actors.ros.rclpy.node import Node
from actors.ros.rclpy.task import Future
from actors.ros.rclpy.waitable import NumberOfEntities, Waitable, WaitableEntity, WaitSet

if TYPE_CHECKING:
    from actors.ros.rclpy.context import Context

DEADLINE_SEC = 20.0


class Inbox(Waitable[str]):
    """Executes texts that any thread has put into it."""

    def __init__(self, wanted: int) -> None:
        super().__init__(MutuallyExclusiveCallbackGroup())
        self.guard = GuardCondition(None, self.callback_group)
        self.index = -1
        self.texts = deque[str]()
        self.executed = list[str]()
        self.wanted = wanted
        self.done = Future[None]()

    def put(self, *texts: str) -> None:
        self.texts.extend(texts)
        self.guard.trigger()

    def add_to_wait_set(self, wait_set: WaitSet) -> None:
        self.index = wait_set.add_guard_condition(self.guard)

    def is_ready(self, wait_set: WaitSet) -> bool:
        return wait_set.is_ready("guard_condition", self.index) or bool(self.texts)

    def take_data(self) -> str:
        return self.texts.popleft()

    async def execute(self, taken_data: str) -> None:
        self.executed.append(taken_data)
        if len(self.executed) == self.wanted:
            self.done.set_result(None)


def test_triggers_wake_a_waitable(context: Context) -> None:
    """What is put in before and while the executor spins is executed, one at a time and in order."""
    node = Node("node", context=context)
    inbox = Inbox(wanted=4)
    inbox.put("0", "1")
    node.add_waitable(inbox)
    assert inbox in node.waitables
    with SingleThreadedExecutor(context=context) as executor:
        executor.add_node(node)
        executor.spin_once(DEADLINE_SEC)
        assert inbox.executed == ["0"]
        spinning = threading.Thread(
            target=executor.spin_until_future_complete, args=(inbox.done, DEADLINE_SEC)
        )
        spinning.start()
        inbox.put("2", "3")
        spinning.join()
        assert inbox.executed == ["0", "1", "2", "3"]
        node.remove_waitable(inbox)
        inbox.put("4")
        executor.spin_once(0)
    assert len(inbox.executed) == 4


def test_a_waitable_that_is_not_ready_waits(context: Context) -> None:
    """A trigger that `is_ready` does not want is used up; nothing is executed."""

    class Deaf(Inbox):
        def is_ready(self, wait_set: WaitSet) -> bool:
            super().is_ready(wait_set)
            return False

    node = Node("node", context=context)
    deaf = Deaf(wanted=1)
    node.add_waitable(deaf)
    with SingleThreadedExecutor(context=context) as executor:
        executor.add_node(node)
        deaf.put("x")
        executor.spin_once(0)
        deaf.put("y")
        executor.spin_once(0)
    assert deaf.executed == []


def test_only_guard_conditions_can_be_awaited() -> None:
    """A wait set that is asked for another kind says what it has."""
    with pytest.raises(ValueError, match="guard conditions only, and no 'timer'"):
        WaitSet(WaitableEntity(Inbox(1))).is_ready("timer", 0)  # type: ignore[arg-type]


async def test_every_method_must_be_overridden() -> None:
    """The base class names what its user forgot."""
    waitable = Waitable[str](MutuallyExclusiveCallbackGroup())
    wait_set = WaitSet(WaitableEntity(waitable))
    for call in (
        lambda: waitable.add_to_wait_set(wait_set),
        lambda: waitable.is_ready(wait_set),
        waitable.take_data,
        waitable.get_num_entities,
    ):
        with pytest.raises(NotImplementedError, match="by subclass"):
            call()
    with pytest.raises(NotImplementedError, match="by subclass"):
        await waitable.execute("x")


def test_numbers_of_entities_add_up() -> None:
    """Sums are made kind by kind."""
    total = NumberOfEntities(1, 2, 3) + NumberOfEntities(num_gcs=1, num_events=6)
    assert total == NumberOfEntities(1, 3, 3, 0, 0, 6)
    total += NumberOfEntities(num_subs=1)
    assert (total.num_subscriptions, total.num_guard_conditions) == (2, 3)
