"""Calls, messages and goals over HTTP."""

from __future__ import annotations

import asyncio
import json
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.message import definition
from actors.interfaces.runtime_types import runtime_service
from actors.interfaces.std_msgs.msg import Header, String
from actors.interfaces.tf2_msgs.msg import TFMessage
from actors.web import goals as goals_module
from actors.web.calls import RequestError, message_of
from tests.actors.meeting import DEADLINE_SEC, latched

if TYPE_CHECKING:
    import aiohttp

    from tests.actors.meeting import Meeting
    from tests.actors.web.site import Site

Handle = actors.ServerGoalHandle[Any, Any, Any]


async def _adder(meeting: Meeting) -> actors.Node:
    node = await meeting.node("adder")

    def add(request: AddTwoInts.Request, response: AddTwoInts.Response) -> AddTwoInts.Response:
        if request.a == 13:
            raise ValueError("an unlucky number")
        response.sum = request.a + request.b
        return response

    node.create_service(AddTwoInts, "add_two_ints", add)
    return node


async def test_a_form_and_a_call(control: Site, meeting: Meeting) -> None:
    """5 and 3 are 8."""
    await _adder(meeting)
    form = await control.json_found("/api/services/add_two_ints/form")
    assert form["type"] == "example_interfaces/srv/AddTwoInts"
    fields = form["form"]["types"][form["form"]["type"]]
    assert [(each["name"], each["kind"]) for each in fields] == [("a", "integer"), ("b", "integer")]
    body = {"request": {"a": 5, "b": 3}}
    assert await control.json("/api/services/add_two_ints", method="POST", json=body) == {
        "response": {"sum": 8}
    }


@pytest.mark.parametrize(
    ("body", "status", "text"),
    [
        ({"request": {"a": "five"}}, 400, "AddTwoInts_Request.a"),
        ({"request": {"a": 2**63}}, 400, "AddTwoInts_Request.a"),
        ({"request": {"c": 1}}, 400, "'c'"),
        ({"requests": {}}, 400, "requests"),
        ({"request": [1]}, 400, "request"),
        ({"timeout_sec": -1}, 400, "timeout_sec"),
        ({"request": {}, "type": "std_srvs/srv/Empty"}, 400, "type"),
        ({"request": {"a": 13}}, 502, "an unlucky number"),
    ],
)
async def test_a_call_that_fails_says_why(
    control: Site, meeting: Meeting, body: dict[str, Any], status: int, text: str
) -> None:
    """The field that does not fit, or what the handler raised."""
    await _adder(meeting)
    found = await control.json("/api/services/add_two_ints", status, method="POST", json=body)
    assert text in found["error"]


async def test_a_call_without_a_server_is_503_and_a_late_one_504(control: Site, meeting: Meeting) -> None:
    """The caller does not wait in vain; the handler is cancelled with the call."""
    found = await control.json("/api/services/nowhere", 503, method="POST", json={})
    assert "/nowhere" in found["error"]
    node, cancelled = await meeting.node("sleeper"), asyncio.Event()

    async def sleep(request: AddTwoInts.Request) -> AddTwoInts.Response:
        try:
            await asyncio.sleep(DEADLINE_SEC)
        finally:
            cancelled.set()
        return AddTwoInts.Response()

    node.create_service(AddTwoInts, "slow", sleep)
    async with asyncio.timeout(DEADLINE_SEC):
        while not cancelled.is_set():  # on a busy machine the time may be over before the handler begins
            await control.json("/api/services/slow", 504, method="POST", json={"timeout_sec": 0.1})


async def test_the_call_of_a_caller_that_has_gone_is_cancelled(control: Site, meeting: Meeting) -> None:
    """The handler is, too."""
    node, started, cancelled = await meeting.node("sleeper"), asyncio.Event(), asyncio.Event()

    async def sleep(request: AddTwoInts.Request) -> AddTwoInts.Response:
        started.set()
        try:
            await asyncio.sleep(DEADLINE_SEC)
        finally:
            cancelled.set()
        return AddTwoInts.Response()

    node.create_service(AddTwoInts, "slow", sleep)
    async with asyncio.timeout(DEADLINE_SEC):
        caller = asyncio.create_task(control.json("/api/services/slow", method="POST", json={}))
        await started.wait()
        caller.cancel()
        await cancelled.wait()


class Measure(actors.Service, type_name="web_tests/srv/Measure"):
    """A response whose values JSON's numbers cannot hold."""

    class Request(actors.Message):
        pass

    class Response(actors.Message):
        ratio: float = 0.0
        count: int = 0


class Watch(actors.Action, type_name="web_tests/action/Watch"):
    """Feedback and a result with such values, too."""

    class Goal(actors.Message):
        pass

    class Result(actors.Message):
        ratio: float = 0.0

    class Feedback(actors.Message):
        ratio: float = 0.0


async def test_values_that_json_lacks_are_texts(control: Site, meeting: Meeting) -> None:
    """In responses, feedback and results, as in echoed messages: none becomes null or another number."""
    node = await meeting.node("meter")

    def measure(_: Measure.Request, response: Measure.Response) -> Measure.Response:
        response.ratio, response.count = float("nan"), 2**60
        return response

    async def watch(goal: Handle) -> Watch.Result:
        goal.publish_feedback(Watch.Feedback(ratio=float("-inf")))
        goal.succeed()
        return Watch.Result(ratio=float("inf"))

    node.create_service(Measure, "measure", measure)
    node.create_action_server(Watch, "watch", watch)
    await control.json_found("/api/services/measure/form")
    found = await control.json("/api/services/measure", method="POST", json={})
    assert found == {"response": {"ratio": "nan", "count": str(2**60)}}
    await control.json_found("/api/actions/watch/form")
    async with control.client.post("/api/actions/watch", json={}) as response:
        events = [await _event(response) for _ in range(3)]
    assert events[1:] == [
        ("feedback", {"feedback": {"ratio": "-inf"}}),
        ("result", {"status": "SUCCEEDED", "result": {"ratio": "inf"}}),
    ]


async def test_a_service_of_a_type_that_is_not_installed(
    control: Site, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its form and its calls come from the definition that the server has declared."""
    described = definition(AddTwoInts).replace(b'"example_interfaces/', b'"not_installed_here/')
    whole = json.loads(described)
    whole["referenced_type_descriptions"].sort(key=lambda each: str(each["type_name"]))
    foreign: Any = runtime_service(json.dumps(whole).encode())
    # Not even the server's own is found.
    monkeypatch.setattr("actors.tools.graph_types.installed_interface", lambda _: None)
    node = await meeting.node("adder")
    node.create_service(
        foreign, "foreign_add", lambda request, _: foreign.Response(sum=request.a + request.b)
    )
    form = await control.json_found("/api/services/foreign_add/form")
    assert form["type"] == "not_installed_here/srv/AddTwoInts"
    body = {"request": {"a": 2, "b": 4}}
    found = await control.json("/api/services/foreign_add", method="POST", json=body)
    assert found == {"response": {"sum": 6}}


async def test_a_message_reaches_those_who_listen(control: Site, meeting: Meeting) -> None:
    """Also through a latched subscription; `now` becomes the time."""
    node, received = await meeting.node("listener"), asyncio.Queue[Any]()
    node.create_subscription(String, "chatter", received.put_nowait, latched(1))
    node.create_subscription(Header, "stamped", received.put_nowait)
    async with asyncio.timeout(DEADLINE_SEC):
        found = await control.json("/api/topics/chatter", method="POST", json={"message": {"data": "hello"}})
        assert found == {"subscriptions": 1}
        assert (await received.get()).data == "hello"
        async with control.client.get("/api/topics/chatter/echo"):  # a reader of the page is not counted
            again = await control.json("/api/topics/chatter", method="POST", json={"message": {"data": "2"}})
        assert (again, (await received.get()).data) == ({"subscriptions": 1}, "2")
        await control.json("/api/topics/stamped", method="POST", json={"message": {"stamp": "now"}})
        assert (await received.get()).stamp.sec > 0
    found = await control.json(
        "/api/topics/chatter", 400, method="POST", json={"message": {"data": 1.5, "x": 1}}
    )
    assert "'x'" in found["error"]
    found = await control.json("/api/topics/new", 400, method="POST", json={})
    assert "type" in found["error"]
    body = {"type": "std_msgs/msg/String"}
    assert await control.json("/api/topics/new", method="POST", json=body) == {"subscriptions": 0}


class Counting:
    """An action server whose goals end when the test says so."""

    def __init__(self, node: actors.Node) -> None:
        self.goals: asyncio.Queue[Handle] = asyncio.Queue()
        self.proceed = asyncio.Event()
        self.cancelled = asyncio.Event()
        node.create_action_server(
            Fibonacci,
            "count",
            self._execute,
            goal_callback=self._decide,
            cancel_callback=self._cancel,
        )

    def _decide(self, goal: Fibonacci.Goal) -> actors.GoalResponse:
        return actors.GoalResponse.ACCEPT if goal.order >= 0 else actors.GoalResponse.REJECT

    def _cancel(self, goal: Handle) -> actors.CancelResponse:
        self.cancelled.set()
        self.proceed.set()
        return actors.CancelResponse.ACCEPT

    async def _execute(self, goal: Handle) -> Fibonacci.Result:
        self.goals.put_nowait(goal)
        for number in range(goal.request.order):
            goal.publish_feedback(Fibonacci.Feedback(sequence=[number]))
        await self.proceed.wait()
        if goal.is_cancel_requested:
            goal.canceled()
        else:
            goal.succeed()
        return Fibonacci.Result(sequence=[goal.request.order])


async def _event(response: aiohttp.ClientResponse) -> tuple[str, Any]:
    async with asyncio.timeout(DEADLINE_SEC):
        kind = (await response.content.readline()).decode().removeprefix("event: ").strip()
        data = (await response.content.readline()).decode().removeprefix("data: ")
        await response.content.readline()
    return kind, json.loads(data)


async def test_a_goal_moves_and_ends(control: Site, meeting: Meeting) -> None:
    """Accepted, feedback, result."""
    server = Counting(await meeting.node("counter"))
    form = await control.json_found("/api/actions/count/form")
    assert form["type"] == "example_interfaces/action/Fibonacci"
    async with control.client.post("/api/actions/count", json={"goal": {"order": 2}}) as response:
        assert response.content_type == "text/event-stream"
        kind, accepted = await _event(response)
        assert kind == "accepted"
        assert [await _event(response) for _ in range(2)] == [
            ("feedback", {"feedback": {"sequence": [number]}}) for number in range(2)
        ]
        listed = await control.json("/api/actions/count/goals")
        assert [each["goal_id"] for each in listed] == [accepted["goal_id"]]
        server.proceed.set()
        assert await _event(response) == ("result", {"status": "SUCCEEDED", "result": {"sequence": [2]}})
        assert await response.content.read() == b""
    assert await control.json("/api/actions/count/goals") == []


async def test_a_goal_is_cancelled(control: Site, meeting: Meeting) -> None:
    """The stream ends with what the server made of it; a goal that has ended is not known."""
    Counting(await meeting.node("counter"))
    await control.json_found("/api/actions/count/form")
    async with control.client.post("/api/actions/count", json={"goal": {"order": 0}}) as response:
        _, accepted = await _event(response)
        path = f"/api/actions/count/goals/{accepted['goal_id']}"
        assert (await control.json(path, method="DELETE"))["canceling"]
        assert (await _event(response))[1]["status"] == "CANCELED"
    assert accepted["goal_id"] in (await control.json(path, 404, method="DELETE"))["error"]


async def test_a_goal_that_is_rejected_or_has_no_server(control: Site, meeting: Meeting) -> None:
    """The answer is an error, not a stream."""
    found = await control.json("/api/actions/count", 503, method="POST", json={})
    assert "no server" in found["error"]
    Counting(await meeting.node("counter"))
    await control.json_found("/api/actions/count/form")
    found = await control.json("/api/actions/count", 409, method="POST", json={"goal": {"order": -1}})
    assert "rejected" in found["error"]
    found = await control.json("/api/actions/count", 400, method="POST", json={"goal": {"order": "x"}})
    assert "Fibonacci_Goal.order" in found["error"]


@pytest.mark.parametrize("cancel", [False, True])
async def test_the_goal_of_a_browser_that_has_gone_goes_on(
    control: Site, meeting: Meeting, *, cancel: bool
) -> None:
    """It is cancelled only if that was asked for."""
    server = Counting(await meeting.node("counter"))
    await control.json_found("/api/actions/count/form")
    body = {"goal": {"order": 0}, "cancel_on_close": cancel}
    async with control.client.post("/api/actions/count", json=body) as response:
        await _event(response)
        response.close()
    if cancel:
        async with asyncio.timeout(DEADLINE_SEC):
            await server.cancelled.wait()
    else:
        goal = (await control.json("/api/actions/count/goals"))[0]
        assert not server.cancelled.is_set()
        await control.json(f"/api/actions/count/goals/{goal['goal_id']}", method="DELETE")


async def test_followed_goals_are_bounded(
    control: Site, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One more makes room for itself if somebody has left; else it is refused."""
    monkeypatch.setattr(goals_module, "MAX_GOALS", 1)
    Counting(await meeting.node("counter", stop_timeout_sec=0.2))
    await control.json_found("/api/actions/count/form")
    async with control.client.post("/api/actions/count", json={}) as response:
        _, first = await _event(response)
        found = await control.json("/api/actions/count", 503, method="POST", json={})
        assert "1 goals" in found["error"]
        response.close()
    async with asyncio.timeout(DEADLINE_SEC):
        while True:
            async with control.client.post("/api/actions/count", json={}) as response:
                if response.status == 200:  # the server has noticed that the first reader has gone
                    _, second = await _event(response)
                    break
    listed = await control.json("/api/actions/count/goals")
    assert [each["goal_id"] for each in listed] == [second["goal_id"]] != [first["goal_id"]]


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("POST", "/api/services/add_two_ints"),
        ("POST", "/api/topics/chatter"),
        ("POST", "/api/actions/count"),
        ("DELETE", "/api/actions/count/goals/0"),
    ],
)
async def test_nothing_is_controlled_without_permission(
    site: Site, control: Site, method: str, path: str
) -> None:
    """A read-only server says so; one that allows control wants the token."""
    assert "read-only" in (await site.json(path, 403, method=method))["error"]
    found = await control.json(path, 401, method=method, headers={"Authorization": "Bearer wrong"})
    assert "token" in found["error"]


async def test_the_session_says_what_is_allowed(site: Site, control: Site) -> None:
    """With the token, without it, and on a read-only server."""
    assert (await control.json("/api/session"))["control"] is True
    wrong = await control.json("/api/session", headers={"Authorization": "Bearer wrong"})
    assert (wrong["control"], "token" in wrong["refusal"]) == (False, True)
    found = await site.json("/api/session")
    assert (found["control"], "--allow-control" in found["refusal"]) == (False, True)
    assert found["token_needed"] is False
    assert found["target"] == site.observer.target


def test_values_that_leave_out_too_much_are_refused() -> None:
    """Case 62: as in a message that arrives; fewer of them are a message with defaults."""
    with pytest.raises(RequestError, match="write every field of a large message"):
        message_of(TFMessage, {"transforms": [{}] * 100_000})
    assert len(message_of(TFMessage, {"transforms": [{}] * 9000}).transforms) == 9000
