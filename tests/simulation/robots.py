"""A robot that executes goals, has parameters and changes its state, and operators that use it.

Both write down what has become of that, and `Operator.check` compares it.
"""

from __future__ import annotations

import asyncio
from contextlib import suppress
from random import Random
from typing import TYPE_CHECKING, Any, Final

import actors
from actors import CancelResponse, GoalState, LifecycleState, Parameter, TransitionCallbackReturn
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.lifecycle_msgs.msg import Transition
from actors.interfaces.lifecycle_msgs.srv import ChangeState, GetState
from actors.interfaces.unique_identifier_msgs.msg import UUID

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Coroutine
    from typing import TypeVar

    from tests.simulation.robot_history import History

    T = TypeVar("T")

CALL_SEC: Final = 3.0
"""The deadline of every call."""

NAMES: Final = ("left", "right")
TRANSITIONS: Final = ("configure", "activate", "deactivate", "cleanup")


class Robot(actors.LifecycleNode):
    """Writes down what it has really done.

    Args:
        url: The broker's URL.

    Attributes:
        executed: The terminal state of each goal that it has executed, by id.
        values: The values that its parameters have had.
        begun: Transitions whose callback has been called.
        done: Those whose callback has returned.
    """

    def __init__(self, url: str) -> None:
        super().__init__("robot", url=url, use_global_arguments=False)
        self.executed: dict[bytes, GoalState] = {}
        self.values = [0]
        self.begun = self.done = 0
        self.declare_parameters("", [(name, 0) for name in NAMES])
        self.add_post_set_parameters_callback(self._set)
        self.create_action_server(
            Fibonacci,
            "count",
            self._execute,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            result_timeout_sec=-1,
        )

    @property
    def value(self) -> list[object]:
        """The values of both parameters."""
        return [each.value for each in self.get_parameters(NAMES)]

    def _set(self, parameters: list[Parameter]) -> None:
        first, second = (each.value for each in parameters)
        assert isinstance(first, int)
        assert first == second
        self.values.append(first)

    async def _execute(self, goal: actors.ServerGoalHandle[Any, Any, Any]) -> Fibonacci.Result:
        key = bytes(goal.goal_id.uuid)
        assert key not in self.executed
        for number in range(goal.request.order):
            if goal.is_cancel_requested:
                goal.canceled()
                break
            goal.publish_feedback(Fibonacci.Feedback(sequence=[number]))
            await asyncio.sleep(0.1)
        else:
            if goal.request.order % 3:
                goal.succeed()
            else:
                goal.abort()
        self.executed[key] = goal.status
        return Fibonacci.Result(sequence=[goal.request.order])

    async def _transition(self, state: LifecycleState) -> TransitionCallbackReturn:
        assert state.label in {"unconfigured", "inactive", "active"}
        assert self.begun == self.done
        self.begun += 1
        await asyncio.sleep(0.2)
        self.done += 1
        return TransitionCallbackReturn.SUCCESS

    on_configure = on_activate = on_deactivate = on_cleanup = _transition


class Goal:
    """A goal that an operator has sent, and what it has heard of it.

    Attributes:
        key: Its id.
        ends: How each wait for its result, and each iteration, has ended: a state or an error.
    """

    def __init__(self, key: bytes) -> None:
        self.key = key
        self.ends: list[GoalState | BaseException] = []


class Operator(actors.Node):
    """Sends goals, sets parameters and requests transitions, at random, and writes down how each ended.

    Attributes:
        goals: The goals that were accepted.
        watched: The states in which goals have ended that others may have sent, by id.
        sets: The values whose setting succeeded.
        changes: Transitions that succeeded.
        seen: Values of the first parameter that events have reported.
    """

    def __init__(self, number: int, history: History) -> None:
        super().__init__(
            f"operator{number}", url=history.url, use_global_arguments=False, start_parameter_services=False
        )
        self.goals: list[Goal] = []
        self.watched: dict[bytes, GoalState] = {}
        self.sets: list[int] = []
        self.changes = 0
        self.seen: list[int] = []
        self.actions: actors.ActionClient[Any, Any, Any] = self.create_action_client(Fibonacci, "count")
        self.parameters = actors.ParameterClient(self, "robot")
        self.change = self.create_client(ChangeState, "robot/change_state")
        self.state = self.create_client(GetState, "robot/get_state")
        events = actors.ParameterEventHandler(self)
        events.add_parameter_callback("left", "/robot", lambda left: self.seen.append(int(str(left.value))))
        self._history = history
        self._random = Random(f"{history.seed} operator {number}")

    def known_goals(self) -> dict[bytes, int]:
        """Return the states of all goals of the robot, as it has published them."""
        return {bytes(each.goal_info.goal_id.uuid): each.status for each in self.actions.statuses}

    def work(self) -> list[asyncio.Task[None]]:
        """Begin to do things, until the faults are over."""
        doing = (*(self._send_goal,) * 3, *(self._watch,) * 2, *(self._set,) * 2, self._change)
        return [asyncio.create_task(self._keep(do)) for do in doing]

    async def _keep(self, do: Callable[[], Coroutine[Any, Any, None]]) -> None:
        while self._history.active:
            await asyncio.sleep(self._random.expovariate(3))
            try:
                await do()
            except (actors.ServiceUnavailable, actors.ServiceTimeout, actors.WaitTimeout, actors.GoalUnknown):
                continue
            except actors.NodeDestroyed:
                return

    async def _send_goal(self) -> None:
        goal = Goal(self._random.randbytes(16))
        order = self._random.choice([0, 1, 3, 30])
        handle = await self._in_time(
            self.actions.send_goal(
                Fibonacci.Goal(order=order), goal_uuid=UUID(uuid=goal.key), timeout_sec=CALL_SEC
            )
        )
        self.goals.append(goal)
        waits: list[Coroutine[Any, Any, GoalState | None]]
        waits = [self._result(handle), self._result(handle), self._feedback(handle)]
        if self._random.random() < 0.3:
            waits.append(self._cancel(handle))
        ends = await asyncio.gather(*waits, return_exceptions=True)
        goal.ends = [end for end in ends if end is not None]
        for end in goal.ends:
            assert end == goal.ends[0] or type(end) is type(goal.ends[0]), ends
            assert isinstance(end, GoalState | actors.CallFailed | actors.NodeDestroyed), ends

    async def _watch(self) -> None:
        if await self._in_time(self.actions.wait_for_server(CALL_SEC)) and self.actions.statuses:
            goal_id = self._random.choice(self.actions.statuses).goal_info.goal_id
            result = await self._in_time(self.actions.get_result(goal_id, CALL_SEC))
            state = self.watched.setdefault(bytes(goal_id.uuid), result.status)
            assert state is result.status

    async def _result(self, handle: actors.ClientGoalHandle[Any, Any]) -> GoalState:
        state = (await handle.result(None)).status
        assert state is (await handle.result(0)).status is handle.status
        return state

    async def _feedback(self, handle: actors.ClientGoalHandle[Any, Any]) -> GoalState:
        last = -1
        async for feedback in handle:
            (number,) = feedback.sequence
            assert number > last
            last = number
        return handle.status

    async def _cancel(self, handle: actors.ClientGoalHandle[Any, Any]) -> None:
        await asyncio.sleep(self._random.expovariate(2))
        with suppress(actors.CallFailed, actors.NodeDestroyed):
            await self._in_time(handle.cancel(CALL_SEC))

    async def _set(self) -> None:
        self._history.number += 1
        number = self._history.number
        both = [Parameter(name, value=number) for name in NAMES]
        result = await self._in_time(self.parameters.set_parameters_atomically(both, CALL_SEC))
        assert result.successful
        self.sets.append(number)

    async def _change(self) -> None:
        request = ChangeState.Request(transition=Transition(label=self._random.choice(TRANSITIONS)))
        self.changes += (await self._in_time(self.change.call(request, CALL_SEC))).success

    async def check(self, robots: list[Robot]) -> None:
        """Compare what it has heard with what the robots have done, and use the last of them once more."""
        robot = robots[-1]
        assert await self._in_time(self.actions.wait_for_server(CALL_SEC))
        assert not self.actions.pending
        for goal in self.goals:
            assert goal.ends
            executed = [each.executed[goal.key] for each in robots if goal.key in each.executed]
            if isinstance(goal.ends[0], GoalState):
                assert executed == goal.ends[:1]
            if goal.key in robot.executed:
                result = await self._in_time(self.actions.get_result(UUID(uuid=goal.key), CALL_SEC))
                assert [result.status] == executed
        for key, watched in self.watched.items():
            assert [each.executed[key] for each in robots if key in each.executed] == [watched]
        handle = await self._in_time(self.actions.send_goal(Fibonacci.Goal(order=1), timeout_sec=CALL_SEC))
        assert (await self._in_time(handle.result())).status is GoalState.SUCCEEDED
        await self._set()
        assert robot.value == [self.sets[-1]] * 2
        found = await self._in_time(self.parameters.get_parameters(NAMES, CALL_SEC))
        assert [each.value for each in found] == robot.value
        state = (await self._in_time(self.state.call(GetState.Request(), CALL_SEC))).current_state
        assert state.label == robot.current_state.label

    async def _in_time(self, call: Awaitable[T]) -> T:
        """Await a call; it must end by its deadline."""
        began, lost = self._history.loop.time(), self._history.lost_sec
        try:
            return await call
        finally:
            took = self._history.loop.time() - began - (self._history.lost_sec - lost)
            assert took < CALL_SEC + 0.001, f"a call took {took} s"
