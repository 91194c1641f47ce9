"""Waitables that programs define."""

from __future__ import annotations

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.guard_condition import GuardCondition
from rclpy.waitable import NumberOfEntities, Waitable

from tests.real_ros.programs.running import running_node, spin_until


class _Waitable(Waitable):
    """Waits for a guard condition of its own, and has the attributes that programs like to use."""

    def __init__(self, node, hand_over):
        super().__init__(ReentrantCallbackGroup())
        self.node = self._node = node
        self.executor = self._wait_set = self.queued_in = self.work = None
        self.guard = GuardCondition(callback=None, callback_group=None, context=node.context)
        self.guard_index = None
        self.guard_is_ready = False
        self.executed = []
        self._hand_over = hand_over

    def __enter__(self):
        pass

    def __exit__(self, *exception):
        pass

    def is_ready(self, wait_set):
        self.guard_is_ready = self.guard_is_ready or wait_set.is_ready("guard_condition", self.guard_index)
        return self.guard_is_ready

    def take_data(self):
        taken, self.guard_is_ready = self.guard_is_ready, False
        return taken

    async def execute(self, taken_data):
        self.executed.append(taken_data)

    def get_num_entities(self):
        return NumberOfEntities(num_gcs=1)

    def add_to_wait_set(self, wait_set):
        self.guard_index = wait_set.add_guard_condition(self._hand_over(self.guard))


def _executed(hand_over):
    with running_node() as node:
        waitable = _Waitable(node, hand_over)
        node.add_waitable(waitable)
        listed = waitable in [*node.waitables]
        executed = []
        for count in (1, 2):
            waitable.guard.trigger()
            spin_until(node, lambda: len(waitable.executed) == count)  # noqa: B023
            executed.append([*waitable.executed])
        has = waitable.callback_group.has_entity(waitable)
        node.remove_waitable(waitable)
        return [listed, executed, has, waitable in [*node.waitables], waitable.node is node]


def guard_condition_by_its_handle():
    """Hand the handle of a guard condition to the wait set."""
    return _executed(lambda guard: guard.handle)


def entities_of_a_waitable():
    """Add numbers of entities."""
    total = NumberOfEntities(1, 2, 3, 4, 5, 6) + NumberOfEntities(num_gcs=1)
    total += NumberOfEntities(num_subs=1)
    return [total.num_subscriptions, total.num_guard_conditions, total.num_events, str(total)]
