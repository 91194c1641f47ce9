"""Lifecycle nodes of each side, managed from the other."""

from __future__ import annotations

import asyncio
import itertools
from typing import TYPE_CHECKING

from actors.interfaces.lifecycle_msgs.msg import State, Transition, TransitionEvent
from actors.interfaces.lifecycle_msgs.srv import (
    ChangeState,
    GetAvailableStates,
    GetAvailableTransitions,
    GetState,
)
from actors.lifecycle.node import LifecycleNode
from tests.ros2.graphs import endpoints_until

if TYPE_CHECKING:
    from tests.ros2.conftest import Pair


STEPS = {
    ("unconfigured", "configuring"),
    ("configuring", "inactive"),
    ("inactive", "activating"),
    ("activating", "active"),
    ("active", "deactivating"),
    ("deactivating", "inactive"),
}


def _steps(events: list[TransitionEvent]) -> list[tuple[str, str]]:
    return [(each.start_state.label, each.goal_state.label) for each in events]


async def test_verbs_manage_a_lifecycle_node_of_ros(pair: Pair) -> None:
    """`lifecycle set` changes its state, `get`, `list` and `nodes` show it, and its events arrive."""
    node = await pair.ros.lifecycle_node(f"{pair.name[1:]}_driver")
    events: list[TransitionEvent] = []
    pair.here.create_subscription(TransitionEvent, f"{node.name}/transition_event", events.append, 10)
    await endpoints_until(pair.here, "services", f"{node.name}/change_state", 1)
    process = pair.network.callboard("lifecycle", "set", node.name, "configure")
    assert await asyncio.to_thread(process.wait) == 0, process.output()
    assert "Transitioning successful" in process.output()
    verbs = ("get", node.name), ("list", node.name), ("nodes",)
    asking = [pair.network.callboard("lifecycle", *each) for each in verbs]
    for each, text in zip(asking, ("inactive [2]", "activate [3]", node.name), strict=True):
        assert await asyncio.to_thread(each.wait) == 0, each.output()
        assert text in each.output()
    change = pair.here.create_client(ChangeState, f"{node.name}/change_state")
    steps = itertools.cycle((Transition.TRANSITION_ACTIVATE, Transition.TRANSITION_DEACTIVATE))
    while not events:  # one is lost where DDS has not matched yet, as between nodes of ROS
        assert (await change.call(ChangeState.Request(transition=Transition(id=next(steps))))).success
    assert _steps(events)[0] in STEPS


async def test_clients_of_ros_manage_a_lifecycle_node_of_callboard(pair: Pair) -> None:
    """Its five services answer them, and its events arrive in ROS."""
    name = f"{pair.name}_motor"
    async with LifecycleNode(name[1:], url=pair.network.url):
        events = await pair.there.subscription(f"{name}/transition_event", TransitionEvent)
        await events.matched()
        await endpoints_until(pair.here, "subscriptions", f"{name}/transition_event", 1)
        change = await pair.there.client(f"{name}/change_state", ChangeState)
        configure = ChangeState.Request(transition=Transition(id=Transition.TRANSITION_CONFIGURE))
        assert (await change.call(configure)).success
        assert not (await change.call(configure)).success  # it is inactive now
        state = await (await pair.there.client(f"{name}/get_state", GetState)).call(GetState.Request())
        assert state.current_state == State(id=State.PRIMARY_STATE_INACTIVE, label="inactive")
        states = await pair.there.client(f"{name}/get_available_states", GetAvailableStates)
        found = await states.call(GetAvailableStates.Request())
        assert {"unconfigured", "inactive", "active", "finalized"} <= {
            each.label for each in found.available_states
        }
        for service, least in (("get_available_transitions", 3), ("get_transition_graph", 20)):
            client = await pair.there.client(f"{name}/{service}", GetAvailableTransitions)
            answer = await client.call(GetAvailableTransitions.Request())
            assert len(answer.available_transitions) >= least
        assert _steps(await events.received(2))[:2] == [
            ("unconfigured", "configuring"),
            ("configuring", "inactive"),
        ]
