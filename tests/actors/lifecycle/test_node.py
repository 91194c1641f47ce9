"""A node with states, as its own program and as other nodes meet it."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors import LifecycleState, TransitionCallbackReturn
from actors.interfaces.lifecycle_msgs import msg, srv
from actors.interfaces.std_msgs.msg import String
from tests.actors.meeting import BARE, Meeting, matched, until

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from actors.lifecycle.node import CallbackResult

SUCCESS, FAILURE, ERROR = TransitionCallbackReturn


class Managed(actors.LifecycleNode):
    """Returns what the test wants, when the test wants."""

    def __init__(self, **options: Any) -> None:
        super().__init__("managed", **{**BARE, "use_global_arguments": False, **options})
        self.calls: list[tuple[str, str]] = []
        self.results: dict[str, Any] = {}
        self.gate = asyncio.Event()
        self.gate.set()
        self.publisher = self.create_lifecycle_publisher(String, "chatter")

    async def _result(self, name: str, state: LifecycleState) -> TransitionCallbackReturn:
        self.calls.append((name, state.label))
        await self.gate.wait()
        result = self.results.get(name, SUCCESS)
        if isinstance(result, BaseException):
            raise result
        return result  # type: ignore[no-any-return]

    def on_configure(self, state: LifecycleState) -> CallbackResult:
        return self._result("configure", state)

    async def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        return await self._result("activate", state)

    async def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        return await self._result("deactivate", state)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        self.calls.append(("error", state.label))
        return self.results.get("error", SUCCESS)  # type: ignore[no-any-return]


class Remote:
    """Calls the services of `/managed`, and keeps its events."""

    def __init__(self, node: actors.Node) -> None:
        self.node = node
        self.events: list[tuple[int, str, str, str]] = []
        self.subscription = node.create_subscription(
            msg.TransitionEvent, "/managed/transition_event", self._event, 100
        )
        self._state = node.create_client(srv.GetState, "/managed/get_state")
        self._change = node.create_client(srv.ChangeState, "/managed/change_state")

    def _event(self, event: msg.TransitionEvent) -> None:
        assert event.timestamp > 0
        transition = event.transition
        self.events.append((transition.id, transition.label, event.start_state.label, event.goal_state.label))

    async def state(self) -> str:
        return (await self._state.call(srv.GetState.Request())).current_state.label

    async def change(self, label: str = "", number: int = 0, timeout_sec: float | None = None) -> bool:
        request = srv.ChangeState.Request(transition=msg.Transition(id=number, label=label))
        return (await self._change.call(request, timeout_sec)).success

    async def transitions(self, name: str) -> list[msg.TransitionDescription]:
        client = self.node.create_client(srv.GetAvailableTransitions, f"/managed/{name}")
        return (await client.call(srv.GetAvailableTransitions.Request())).available_transitions


@pytest.fixture
async def managed(meeting: Meeting) -> AsyncIterator[Managed]:
    async with Managed(url=meeting.url) as node:
        yield node


@pytest.fixture
async def remote(meeting: Meeting, managed: Managed) -> Remote:
    made = Remote(await meeting.node("caller"))
    await matched(made.subscription)
    return made


async def test_back_and_forth(managed: Managed) -> None:
    """Configure and cleanup, activate and deactivate, ten times each."""
    for _ in range(10):
        assert await managed.trigger_configure() is SUCCESS
        assert await managed.trigger_cleanup() is SUCCESS
    await managed.trigger_configure()
    for _ in range(10):
        assert await managed.trigger_activate() is SUCCESS
        assert await managed.trigger_deactivate() is SUCCESS
    assert managed.current_state == LifecycleState("inactive", 2)
    assert await managed.trigger_shutdown() is SUCCESS
    assert managed.current_state == ("finalized", 4)
    assert managed.calls[0] == ("configure", "unconfigured")
    assert managed.calls[-1] == ("deactivate", "active")


@pytest.mark.parametrize(
    ("on_error", "state"),
    [(SUCCESS, "unconfigured"), (FAILURE, "finalized"), (ERROR, "finalized"), (None, "finalized")],
)
async def test_errors(managed: Managed, on_error: Any, state: str) -> None:
    """After ERROR `on_error` decides; its own failure finalizes. It gets the state before the transition."""
    managed.results = {"configure": ERROR, "error": on_error}
    assert await managed.trigger_configure() is ERROR
    assert managed.current_state.label == state
    assert managed.calls[-1] == ("error", "unconfigured")


@pytest.mark.parametrize("wrong", [ValueError("x"), asyncio.CancelledError(), None, True])
async def test_a_callback_that_raises(managed: Managed, wrong: Any) -> None:
    """An exception, and a result of another type, is logged and counted, and leads to `on_error`."""
    managed.results = {"configure": wrong}
    assert await managed.trigger_configure() is ERROR
    assert (managed.current_state.label, managed.callback_errors) == ("unconfigured", 1)
    managed.results = {}
    assert await managed.trigger_configure() is SUCCESS


async def test_services(remote: Remote) -> None:
    """The five services, with rclpy's names and answers."""
    found = dict(await remote.node.get_service_names_and_types_by_node("managed", "/"))
    assert found == {
        "/managed/change_state": ["lifecycle_msgs/srv/ChangeState"],
        "/managed/get_state": ["lifecycle_msgs/srv/GetState"],
        "/managed/get_available_states": ["lifecycle_msgs/srv/GetAvailableStates"],
        "/managed/get_available_transitions": ["lifecycle_msgs/srv/GetAvailableTransitions"],
        "/managed/get_transition_graph": ["lifecycle_msgs/srv/GetAvailableTransitions"],
    }
    assert await remote.change("configure")
    assert await remote.state() == "inactive"
    available = await remote.transitions("get_available_transitions")
    assert {each.transition.label for each in available} == {"activate", "cleanup", "shutdown"}
    assert len(await remote.transitions("get_transition_graph")) == 25
    states = remote.node.create_client(srv.GetAvailableStates, "/managed/get_available_states")
    assert len((await states.call(srv.GetAvailableStates.Request())).available_states) == 11
    assert await remote.change(number=msg.Transition.TRANSITION_ACTIVATE)
    assert not await remote.change("cleanup")
    assert await remote.state() == "active"


async def test_events(remote: Remote, managed: Managed) -> None:
    """Each step is published: into the transition state, out of it, and the way through an error."""
    managed.results = {"activate": ERROR}
    assert await remote.change("configure")
    assert not await remote.change("activate")
    await until(lambda: len(remote.events) == 5)
    assert remote.events == [
        (1, "configure", "unconfigured", "configuring"),
        (10, "transition_success", "configuring", "inactive"),
        (3, "activate", "inactive", "activating"),
        (32, "transition_error", "activating", "errorprocessing"),
        (60, "transition_success", "errorprocessing", "unconfigured"),
    ]


async def test_a_second_transition_is_refused(remote: Remote, managed: Managed) -> None:
    """While a callback waits, the state can be read, and further transitions are refused."""
    managed.gate.clear()
    first = asyncio.create_task(remote.change("configure"))
    await until(lambda: managed.calls)
    assert await remote.state() == "configuring"
    assert not await remote.change("shutdown")
    with pytest.raises(actors.InvalidTransitionError, match="'configuring'"):
        await managed.trigger_shutdown()
    managed.gate.set()
    assert await first
    assert await remote.state() == "inactive"


async def test_a_transition_outlives_its_caller(remote: Remote, managed: Managed) -> None:
    """A caller that gives up cancels its own wait, not the transition."""
    managed.gate.clear()
    caller = asyncio.ensure_future(remote.change("configure"))
    await until(lambda: managed.calls)
    caller.cancel()
    await asyncio.wait({caller})
    assert await remote.state() == "configuring"
    managed.gate.set()
    await until(lambda: managed.current_state.label == "inactive")


async def test_lifecycle_publishers(remote: Remote, managed: Managed) -> None:
    """Silent until active, and again after; what was suppressed is counted."""
    heard: list[str] = []
    subscription = remote.node.create_subscription(
        String, "chatter", lambda text: heard.append(text.data), 10
    )
    await matched(subscription)
    publisher = managed.publisher

    def publish(text: str) -> None:
        publisher.publish(String(data=text))

    publish("unconfigured")
    await managed.trigger_configure()
    publish("inactive")
    assert not publisher.is_activated
    await managed.trigger_activate()
    publish("active")
    managed.results = {"deactivate": FAILURE}
    await managed.trigger_deactivate()
    publish("still active")
    managed.results = {}
    await managed.trigger_deactivate()
    publish("inactive")
    await managed.trigger_activate()
    publish("active again")
    await managed.trigger_shutdown()
    publish("finalized")
    await until(lambda: len(heard) == 3)
    assert heard == ["active", "still active", "active again"]
    assert (publisher.published, publisher.suppressed) == (3, 4)


async def test_encoded_messages_are_suppressed_too(managed: Managed) -> None:
    """`publish_encoded`, and `publish` of bytes, are silent in the same states as `publish`."""
    publisher, encoded = managed.publisher, b"\x81\xa4data\xa1x"

    def publish() -> tuple[int, int]:
        publisher.publish_encoded(encoded, source_timestamp_ns=1)
        publisher.publish(encoded)
        return publisher.published, publisher.suppressed

    await managed.trigger_configure()
    assert publish() == (0, 2)
    await managed.trigger_activate()
    assert publish() == (2, 2)
    managed.results = {"deactivate": ERROR}
    await managed.trigger_deactivate()
    assert publish() == (2, 4)


@pytest.mark.parametrize("name", ["deactivate", "shutdown"])
async def test_last_messages(managed: Managed, name: str) -> None:
    """The callback that leads out of active can still publish; after it the publisher is silent."""

    def publish(state: LifecycleState) -> TransitionCallbackReturn:
        assert state.label == "active"
        managed.publisher.publish(String(data="bye"))
        return SUCCESS

    setattr(managed, f"on_{name}", publish)
    await managed.trigger_configure()
    await managed.trigger_activate()
    assert await getattr(managed, f"trigger_{name}")() is SUCCESS
    managed.publisher.publish(String(data="late"))
    assert (managed.publisher.published, managed.publisher.suppressed) == (1, 1)


async def test_the_inherited_on_activate_publishes(meeting: Meeting) -> None:
    """As with rclpy, what a callback publishes after `super().on_activate` is sent; not after a failure."""

    class Eager(actors.LifecycleNode):
        result = FAILURE

        def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
            super().on_activate(state)
            publisher.publish(String(data="x"))
            return self.result

    async with Eager("eager", url=meeting.url, use_global_arguments=False) as node:
        publisher = node.create_lifecycle_publisher(String, "chatter")
        await node.trigger_configure()
        assert await node.trigger_activate() is FAILURE
        assert (publisher.published, publisher.is_activated) == (1, False)


async def test_a_callback_may_trigger_and_call(meeting: Meeting, managed: Managed) -> None:
    """A node's own callback may wait for a transition, whose callback may call the node's services."""
    done: list[str] = []
    client = managed.create_client(srv.GetState, "/managed/get_state")

    async def on_cleanup(state: LifecycleState) -> TransitionCallbackReturn:
        done.append((await client.call(srv.GetState.Request())).current_state.label)
        return SUCCESS

    managed.on_cleanup = on_cleanup  # type: ignore[method-assign]

    async def tick() -> None:
        timer.cancel()
        await managed.trigger_configure()
        await managed.trigger_cleanup()
        done.append(managed.current_state.label)

    timer = managed.create_timer(0.0, tick)
    await until(lambda: len(done) == 2)
    assert done == ["cleaningup", "unconfigured"]


async def test_its_services_are_standard_endpoints(meeting: Meeting) -> None:
    """They are declared without definitions, and answer while a callback of the node is suspended."""
    gate, entered = asyncio.Event(), asyncio.Event()

    async def hold() -> None:
        timer.cancel()
        entered.set()
        await gate.wait()

    url = meeting.broker.url
    async with actors.LifecycleNode("managed", **BARE, url=url, use_global_arguments=False) as node:
        assert meeting.broker.stats().definitions == 0
        timer = node.create_timer(0.001, hold)
        caller = Remote(await meeting.node("caller"))
        await entered.wait()
        assert await caller.change("configure")
        assert await caller.state() == "inactive"
        gate.set()


async def test_a_lifecycle_publishers_qos_can_be_overridden() -> None:
    """Parameters override the QoS of a lifecycle publisher, as of any publisher."""
    node = actors.LifecycleNode(
        "n", parameter_overrides={"qos_overrides./chatter.publisher.depth": 3}, use_global_arguments=False
    )
    options = actors.QoSOverridingOptions.with_default_policies()
    assert node.create_lifecycle_publisher(String, "chatter").qos_profile.depth == 10
    made = node.create_lifecycle_publisher(String, "chatter", qos_overriding_options=options)
    assert made.qos_profile.depth == 3
    node.destroy_node()


async def test_without_services(meeting: Meeting) -> None:
    """`enable_communication_interface=False`: only the node itself changes its state."""
    async with Managed(url=meeting.url, enable_communication_interface=False) as node:
        assert await node.get_service_names_and_types_by_node("managed", "/") == []
        assert await node.trigger_configure() is SUCCESS


async def test_a_node_that_does_not_run(meeting: Meeting) -> None:
    """A transition of a node that does not run raises, and the state stays."""
    node = Managed(url=meeting.url)
    with pytest.raises(RuntimeError, match="not running"):
        await node.trigger_configure()
    assert node.current_state.label == "unconfigured"


@pytest.mark.parametrize("begun", [False, True])
async def test_destroying_during_a_transition(managed: Managed, begun: bool) -> None:
    """Whoever waits for a transition of a destroyed node gets an error at once, even before its callback."""
    managed.gate.clear()
    waiting = asyncio.ensure_future(managed.trigger_configure())
    await until(lambda: managed.calls if begun else managed.current_state.label == "configuring")
    assert bool(managed.calls) is begun
    managed.destroy_node()
    with pytest.raises(actors.NodeDestroyed, match="stopped during a transition"):
        await waiting


async def test_leaving_waits_for_a_transition(meeting: Meeting) -> None:
    """A transition that has begun ends like any callback before the node stops."""
    async with Managed(url=meeting.url) as node:
        node.gate.clear()
        waiting = asyncio.ensure_future(node.trigger_configure())
        await until(lambda: node.calls)
        asyncio.get_running_loop().call_soon(node.gate.set)
    assert await waiting is SUCCESS
    assert node.current_state.label == "inactive"


def test_a_transition_that_is_abandoned_has_not_failed() -> None:
    """If the loop ends without the node, no further callback runs in the coroutine that is closed."""

    async def begin() -> Managed:
        node = Managed(url="callboard://127.0.0.1:1")
        await node.__aenter__()
        node.gate.clear()
        configuring = asyncio.ensure_future(node.trigger_configure())
        await until(lambda: node.calls)
        assert not configuring.done()
        return node

    loop = asyncio.new_event_loop()
    loop.set_exception_handler(lambda *_: None)  # of tasks that are destroyed while pending
    node = loop.run_until_complete(begin())
    for task in asyncio.all_tasks(loop):
        coroutine = task.get_coro()
        assert coroutine is not None
        coroutine.close()
    loop.close()
    assert (node.calls, node.callback_errors) == ([("configure", "unconfigured")], 0)
