"""Lifecycle nodes of ROS 2 programs: callbacks, managed entities, and what other nodes see of them."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.lifecycle_msgs.msg import TransitionEvent
from actors.interfaces.lifecycle_msgs.srv import ChangeState, GetAvailableTransitions, GetState
from actors.interfaces.std_msgs.msg import String
from actors.ros.rclpy.executors import SingleThreadedExecutor
from actors.ros.rclpy.lifecycle import (
    LifecycleNode,
    LifecycleNodeMixin,
    ManagedEntity,
    SimpleManagedEntity,
    State,
    TransitionCallbackReturn,
)
from actors.ros.rclpy.node import Node
from tests.seams.ros import lifecycle_state

if TYPE_CHECKING:
    from actors.ros.rclpy.context import Context

SUCCESS, FAILURE, ERROR = TransitionCallbackReturn
DEADLINE_SEC = 20.0


class Managed(LifecycleNode):
    """Returns what the test wants."""

    def __init__(self, context: Context, **options: Any) -> None:
        super().__init__("managed", context=context, **options)
        self.calls: list[tuple[str, str]] = []
        self.results: dict[str, Any] = {}

    def _result(self, name: str, state: State) -> TransitionCallbackReturn:
        self.calls.append((name, state.label))
        result = self.results.get(name, SUCCESS)
        if isinstance(result, BaseException):
            raise result
        return result  # type: ignore[no-any-return]

    def on_configure(self, state: State) -> TransitionCallbackReturn:
        return self._result("configure", state)

    def on_cleanup(self, state: State) -> TransitionCallbackReturn:
        return self._result("cleanup", state)

    def on_error(self, state: State) -> TransitionCallbackReturn:
        return self._result("error", state)


def test_callbacks_decide_the_next_state(context: Context) -> None:
    """Success, failure, error, an exception and a wrong result lead where ROS 2's state machine says."""
    node = Managed(context, enable_communication_interface=False)
    for result, returned, label in (
        (SUCCESS, SUCCESS, "inactive"),
        (FAILURE, FAILURE, "unconfigured"),
        (ERROR, ERROR, "unconfigured"),
        (ValueError("broken"), ERROR, "unconfigured"),
        (None, ERROR, "unconfigured"),
    ):
        node.results = {"configure": result} if result is not None else {"configure": "no result"}
        assert node.trigger_configure() == returned
        assert lifecycle_state(node)[1] == label
        node.results = {}
        if label == "inactive":
            assert node.trigger_cleanup() is SUCCESS
    assert node.calls[:3] == [
        ("configure", "unconfigured"), ("cleanup", "inactive"), ("configure", "unconfigured")
    ]  # fmt: skip
    node.results = {"configure": ERROR, "error": FAILURE}
    assert node.trigger_configure() is ERROR
    assert lifecycle_state(node) == (4, "finalized")
    assert node.trigger_shutdown() is ERROR


def test_every_transition_has_its_default(context: Context) -> None:
    """A node without callbacks goes through all states, again and again, and ends for good."""
    node = LifecycleNode("managed", context=context)
    for _ in range(3):
        assert node.trigger_activate() is ERROR
        steps = (node.trigger_configure, node.trigger_activate, node.trigger_deactivate, node.trigger_cleanup)
        assert [step() for step in steps] == [SUCCESS] * 4
    assert node.trigger_shutdown() is SUCCESS
    assert lifecycle_state(node) == (4, "finalized")


def test_publishers_are_silent_unless_active(context: Context) -> None:
    """Only what is published while the node is active reaches a subscription."""
    node = LifecycleNode("managed", context=context)
    seen = list[str]()
    with SingleThreadedExecutor(context=context) as executor:
        executor.add_node(node)
        node.create_subscription(String, "chatter", lambda message: seen.append(message.data), 10)
        publisher = node.create_lifecycle_publisher(String, "chatter", 10)
        assert node.trigger_configure() is SUCCESS
        publisher.publish(String(data="inactive"))
        assert node.trigger_activate() is SUCCESS
        assert publisher.is_activated
        publisher.publish(String(data="active"))
        publisher.wait_for_all_acked()
        node.get_topic_names_and_types()  # answered after the messages have come
        executor.spin_once(DEADLINE_SEC)
        assert node.trigger_deactivate() is SUCCESS
        publisher.publish(String(data="inactive"))
        assert seen == ["active"]
    assert node.destroy_lifecycle_publisher(publisher)
    assert not node.destroy_lifecycle_publisher(publisher)
    assert not list(node.publishers)[2:]


def test_managed_entities_take_part(context: Context) -> None:
    """Entities are called until one does not succeed, and a method may depend on being activated."""

    refused = list[str]()

    class Gripper(SimpleManagedEntity):
        def __init__(self) -> None:
            super().__init__()
            self.grips = list[int]()

        @SimpleManagedEntity.when_enabled
        def grip(self, force: int) -> None:
            self.grips.append(force)

        @SimpleManagedEntity.when_enabled(when_not_enabled=lambda: refused.append("let go"))
        def let_go(self) -> None:
            self.grips.clear()

    class Stubborn(ManagedEntity):
        def on_deactivate(self, state: State) -> TransitionCallbackReturn:
            return FAILURE

    node = LifecycleNode("managed", context=context, enable_communication_interface=False)
    gripper = Gripper()
    node.add_managed_entity(gripper)
    node.trigger_configure()
    gripper.grip(1)
    gripper.let_go()
    node.trigger_activate()
    gripper.grip(2)
    assert (gripper.grips, refused) == ([2], ["let go"])
    gripper.let_go()
    assert gripper.grips == []
    node.add_managed_entity(Stubborn())
    assert node.trigger_deactivate() is FAILURE
    with pytest.raises(TypeError, match="no ManagedEntity"):
        node.add_managed_entity(object())  # type: ignore[arg-type]
    assert ManagedEntity().on_error(State("active", 3)) is SUCCESS


def test_other_nodes_change_the_state(context: Context) -> None:
    """The services of callboard's lifecycle nodes answer, and every transition is published."""
    node = Managed(context)
    other = Node("other", context=context)
    events = list[tuple[str, str]]()
    done = threading.Event()

    def happened(event: TransitionEvent) -> None:
        events.append((event.transition.label, event.goal_state.label))
        if len(events) == 5:
            done.set()

    other.create_subscription(TransitionEvent, "/managed/transition_event", happened, 10)
    change = other.create_client(ChangeState, "/managed/change_state")
    with SingleThreadedExecutor(context=context) as executor:
        executor.add_node(node)
        executor.add_node(other)
        spinning = threading.Thread(target=executor.spin)
        spinning.start()
        wanted = ChangeState.Request()
        wanted.transition.label = "activate"
        assert not change.call(wanted, timeout_sec=DEADLINE_SEC).success
        wanted.transition.label = "configure"
        assert change.call(wanted, timeout_sec=DEADLINE_SEC).success
        state = other.create_client(GetState, "/managed/get_state")
        found = state.call(GetState.Request(), timeout_sec=DEADLINE_SEC).current_state
        assert (found.id, found.label) == (2, "inactive")
        transitions = other.create_client(GetAvailableTransitions, "/managed/get_available_transitions")
        reply = transitions.call(GetAvailableTransitions.Request(), timeout_sec=DEADLINE_SEC)
        possible = {each.transition.label for each in reply.available_transitions}
        assert possible == {"activate", "cleanup", "shutdown"}
        node.results = {"cleanup": ERROR}
        wanted = ChangeState.Request()
        wanted.transition.id = 2
        assert not change.call(wanted, timeout_sec=DEADLINE_SEC).success
        assert done.wait(DEADLINE_SEC)
    spinning.join()
    assert events == [
        ("configure", "configuring"), ("transition_success", "inactive"), ("cleanup", "cleaningup"),
        ("transition_error", "errorprocessing"), ("transition_success", "unconfigured"),
    ]  # fmt: skip


def test_the_mixin_needs_a_node(context: Context) -> None:
    """A class that is no Node, and an option that is no bool, are refused; services get a group."""
    with pytest.raises(RuntimeError, match=r"derive the class from rclpy\.node\.Node"):
        LifecycleNodeMixin()
    with pytest.raises(TypeError, match="'yes' is no bool"):
        LifecycleNode("managed", context=context, enable_communication_interface="yes")  # type: ignore[arg-type]
