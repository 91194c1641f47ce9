"""Actions between two nodes: goals, feedback, results, cancellation, and what callbacks may answer."""

from __future__ import annotations

import asyncio
import contextlib
import subprocess
import sys
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors import CancelResponse, GoalResponse, GoalState
from actors.interfaces.action_msgs.msg import GoalInfo, GoalStatusArray
from actors.interfaces.action_msgs.srv import CancelGoal
from actors.interfaces.builtin_interfaces.msg import Time as TimeMessage
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.unique_identifier_msgs.msg import UUID
from actors.qos.profile import qos_profile_action_status_default
from actors.testing import SimulatedClock
from proto.wire.names import is_hidden
from tests.actors.meeting import DEADLINE_SEC, MIB, matched, until
from tests.seams.limits import set_limits

if TYPE_CHECKING:
    from tests.actors.meeting import Meeting

ORDER = Fibonacci.Goal(order=3)


class Pair:
    """A server and a client of one action, each in a node of its own."""

    def __init__(self, server: actors.ActionServer[Any, Any, Any], client: Any, nodes: Any) -> None:
        self.server = server
        self.client: actors.ActionClient[Any, Any, Any] = client
        self.server_node, self.client_node = nodes

    async def send(self, **options: Any) -> actors.ClientGoalHandle[Any, Any]:
        """Send a goal."""
        return await self.client.send_goal(ORDER, **options)

    async def status(self, handle: actors.ClientGoalHandle[Any, Any]) -> GoalState:
        """Return how the goal has ended."""
        return (await handle.result(DEADLINE_SEC)).status


async def pair(meeting: Meeting, execute: Any, **options: Any) -> Pair:
    """Start both nodes and wait until they are matched."""
    # Some tests leave goals that never end.
    nodes = await meeting.node("server", stop_timeout_sec=0.2), await meeting.node("client")
    server = nodes[0].create_action_server(Fibonacci, "fibonacci", execute, **options)
    client = nodes[1].create_action_client(Fibonacci, "fibonacci")
    assert await client.wait_for_server(DEADLINE_SEC)
    return Pair(server, client, nodes)


async def succeed(goal: actors.ServerGoalHandle[Any, Any, Any]) -> Fibonacci.Result:
    """Publish the sequence step by step, and succeed."""
    sequence = [0, 1]
    for _ in range(goal.request.order):
        sequence.append(sequence[-1] + sequence[-2])
        goal.publish_feedback(Fibonacci.Feedback(sequence=sequence))
        await asyncio.sleep(0)
    goal.succeed()
    return Fibonacci.Result(sequence=sequence)


class Gate:
    """An execute callback that waits until the test lets it go on, and then sets the terminal state."""

    def __init__(self) -> None:
        self.open = asyncio.Event()
        self.goals: list[actors.ServerGoalHandle[Any, Any, Any]] = []

    async def execute(self, goal: actors.ServerGoalHandle[Any, Any, Any]) -> Fibonacci.Result:
        """Wait, then end the goal as CANCELED if that is requested."""
        self.goals.append(goal)
        await self.open.wait()
        if goal.is_cancel_requested:
            goal.canceled()
        else:
            goal.succeed()
        return Fibonacci.Result(sequence=[goal.request.order])


def accept_cancel(goal: object) -> CancelResponse:
    """Accept every cancellation."""
    return CancelResponse.ACCEPT


async def test_a_goal_gives_feedback_and_a_result(meeting: Meeting) -> None:
    """Every feedback message arrives in order, and then the result."""
    both = await pair(meeting, succeed)
    handle = await both.send()
    assert handle.accepted
    feedback = [list(each.sequence) async for each in handle]
    assert feedback == [[0, 1, 1], [0, 1, 1, 2], [0, 1, 1, 2, 3]]
    result = await handle.result(DEADLINE_SEC)
    assert result.status is handle.status is GoalState.SUCCEEDED
    assert list(result.result.sequence) == [0, 1, 1, 2, 3]
    assert await handle.result() is result
    assert (both.client.pending, both.server.active, handle.dropped) == (0, 0, 0)


async def test_a_feedback_callback_gets_the_feedback_of_its_goal_only(meeting: Meeting) -> None:
    """Two goals run at the same time; each callback gets what belongs to its goal."""
    both = await pair(meeting, succeed)
    received: list[list[Any]] = [[], []]
    handles = [await both.send(feedback_callback=each.append) for each in received]
    for messages, handle in zip(received, handles, strict=True):
        await handle.result(DEADLINE_SEC)
        assert [message.goal_id for message in messages] == [handle.goal_id] * 3
    with pytest.raises(TypeError, match="feedback callback"):
        await anext(aiter(handles[0]))


async def test_feedback_before_the_acceptance_is_kept(meeting: Meeting) -> None:
    """A goal that gives feedback before the server has answered loses none of it."""

    def accepted(goal: actors.ServerGoalHandle[Any, Any, Any]) -> None:
        goal.publish_feedback(Fibonacci.Feedback(sequence=[7]))
        goal.execute()

    both = await pair(meeting, succeed, handle_accepted_callback=accepted)
    handle = await both.send()
    assert [list(each.sequence) async for each in handle] == [[7], [0, 1, 1], [0, 1, 1, 2], [0, 1, 1, 2, 3]]


def five(goal: actors.ServerGoalHandle[Any, Any, Any]) -> Fibonacci.Result:
    """Publish five feedback messages, and succeed at once."""
    for number in range(5):
        goal.publish_feedback(Fibonacci.Feedback(sequence=[number]))
    goal.succeed()
    return Fibonacci.Result()


async def test_a_result_waits_for_feedback_on_a_congested_link(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Replies overtake messages, but no result ends a goal before feedback that was published earlier."""
    set_limits(monkeypatch, feedback_wait_sec=DEADLINE_SEC)  # how congested a link is, the machine decides
    go = asyncio.Event()

    async def execute(goal: actors.ServerGoalHandle[Any, Any, Any]) -> Fibonacci.Result:
        await go.wait()
        return five(goal)

    both = await pair(meeting, execute)
    bulk = both.server_node.create_publisher(String, "bulk", 1000)
    subscription = both.client_node.create_subscription(String, "bulk", lambda msg: None, 1000)
    await matched(bulk)
    text = String(data="x" * (MIB // 5))

    async def flood() -> None:
        while True:
            for _ in range(20):
                bulk.publish(text)
            await asyncio.sleep(0)

    flooding = asyncio.ensure_future(flood())
    try:
        await until(lambda: subscription.received > 100)
        for kind in ("callback", "iterator") * 10:
            taken: list[Any] = []
            handle = await both.send(feedback_callback=taken.append if kind == "callback" else None)
            await handle.cancel()  # the server has the request for the result when it answers this one
            go.set()
            if kind == "iterator":
                taken += [feedback async for feedback in handle]
            await handle.result(DEADLINE_SEC)
            assert len(taken) == 5
            go.clear()
    finally:
        flooding.cancel()


async def test_a_result_waits_for_feedback_that_waits_for_the_mailbox(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Feedback waits while a callback of the client's node runs; the goal ends after it was handed over."""
    set_limits(monkeypatch, feedback_wait_sec=DEADLINE_SEC)
    both = await pair(meeting, five)
    entered, gate, taken = asyncio.Event(), asyncio.Event(), list[Any]()

    async def hold() -> None:
        timer.cancel()
        entered.set()
        await gate.wait()

    timer = both.client_node.create_timer(0, hold)
    await entered.wait()
    handle = await both.send(feedback_callback=taken.append)
    await meeting.settled(both.server_node, both.client_node)
    assert both.client.pending == 1
    gate.set()
    await handle.result(DEADLINE_SEC)
    assert len(taken) == 5


async def test_a_result_does_not_wait_for_feedback_for_long(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A callback that waits for the result elsewhere, and so keeps the feedback waiting, only delays it."""
    set_limits(monkeypatch, feedback_wait_sec=0.05)
    both = await pair(meeting, five)
    entered, gate, taken = asyncio.Event(), asyncio.Event(), list[Any]()

    async def hold() -> None:
        timer.cancel()
        entered.set()
        await gate.wait()

    timer = both.client_node.create_timer(0, hold)
    await entered.wait()
    handle = await both.send(feedback_callback=taken.append)
    assert await both.status(handle) is GoalState.SUCCEEDED
    assert not taken
    gate.set()


@pytest.mark.parametrize("breaks", ["server", "broker"])
async def test_a_result_waits_for_feedback_that_was_received_before_a_break(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch, breaks: str
) -> None:
    """Feedback that waits for the mailbox goes before the result, also if its publisher has gone."""
    set_limits(monkeypatch, feedback_wait_sec=DEADLINE_SEC)
    both = await pair(meeting, five)
    entered, gate = asyncio.Event(), asyncio.Event()

    async def hold() -> None:
        timer.cancel()
        entered.set()
        await gate.wait()

    timer = both.client_node.create_timer(0, hold)
    await entered.wait()
    handle = await both.send()
    await meeting.settled(both.server_node, both.client_node)
    if breaks == "server":
        both.server_node.destroy_node()
        await until(lambda: not both.client.server_is_ready())
    else:
        await meeting.restart_broker()
    gate.set()
    async with asyncio.timeout(DEADLINE_SEC):
        assert [list(each.sequence) async for each in handle] == [[0], [1], [2], [3], [4]]
    assert (await handle.result(DEADLINE_SEC)).status is GoalState.SUCCEEDED


async def test_an_iteration_can_be_left_and_begun_again(meeting: Meeting) -> None:
    """The next one goes on with the next feedback message; only two tasks that wait at once are an error."""
    gate = Gate()
    both = await pair(meeting, gate.execute)
    handle = await both.send()
    await until(lambda: gate.goals)
    for number in range(3):
        gate.goals[0].publish_feedback(Fibonacci.Feedback(sequence=[number]))
    taken: list[Any] = []
    for _ in range(3):
        async for feedback in handle:
            taken += feedback.sequence
            break
    assert taken == [0, 1, 2]
    waiting = asyncio.ensure_future(anext(aiter(handle)))
    await asyncio.sleep(0)
    with pytest.raises(RuntimeError, match="Another task"):
        await anext(aiter(handle))
    gate.open.set()
    with pytest.raises(StopAsyncIteration):
        await waiting


async def test_each_wait_gets_an_exception_of_its_own(meeting: Meeting) -> None:
    """One exception for all of them would collect their tracebacks."""
    both = await pair(meeting, Gate().execute)
    handle = await both.send()
    both.client.destroy()
    errors: list[BaseException] = []
    for wait in (handle.result(DEADLINE_SEC), handle.result(DEADLINE_SEC), anext(aiter(handle))):
        with pytest.raises(actors.NodeDestroyed, match=bytes(handle.goal_id.uuid).hex()) as caught:
            await wait
        errors.append(caught.value)
    assert len(set(map(id, errors))) == 3


async def test_feedback_that_nobody_takes_is_bounded_and_counted(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beyond the limit the oldest is dropped."""
    set_limits(monkeypatch, feedback_depth=2)
    both = await pair(meeting, succeed)
    handle = await both.send()
    await handle.result(DEADLINE_SEC)
    assert [len(each.sequence) async for each in handle] == [4, 5]
    assert handle.dropped == 1


@pytest.mark.parametrize("answer", [GoalResponse.REJECT, None, 2, "raise"])
async def test_a_goal_that_is_not_accepted_is_rejected(meeting: Meeting, answer: Any) -> None:
    """REJECT, something that is no GoalResponse, and an exception: the goal is rejected."""

    def decide(request: Fibonacci.Goal) -> Any:
        if answer == "raise":
            raise ValueError(request.order)
        return answer

    accepted: list[object] = []
    both = await pair(meeting, succeed, goal_callback=decide, handle_accepted_callback=accepted.append)
    handle = await both.send()
    assert not handle.accepted
    assert not accepted
    assert both.client.pending == 0
    for wait in (handle.result(), handle.cancel(), anext(aiter(handle))):
        with pytest.raises(actors.GoalRejected):
            await wait


async def test_of_two_goals_with_one_id_one_is_accepted(meeting: Meeting) -> None:
    """The second is rejected, also while the first is being decided."""

    async def decide(request: Fibonacci.Goal) -> GoalResponse:
        await asyncio.sleep(0)
        return GoalResponse.ACCEPT

    both = await pair(meeting, succeed, goal_callback=decide)
    other: actors.ActionClient[Any, Any, Any]
    other = both.client_node.create_action_client(Fibonacci, "fibonacci")
    assert await other.wait_for_server(DEADLINE_SEC)
    same = UUID(uuid=bytes(range(16)))
    first, second = await asyncio.gather(both.send(goal_uuid=same), other.send_goal(ORDER, goal_uuid=same))
    assert first.accepted != second.accepted


async def test_one_goal_too_many_is_rejected(meeting: Meeting, monkeypatch: pytest.MonkeyPatch) -> None:
    """The number of goals that have not ended is limited, and the refusal is counted."""
    set_limits(monkeypatch, goals=1)
    gate = Gate()
    both = await pair(meeting, gate.execute)
    first, second = await both.send(), await both.send()
    assert (first.accepted, second.accepted, both.server.refused) == (True, False, 1)
    gate.open.set()
    assert await both.status(first) is GoalState.SUCCEEDED
    assert (await both.send()).accepted


async def test_a_goal_without_a_terminal_state_is_aborted(meeting: Meeting) -> None:
    """The result that was returned is kept."""

    def execute(goal: object) -> Fibonacci.Result:
        return Fibonacci.Result(sequence=[1])

    both = await pair(meeting, execute)
    result = await (await both.send()).result(DEADLINE_SEC)
    assert (result.status, list(result.result.sequence)) == (GoalState.ABORTED, [1])


@pytest.mark.parametrize(
    "result",
    [
        ValueError("no"),
        Fibonacci.Goal(),
        Fibonacci.Result(sequence=[2**40]),
    ],
)
async def test_a_goal_whose_callback_fails_is_aborted(meeting: Meeting, result: Any) -> None:
    """An exception and a result that is not valid end the goal with an empty result, and count."""

    async def execute(goal: actors.ServerGoalHandle[Any, Any, Any]) -> Any:
        if isinstance(result, Exception):
            raise result
        return result

    both = await pair(meeting, execute)
    ended = await (await both.send()).result(DEADLINE_SEC)
    assert (ended.status, list(ended.result.sequence)) == (GoalState.ABORTED, [])
    assert both.server_node.callback_errors == 1


async def test_a_terminal_state_never_changes(meeting: Meeting) -> None:
    """A callback that fails after `succeed` leaves the goal SUCCEEDED, with an empty result."""

    async def execute(goal: actors.ServerGoalHandle[Any, Any, Any]) -> Fibonacci.Result:
        goal.succeed()
        return Fibonacci.Result(sequence=[2**40])

    both = await pair(meeting, execute)
    result = await (await both.send()).result(DEADLINE_SEC)
    assert (result.status, list(result.result.sequence)) == (GoalState.SUCCEEDED, [])
    assert both.server_node.callback_errors == 1


async def test_wrong_types_are_type_errors(meeting: Meeting) -> None:
    """Wrong goals, feedback, results, actions and callbacks are refused where they are passed."""
    errors: list[TypeError] = []

    async def execute(goal: actors.ServerGoalHandle[Any, Any, Any]) -> Fibonacci.Result:
        for attempt in (goal.publish_feedback, goal.succeed):
            with pytest.raises(TypeError) as caught:
                attempt(Fibonacci.Goal())
            errors.append(caught.value)
        with pytest.raises(actors.InvalidMessageError):
            goal.succeed(Fibonacci.Result(sequence=[2**40]))
        goal.succeed(Fibonacci.Result(sequence=[1]))
        with pytest.raises(actors.InvalidGoalTransitionError):
            goal.abort()
        return Fibonacci.Result()

    both = await pair(meeting, execute)
    with pytest.raises(TypeError, match="Goal"):
        await both.client.send_goal(Fibonacci.Result())
    result = await (await both.send()).result(DEADLINE_SEC)
    assert list(result.result.sequence) == [1]
    assert len(errors) == 2
    for create in (both.server_node.create_action_client, both.server_node.create_action_server):
        with pytest.raises(TypeError, match="action class"):
            create(CancelGoal, "wrong", *([succeed] if create.__name__.endswith("server") else []))
    with pytest.raises(RuntimeError, match="execute"):
        both.server_node.create_action_server(Fibonacci, "wrong", lambda: None)


async def test_cancellation_is_rejected_by_default(meeting: Meeting) -> None:
    """The goal goes on."""
    gate = Gate()
    both = await pair(meeting, gate.execute)
    handle = await both.send()
    response = await handle.cancel()
    assert (response.return_code, response.goals_canceling) == (response.ERROR_REJECTED, [])
    gate.open.set()
    assert await both.status(handle) is GoalState.SUCCEEDED


async def test_a_goal_is_cancelled(meeting: Meeting) -> None:
    """The answer names the goal; a second request gets the same answer, a late one an error."""
    gate = Gate()
    both = await pair(meeting, gate.execute, cancel_callback=accept_cancel)
    handle = await both.send()
    await until(lambda: gate.goals)
    for _ in range(2):
        response = await handle.cancel()
        assert response.return_code == response.ERROR_NONE
        assert [bytes(info.goal_id.uuid) for info in response.goals_canceling] == [bytes(handle.goal_id.uuid)]
    await until(lambda: handle.status is GoalState.CANCELING)
    gate.open.set()
    assert await both.status(handle) is GoalState.CANCELED
    assert (await handle.cancel()).return_code == CancelGoal.Response.ERROR_GOAL_TERMINATED


async def test_a_request_to_cancel_may_name_all_goals_or_those_until_a_time(meeting: Meeting) -> None:
    """Zero id and time mean all goals; a time means those accepted by then; an unknown id is an error."""
    gate = Gate()
    both = await pair(meeting, gate.execute, cancel_callback=accept_cancel)
    first, second = await both.send(), await both.send()
    raw = both.client_node.create_client(CancelGoal, "fibonacci/_action/cancel_goal")
    unknown = GoalInfo(goal_id=UUID(uuid=bytes([1] * 16)))
    assert (await raw.call(CancelGoal.Request(goal_info=unknown))).return_code == 2
    assert first.stamp is not None
    until_first = await raw.call(CancelGoal.Request(goal_info=GoalInfo(stamp=first.stamp)))
    assert [bytes(each.goal_id.uuid) for each in until_first.goals_canceling] == [bytes(first.goal_id.uuid)]
    assert len((await raw.call(CancelGoal.Request())).goals_canceling) == 2
    gate.open.set()
    assert [await both.status(each) for each in (first, second)] == [GoalState.CANCELED] * 2


async def test_a_goal_can_be_cancelled_before_it_is_executed(meeting: Meeting) -> None:
    """The execute callback still runs, finds the goal CANCELING, and ends it."""
    deferred: list[actors.ServerGoalHandle[Any, Any, Any]] = []
    gate = Gate()
    gate.open.set()
    both = await pair(
        meeting, gate.execute, cancel_callback=accept_cancel, handle_accepted_callback=deferred.append
    )
    handle = await both.send()
    await handle.cancel()
    assert not gate.goals
    deferred[0].execute()
    assert await both.status(handle) is GoalState.CANCELED
    with pytest.raises(RuntimeError, match="executed already"):
        deferred[0].execute()


async def test_cancel_execution_cancels_the_callback(meeting: Meeting) -> None:
    """The callback sees CancelledError, and the goal is CANCELED; a deferred goal never runs."""
    cancelled: list[str] = []
    deferred: list[actors.ServerGoalHandle[Any, Any, Any]] = []

    async def execute(goal: actors.ServerGoalHandle[Any, Any, Any]) -> None:
        try:
            await asyncio.Event().wait()
        except asyncio.CancelledError:
            cancelled.append("execute")
            raise

    def accepted(goal: actors.ServerGoalHandle[Any, Any, Any]) -> None:
        if deferred:
            goal.execute()
        deferred.append(goal)

    both = await pair(
        meeting,
        execute,
        cancel_callback=accept_cancel,
        handle_accepted_callback=accepted,
        cancel_execution=True,
    )
    waiting, running = await both.send(), await both.send()
    await until(lambda: running.status is GoalState.EXECUTING)
    for handle in (waiting, running):
        await handle.cancel()
        assert await both.status(handle) is GoalState.CANCELED
    assert cancelled == ["execute"]
    assert both.server_node.callback_errors == 0


async def test_goals_are_stamped_by_the_clock_of_the_node(meeting: Meeting) -> None:
    """With `use_sim_time` too, so that goals can be cancelled by simulated time."""
    server = await meeting.node("server", parameter_overrides={"use_sim_time": True})
    client_node, gate = await meeting.node("client"), Gate()
    server.create_action_server(Fibonacci, "fibonacci", gate.execute)
    client = client_node.create_action_client(Fibonacci, "fibonacci")
    assert await client.wait_for_server(DEADLINE_SEC)
    clock = SimulatedClock(client_node, server)
    await clock.set(12.5)
    handle = await client.send_goal(ORDER)
    assert handle.stamp == TimeMessage(sec=12, nanosec=500_000_000)
    gate.open.set()
    await handle.result(DEADLINE_SEC)


@pytest.mark.parametrize("failure", ["callback", "coroutine", "argument"])
async def test_a_failing_accepted_callback_aborts_the_goal(meeting: Meeting, failure: str) -> None:
    """Nothing else would ever end it."""

    def accepted(goal: actors.ServerGoalHandle[Any, Any, Any]) -> Any:
        if failure == "callback":
            raise ValueError("no")
        if failure == "argument":
            goal.execute(no_argument)
        return fail()

    async def fail() -> None:
        await asyncio.sleep(0)
        raise ValueError("no")

    async def no_argument() -> None:
        pass

    both = await pair(meeting, succeed, handle_accepted_callback=accepted)
    assert await both.status(await both.send()) is GoalState.ABORTED
    assert both.server_node.callback_errors == 1


async def test_an_accepted_callback_that_waits_does_not_delay_the_answer(meeting: Meeting) -> None:
    """The client learns at once that its goal was accepted; the goal runs when the callback lets it."""
    gate = asyncio.Event()

    async def accepted(goal: actors.ServerGoalHandle[Any, Any, Any]) -> None:
        await gate.wait()
        goal.execute()

    both = await pair(meeting, succeed, handle_accepted_callback=accepted)
    handle = await both.send(timeout_sec=DEADLINE_SEC)
    assert (handle.accepted, handle.status) == (True, GoalState.ACCEPTED)
    gate.set()
    assert await both.status(handle) is GoalState.SUCCEEDED


async def test_a_destroyed_server_cancels_accepted_callbacks(meeting: Meeting) -> None:
    """They are not left behind, and are no errors."""
    cancelled = asyncio.Event()

    async def accepted(goal: object) -> None:
        try:
            await asyncio.Event().wait()
        except asyncio.CancelledError:
            cancelled.set()
            raise

    both = await pair(meeting, succeed, handle_accepted_callback=accepted)
    handle = await both.send()
    await meeting.settled(both.server_node)
    both.server.destroy()
    async with asyncio.timeout(DEADLINE_SEC):
        await cancelled.wait()
    with pytest.raises(actors.ServiceUnavailable):
        await handle.result(DEADLINE_SEC)
    assert both.server_node.callback_errors == 0


async def test_the_parts_have_ros_names_types_and_qos(meeting: Meeting) -> None:
    """Three services and two topics, with the profiles of rcl_action."""
    both = await pair(meeting, succeed)
    node, prefix = both.client_node, "/fibonacci/_action/"
    services = dict(await node.get_service_names_and_types_by_node("server", "/"))
    kind = "example_interfaces/action/Fibonacci"
    assert {name: types for name, types in services.items() if prefix in name} == {
        f"{prefix}send_goal": [f"{kind}_SendGoal"],
        f"{prefix}cancel_goal": ["action_msgs/srv/CancelGoal"],
        f"{prefix}get_result": [f"{kind}_GetResult"],
    }
    for topic, types, profile in (
        ("feedback", f"{kind}_FeedbackMessage", actors.qos_profile_default),
        ("status", "action_msgs/msg/GoalStatusArray", qos_profile_action_status_default),
    ):
        (publisher,) = await node.get_publishers_info_by_topic(prefix + topic)
        (subscription,) = await node.get_subscriptions_info_by_topic(prefix + topic)
        for found in (publisher, subscription):
            assert found.topic_type == types
            assert found.qos_profile.resolved() == profile.resolved()


async def test_late_clients_get_states_and_results(meeting: Meeting) -> None:
    """A node that comes after the goal has ended gets its latched state, and its result."""
    both = await pair(meeting, succeed)
    handle = await both.send()
    await handle.result(DEADLINE_SEC)
    late = (await meeting.node("late")).create_action_client(Fibonacci, "fibonacci")
    await until(lambda: late.statuses and late.statuses[0].status == GoalState.SUCCEEDED)
    result = await late.get_result(late.statuses[0].goal_info.goal_id, DEADLINE_SEC)
    assert list(result.result.sequence) == [0, 1, 1, 2, 3]


async def test_results_expire(meeting: Meeting) -> None:
    """After the timeout a result is unknown, and the goal is no longer listed."""
    gate = Gate()
    both = await pair(meeting, gate.execute, result_timeout_sec=0.0)
    handle = await both.send()
    await meeting.settled(both.client_node, both.server_node)
    gate.open.set()
    assert await both.status(handle) is GoalState.SUCCEEDED
    await until(lambda: both.client.statuses == [])
    with pytest.raises(actors.GoalUnknown):
        await both.client.get_result(handle.goal_id)


async def test_a_server_that_dies_ends_every_wait(meeting: Meeting) -> None:
    """Results, iterators and later requests get ServiceUnavailable; nothing is left behind."""
    gate = Gate()
    both = await pair(meeting, gate.execute)
    handles = [await both.send() for _ in range(3)]
    waits = [asyncio.ensure_future(handles[0].result()), asyncio.ensure_future(anext(aiter(handles[1])))]
    await until(lambda: len(gate.goals) == 3)
    both.server_node.destroy_node()
    async with asyncio.timeout(DEADLINE_SEC):
        for wait in (*waits, handles[2].result(), handles[2].cancel(), both.send()):
            with pytest.raises(actors.ServiceUnavailable):
                await wait
    assert both.client.pending == 0
    assert not both.client.server_is_ready()
    assert not await both.client.wait_for_server(0.0)


async def test_a_broken_link_ends_every_wait_and_the_goal_goes_on(meeting: Meeting) -> None:
    """After the reconnect the result can be asked for by the goal's id."""
    gate = Gate()
    both = await pair(meeting, gate.execute)
    handle = await both.send()
    await until(lambda: gate.goals)
    await meeting.restart_broker()
    with pytest.raises(actors.ServiceUnavailable):
        await handle.result(DEADLINE_SEC)
    assert await both.client.wait_for_server(DEADLINE_SEC)
    gate.open.set()
    result = await both.client.get_result(handle.goal_id, DEADLINE_SEC)
    assert result.status is GoalState.SUCCEEDED


async def test_a_server_that_is_another_one_does_not_know_the_goal(meeting: Meeting) -> None:
    """A server that has replaced the first answers that the goal is unknown."""
    both = await pair(meeting, succeed)
    with pytest.raises(actors.GoalUnknown):
        await both.client.get_result(UUID(uuid=bytes([5] * 16)), DEADLINE_SEC)


async def test_a_destroyed_client_ends_its_goals(meeting: Meeting) -> None:
    """Whoever waits gets NodeDestroyed."""
    gate = Gate()
    both = await pair(meeting, gate.execute)
    handle = await both.send()
    both.client.destroy()
    for wait in (handle.result(DEADLINE_SEC), anext(aiter(handle)), both.send()):
        with pytest.raises(actors.NodeDestroyed):
            await wait
    assert both.client.pending == 0


@pytest.mark.parametrize("part", ["client", "client_node"])
async def test_a_destroyed_client_ends_its_calls(meeting: Meeting, part: str) -> None:
    """Whoever waits for an acceptance, a cancellation or a result gets NodeDestroyed, not CancelledError."""
    entered: list[object] = []

    async def wait(asked: object) -> Any:
        entered.append(asked)
        await asyncio.Event().wait()

    async def decide(goal: Fibonacci.Goal) -> GoalResponse:
        return GoalResponse.ACCEPT if goal == ORDER else await wait(goal)

    both = await pair(meeting, wait, goal_callback=decide, cancel_callback=wait)
    handle = await both.send()
    calls = [
        asyncio.ensure_future(call)
        for call in (
            both.client.send_goal(Fibonacci.Goal()),
            handle.cancel(),
            both.client.get_result(handle.goal_id),
        )
    ]
    await until(lambda: len(entered) == 3)
    if part == "client":
        both.client.destroy()
    else:
        both.client_node.destroy_node()
    for call in calls:
        with pytest.raises(actors.NodeDestroyed):
            await call


async def test_a_cancelled_caller_stays_cancelled(meeting: Meeting) -> None:
    """Its cancellation is not replaced by NodeDestroyed if the client is destroyed at the same time."""
    entered = asyncio.Event()

    async def decide(goal: object) -> GoalResponse:
        entered.set()
        await asyncio.Event().wait()
        return GoalResponse.REJECT

    both = await pair(meeting, succeed, goal_callback=decide)
    sending = asyncio.ensure_future(both.send())
    await entered.wait()
    sending.cancel()
    both.client.destroy()
    with pytest.raises(asyncio.CancelledError):
        await sending


async def test_a_client_destroyed_as_the_acceptance_arrives_keeps_no_goal(meeting: Meeting) -> None:
    """Whether the result was asked for before or not."""
    both = await pair(meeting, succeed)

    def destroy(message: GoalStatusArray) -> None:
        both.client.destroy()

    topic = "fibonacci/_action/status"
    both.client_node.create_subscription(GoalStatusArray, topic, destroy, qos_profile_action_status_default)
    with contextlib.suppress(actors.NodeDestroyed):
        await both.send()
    await until(lambda: both.client.destroyed and not both.client.pending)


async def test_waiting_for_a_server_ends_if_the_broker_refuses_the_client(meeting: Meeting) -> None:
    """It would wait until its deadline; the error says why. At another broker it may wait again."""
    await meeting.restart_broker(max_endpoints=4)
    node = await meeting.node("client")
    client = node.create_action_client(Fibonacci, "fibonacci")
    with pytest.raises(actors.ServiceUnavailable, match="'/fibonacci': one connection may declare 4"):
        await client.wait_for_server(DEADLINE_SEC)
    await meeting.restart_broker()
    await until(lambda: node.connected)
    server = await meeting.node("server")
    server.create_action_server(Fibonacci, "fibonacci", succeed)
    assert await client.wait_for_server(DEADLINE_SEC)


async def test_a_result_that_takes_too_long_can_be_awaited_again(meeting: Meeting) -> None:
    """The timeout ends the wait, not the goal."""
    gate = Gate()
    both = await pair(meeting, gate.execute)
    handle = await both.send()
    with pytest.raises(actors.WaitTimeout, match="has not ended within"):
        await handle.result(0.01)
    gate.open.set()
    assert await both.status(handle) is GoalState.SUCCEEDED


async def test_a_stopping_server_lets_goals_end(meeting: Meeting) -> None:
    """Goals that run may end within the node's stop timeout; deferred ones are aborted at once."""
    gate = Gate()
    node = meeting.absent("server")
    other = await meeting.node("client")
    client = other.create_action_client(Fibonacci, "fibonacci")
    waiting: list[actors.ServerGoalHandle[Any, Any, Any]] = []

    def accepted(goal: actors.ServerGoalHandle[Any, Any, Any]) -> None:
        if goal.request.order:
            goal.execute()
        else:
            waiting.append(goal)

    async with node:
        node.create_action_server(Fibonacci, "fibonacci", gate.execute, handle_accepted_callback=accepted)
        assert await client.wait_for_server(DEADLINE_SEC)
        running = await client.send_goal(ORDER)
        deferred = await client.send_goal(Fibonacci.Goal())
        await meeting.settled(other, node)
        asyncio.get_running_loop().call_later(0.01, gate.open.set)
    assert (await running.result(DEADLINE_SEC)).status is GoalState.SUCCEEDED
    assert (await deferred.result(DEADLINE_SEC)).status is GoalState.ABORTED


async def test_a_goal_can_be_sent_and_awaited_in_a_callback_of_the_same_node(meeting: Meeting) -> None:
    """A callback that waits for a goal frees the mailbox, so that the server in its node can work."""
    node = await meeting.node("both")
    node.create_action_server(Fibonacci, "fibonacci", succeed)
    client = node.create_action_client(Fibonacci, "fibonacci")
    assert await client.wait_for_server(DEADLINE_SEC)
    done: asyncio.Future[list[int]] = asyncio.get_running_loop().create_future()

    async def tick() -> None:
        timer.cancel()
        handle = await client.send_goal(ORDER)
        lengths = [len(each.sequence) async for each in handle]
        await handle.result(DEADLINE_SEC)
        done.set_result(lengths)

    timer = node.create_timer(0.0, tick)
    async with asyncio.timeout(DEADLINE_SEC):
        assert await done == [3, 4, 5]


async def test_graph_queries_know_actions(meeting: Meeting) -> None:
    """An action is found under its name and type, in all and by node; its parts are hidden."""
    both = await pair(meeting, succeed)
    found = [("/fibonacci", ["example_interfaces/action/Fibonacci"])]
    node = both.client_node
    assert await node.get_action_names_and_types() == found
    assert await node.get_action_server_names_and_types_by_node("server", "/") == found
    assert await node.get_action_client_names_and_types_by_node("server", "/") == []
    assert await node.get_action_client_names_and_types_by_node("client", "/") == found
    names = [name for name, _ in await node.get_topic_names_and_types() if "fibonacci" in name]
    assert names == ["/fibonacci/_action/feedback", "/fibonacci/_action/status"]
    assert all(map(is_hidden, names))


@pytest.mark.processes
def test_a_node_without_actions_does_not_load_them() -> None:
    """Their modules and messages would add to the start of every node."""
    code = "import sys, actors; actors.Node('a'); sys.exit('actors.actions.server' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
