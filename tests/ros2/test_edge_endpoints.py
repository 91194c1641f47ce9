"""The endpoints that a bridge shows in ROS 2, against nodes of a real process."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces import cdr
from actors.interfaces.action_msgs.msg import GoalStatusArray
from actors.interfaces.message import type_hash
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import SetBool
from actors.qos.profile import DurabilityPolicy, QoSProfile
from tests.ros2.ros import WAIT_SEC, interface

if TYPE_CHECKING:
    from tests.ros2.edge import Edge
    from tests.ros2.ros import Ros


async def test_a_mirror_subscription_takes_bytes_with_their_publisher_and_stamp(
    edge: Edge, ros: Ros, name: str
) -> None:
    """Messages arrive in order as CDR, with the sequence numbers and the gid of a publisher of that node."""
    there = await ros.node(f"{name}_there")
    publisher = await there.publisher(f"/{name}", String)
    subscription = await edge.subscription(await edge.mirror(f"/{name}/mirror"), f"/{name}", String)
    await publisher.matched()
    before = await ros.ask("now_ns")
    await publisher.publish(String(data="one"), String(data="two"))
    found = await edge.received(subscription, 2)
    assert [cdr.decode(String, bytes.fromhex(each[0])).data for each in found] == ["one", "two"]
    assert [each[2] for each in found] == [1, 2]
    assert found[0][3] >= before
    await edge.graph((there.name, "publisher", f"/{name}"))
    assert await edge.ask("node_of", f"/{name}", found[0][1]) == there.name
    assert await edge.ask("node_of", f"/{name}", "00" * 16) == ""


async def test_a_mirror_publisher_sends_bytes(edge: Edge, ros: Ros, name: str) -> None:
    """A real subscription gets what was given as CDR; the mirror's own subscription of the topic does not."""
    there = await ros.node(f"{name}_there")
    subscription = await there.subscription(f"/{name}", String)
    node = await edge.mirror(f"/{name}/mirror")
    publisher = await edge.publisher(node, f"/{name}", String)
    own = await edge.subscription(node, f"/{name}", String)
    await edge.matched(publisher)
    await edge.publish(publisher, String(data="one"))
    assert await subscription.received(1) == [String(data="one")]
    assert await edge.ask("matched", own, 0, WAIT_SEC) == 0
    assert await edge.ask("received", own, 0, WAIT_SEC) == []


async def test_a_subscription_that_is_only_shown_keeps_what_arrives(edge: Edge, ros: Ros, name: str) -> None:
    """Once it listens, it takes its depth of messages, in shares: other work of the loop comes between."""
    there = await ros.node(f"{name}_there")
    publisher = await there.publisher(f"/{name}", String, QoSProfile(depth=40))
    node = await edge.mirror(f"/{name}/mirror")
    subscription = await edge.subscription(node, f"/{name}", String, QoSProfile(depth=40), listens=False)
    await publisher.matched()
    await publisher.publish(*(String(data=str(number)) for number in range(40)))
    await publisher.acknowledged()
    assert await edge.ask("received", subscription, 0, WAIT_SEC) == []
    await edge.ask("listen", subscription)
    assert len(await edge.received(subscription, 40)) == 40
    assert await edge.ask("turns", subscription) == [16, 16, 8]


async def test_an_exception_of_a_callback_is_reported(edge: Edge, ros: Ros, name: str) -> None:
    """The messages after it are taken all the same."""
    there = await ros.node(f"{name}_there")
    publisher = await there.publisher(f"/{name}", String)
    subscription = await edge.subscription(await edge.mirror(f"/{name}/mirror"), f"/{name}", String)
    await publisher.matched()
    await publisher.publish(String(data="one"), String(data="raise"), String(data="two"))
    assert len(await edge.received(subscription, 3)) == 3
    assert await edge.ask("errors", 1, WAIT_SEC) == ["as the test wanted"]


async def test_a_mirror_service_answers_whenever_it_wants(edge: Edge, ros: Ros, name: str) -> None:
    """Requests are taken at once, and their responses may be sent later and in another order."""
    there = await ros.node(f"{name}_there")
    service = await edge.ask(
        "service", await edge.mirror(f"/{name}/mirror"), f"/{name}", "std_srvs/srv/SetBool"
    )
    client = await there.client(f"/{name}", SetBool)
    assert await client.is_ready()
    calls = await client.send(SetBool.Request(data=False), SetBool.Request(data=True))
    requests = await edge.ask("requests", service, 2, WAIT_SEC)
    assert [cdr.decode(SetBool.Request, bytes.fromhex(each)).data for each in requests] == [False, True]
    for place in (1, 0):
        response = SetBool.Response(success=True, message=str(place))
        await edge.ask("respond", service, place, cdr.encode(response).hex())
        await client.responses(calls, 2 - place)
    responses = await client.responses(calls, 2)
    assert {place: each.message for place, each in responses.items()} == {0: "0", 1: "1"}


async def test_the_queue_of_a_service_grows_with_its_requests(edge: Edge, ros: Ros, name: str) -> None:
    """It takes no memory for requests that have not arrived, and a burst that arrives at once is not lost."""
    node = await edge.mirror(f"/{name}/mirror")
    assert await edge.ask("memory_of_services", node, 30) < 90  # 130 by default, 38 here
    service = await edge.ask("service", node, f"/{name}", "std_srvs/srv/SetBool")
    client = await (await ros.node(f"{name}_there")).client(f"/{name}", SetBool)
    assert await client.is_ready()
    asked = [number % 3 == 0 for number in range(60)]
    # Before the service knows the client, it gets only the last ten, which the client keeps for that.
    await client.send(SetBool.Request(data=asked[0]))
    await edge.ask("requests", service, 1, WAIT_SEC)
    await client.send(*[SetBool.Request(data=each) for each in asked[1:]])
    requests = await edge.ask("requests", service, len(asked), WAIT_SEC)
    assert [cdr.decode(SetBool.Request, bytes.fromhex(each)).data for each in requests] == asked


async def test_a_mirror_client_calls_a_real_server(edge: Edge, ros: Ros, name: str) -> None:
    """The response carries the sequence number of its request."""
    there = await ros.node(f"{name}_there")
    await there.service(f"/{name}", SetBool, SetBool.Response(success=True, message="yes"))
    client = await edge.ask(
        "client", await edge.mirror(f"/{name}/mirror"), f"/{name}", "std_srvs/srv/SetBool"
    )
    for data in (True, False):
        response = await edge.ask("call", client, cdr.encode(SetBool.Request(data=data)).hex(), WAIT_SEC)
        assert cdr.decode(SetBool.Response, bytes.fromhex(response)).message == "yes"
    # A client may have found the server before the graph shows it.
    while not (found := await edge.ask("request_hash", f"/{name}")):
        await asyncio.sleep(0.05)
    assert found == type_hash(SetBool.Request)
    assert await edge.ask("request_hash", f"/{name}/none") == ""


async def test_an_action_is_called_by_its_services_and_topics(edge: Edge, ros: Ros, name: str) -> None:
    """A real action server accepts a goal, publishes feedback and status, and gives the result."""
    cls = interface("test_msgs/action/Fibonacci")
    there = await ros.node(f"{name}_there")
    await there.action_server(f"/{name}", cls, cls.Result(sequence=[0, 1, 1]), [cls.Feedback(sequence=[0])])
    node = await edge.mirror(f"/{name}/mirror")
    inside = f"/{name}/_action"
    sending = await edge.ask("client", node, f"{inside}/send_goal", "test_msgs/action/Fibonacci_SendGoal")
    asking = await edge.ask("client", node, f"{inside}/get_result", "test_msgs/action/Fibonacci_GetResult")
    qos = dict(QoSProfile(depth=10).to_wire())
    feedback = await edge.ask(
        "subscription", node, f"{inside}/feedback", "test_msgs/action/Fibonacci_FeedbackMessage", qos
    )
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    status = await edge.subscription(node, f"{inside}/status", GoalStatusArray, latched)
    await edge.matched(feedback)
    found: list[list[str]] = []
    for number in range(20):  # the server may match the subscription to feedback after the first goals
        goal = cls.Impl.SendGoalService.Request(goal=cls.Goal(order=2))
        goal.goal_id.uuid = bytes([number] * 16)
        answer = await edge.ask("call", sending, cdr.encode(goal).hex(), WAIT_SEC)
        assert cdr.decode(cls.Impl.SendGoalService.Response, bytes.fromhex(answer)).accepted
        wanted = cls.Impl.GetResultService.Request(goal_id=goal.goal_id)
        answer = await edge.ask("call", asking, cdr.encode(wanted).hex(), WAIT_SEC)
        result = cdr.decode(cls.Impl.GetResultService.Response, bytes.fromhex(answer))
        assert list(result.result.sequence) == [0, 1, 1]
        found = await edge.ask("received", feedback, 1, 1.0)
        if found:
            break
    assert list(cdr.decode(cls.Impl.FeedbackMessage, bytes.fromhex(found[0][0])).feedback.sequence) == [0]
    await edge.received(status, 1)


async def test_a_real_action_client_reaches_mirrors(edge: Edge, ros: Ros, name: str) -> None:
    """It finds an action server in three services and two topics, and gets their answers."""
    cls = interface("test_msgs/action/Fibonacci")
    there = await ros.node(f"{name}_there")
    node = await edge.mirror(f"/{name}/mirror")
    inside = f"/{name}/_action"
    sending = await edge.ask("service", node, f"{inside}/send_goal", "test_msgs/action/Fibonacci_SendGoal")
    asking = await edge.ask("service", node, f"{inside}/get_result", "test_msgs/action/Fibonacci_GetResult")
    await edge.ask("service", node, f"{inside}/cancel_goal", "action_msgs/srv/CancelGoal")
    feedback_type = "test_msgs/action/Fibonacci_FeedbackMessage"
    await edge.ask(
        "publisher", node, f"{inside}/feedback", feedback_type, dict(QoSProfile(depth=10).to_wire())
    )
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    await edge.publisher(node, f"{inside}/status", GoalStatusArray, latched)
    client = await there.action_client(f"/{name}", cls)
    assert await client.is_ready()
    goal = await client.send(cls.Goal(order=9))
    (request,) = await edge.ask("requests", sending, 1, WAIT_SEC)
    assert cdr.decode(cls.Impl.SendGoalService.Request, bytes.fromhex(request)).goal.order == 9
    accepted = cls.Impl.SendGoalService.Response(accepted=True)
    await edge.ask("respond", sending, 0, cdr.encode(accepted).hex())
    await edge.ask("requests", asking, 1, WAIT_SEC)
    result = cls.Impl.GetResultService.Response(status=4, result=cls.Result(sequence=[5]))
    await edge.ask("respond", asking, 0, cdr.encode(result).hex())
    state = await goal.state("result")
    assert list(state["result"].sequence) == [5]


@pytest.mark.parametrize(
    ("function", "args", "text"),
    [
        ("mirror", ("/9x",), "ROS 2 refuses the node '/9x': Invalid node name"),
        ("mirror", ("/a//b",), "ROS 2 refuses the node '/a//b': Invalid namespace"),
        (
            "publisher",
            ("/9x", "std_msgs/msg/String"),
            "ROS 2 refuses a publisher of '/9x': Invalid topic name",
        ),
        ("subscription", ("/a b", "std_msgs/msg/String"), "ROS 2 refuses a subscription to '/a b': Invalid"),
        ("service", ("/9x", "std_srvs/srv/SetBool"), "ROS 2 refuses a service '/9x': Invalid service name"),
        ("client", ("/9x", "std_srvs/srv/SetBool"), "ROS 2 refuses a client of '/9x': Invalid service name"),
    ],
)
async def test_names_that_ros_refuses(
    edge: Edge, name: str, function: str, args: tuple[Any, ...], text: str
) -> None:
    """One error names what was wanted and why it is refused."""
    if function != "mirror":
        args = (await edge.mirror(f"/{name}"), *args)
    if function in {"publisher", "subscription"}:
        args = (*args, dict(QoSProfile(depth=1).to_wire()))
    assert (await edge.error_of(function, *args)).startswith(text)


async def test_a_second_type_of_a_topic_is_refused(edge: Edge, name: str) -> None:
    """A participant has one type for a topic, and the error says so."""
    node = await edge.mirror(f"/{name}")
    await edge.publisher(node, f"/{name}/topic", String)
    qos = dict(QoSProfile(depth=1).to_wire())
    text = await edge.error_of("publisher", node, f"/{name}/topic", "std_msgs/msg/Bool", qos)
    assert text.startswith(f"ROS 2 refuses a publisher of '/{name}/topic': ")


async def test_the_limit_of_open_files_is_named(edge: Edge, ros: Ros, name: str) -> None:
    """The endpoint that needs one more is refused, and is not in the graph; later ones work."""
    there = await ros.node(f"{name}_there")
    publisher = await there.publisher(f"/{name}", String)
    node = await edge.mirror(f"/{name}/mirror")
    await edge.subscription(node, f"/{name}/first", String)  # loads the type, from files
    limit = await edge.ask("use_up_files")
    qos = dict(QoSProfile(depth=10).to_wire())
    try:
        text = await edge.error_of("subscription", node, f"/{name}", "std_msgs/msg/String", qos)
    finally:
        await edge.ask("allow_files", limit)
    assert "raise the limit of open files (ulimit -n)" in text
    await publisher.matched(0)
    subscription = await edge.subscription(node, f"/{name}", String)
    await publisher.matched()
    await publisher.publish(String(data="one"))
    await edge.received(subscription, 1)
