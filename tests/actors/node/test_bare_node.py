"""Bare nodes: nodes of their own in the graph, on the link of a node that runs."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import Int64, String
from broker import Broker, BrokerOptions
from broker.access.credentials import hash_token
from proto.wire.codes import EntryKind
from tests.actors.meeting import BARE, KEEP_ALL, MIB, latched, matched, turns, until
from tests.seams.brokers import without_capabilities

if TYPE_CHECKING:
    from pathlib import Path

    from tests.actors.meeting import Meeting

TOKEN = "cbt_" + "t" * 43


async def test_it_is_a_node_with_what_it_has_and_nothing_else(meeting: Meeting) -> None:
    """Name, labels and endpoints are in the graph; there are no standard endpoints, and the link is one."""
    owner = await meeting.node("owner", start_parameter_services=True, labels={"role": "bridge"})
    bare = owner.create_bare_node("talker", namespace="/robot", labels={"origin": "ros2/7"})
    assert await bare.wait_until_accepted()
    assert bare.get_fully_qualified_name() == "/robot/talker"
    bare.create_publisher(String, "news", latched(3))
    bare.create_subscription(String, "/news", lambda _: None)
    bare.create_service(AddTwoInts, "~/add", lambda _, response: response)
    bare.create_client(AddTwoInts, "add")
    await meeting.settled(owner)
    graph = await owner.get_graph()
    assert [(name, info.endpoint_type.name) for name, info in graph.node_endpoints("/robot/talker")] == [
        ("/robot/news", "PUBLISHER"),
        ("/news", "SUBSCRIPTION"),
        ("/robot/talker/add", "SERVICE"),
        ("/robot/add", "CLIENT"),
    ]
    assert graph.node_labels() == {"/owner": {"role": "bridge"}, "/robot/talker": {"origin": "ros2/7"}}
    assert (bare.labels, bare.apart, bare.refusal, bare.destroyed) == ({"origin": "ros2/7"}, "", "", False)
    assert len((await owner.get_broker_stats()).links) == 1


async def test_a_snapshot_tells_all_of_every_endpoint(meeting: Meeting) -> None:
    """Type, hash, QoS, node and its labels: exactly, although two nodes share the name."""
    owner = await meeting.node("owner")
    for labels, depth in (({}, 3), ({"origin": "ros2/7"}, 4)):
        bare = owner.create_bare_node("same", labels=labels, shared_name=True)
        bare.create_publisher(String, "/news", depth)
    await meeting.settled(owner)
    found = (await owner.get_graph()).all_endpoints()
    assert [(name, info.node_name, info.qos_profile.depth, info.node_labels) for name, info in found] == [
        ("/news", "same", 3, {}),
        ("/news", "same", 4, {"origin": "ros2/7"}),
    ]
    assert {(info.topic_type, info.topic_type_hash[:7]) for _, info in found} == {
        ("std_msgs/msg/String", "RIHS01_")
    }


async def test_messages_and_calls_work_as_for_any_node(meeting: Meeting) -> None:
    """Both ways, with another node and between bare nodes, encoded ones included."""
    owner, other = await meeting.node("owner"), await meeting.node("other")
    one, two = owner.create_bare_node("one"), owner.create_bare_node("two")
    got: list[object] = []
    two.create_subscription(Int64, "/numbers", lambda msg: got.append(msg.data))
    two.create_subscription(None, "/numbers", got.append, raw=True)
    two.create_service(AddTwoInts, "/add", lambda request: AddTwoInts.Response(sum=request.a + request.b))
    publisher, client = one.create_publisher(Int64, "/numbers"), one.create_client(AddTwoInts, "/add")
    await matched(publisher, 2)
    publisher.publish(Int64(data=7))
    await until(lambda: len(got) == 2)
    assert 7 in got
    assert (await client.call(AddTwoInts.Request(a=1, b=2))).sum == 3
    caller = other.create_client(AddTwoInts, "/add")
    assert (await caller.call(AddTwoInts.Request(a=3, b=4))).sum == 7


async def test_it_serves_actions_and_sends_goals(meeting: Meeting) -> None:
    """With feedback and a result, for a client on another link and for one of a bare node."""
    owner, other = await meeting.node("owner"), await meeting.node("other")

    def execute(goal: actors.ServerGoalHandle[Any, Any, Any]) -> Fibonacci.Result:
        goal.publish_feedback(Fibonacci.Feedback(sequence=[1]))
        goal.succeed()
        return Fibonacci.Result(sequence=[1, goal.request.order])

    owner.create_bare_node("server").create_action_server(Fibonacci, "/count", execute)
    for client in (other, owner.create_bare_node("client")):
        action = client.create_action_client(Fibonacci, "/count")
        assert await action.wait_for_server()
        goal = await action.send_goal(Fibonacci.Goal(order=7))
        assert (await goal.result()).result.sequence == [1, 7]


async def test_no_endpoint_matches_one_from_which_it_is_kept_apart(meeting: Meeting) -> None:
    """Counts stay 0 and a wait for the service ends without it; an ordinary node reaches both."""
    owner, other = await meeting.node("owner"), await meeting.node("other")
    one = owner.create_bare_node("one", apart="ros2/7")
    two = owner.create_bare_node("two", apart="ros2/7")
    publisher, client = one.create_publisher(Int64, "/numbers"), one.create_client(AddTwoInts, "/add")
    subscription = two.create_subscription(Int64, "/numbers")
    two.create_service(AddTwoInts, "/add", lambda _, response: response)
    reader = other.create_subscription(Int64, "/numbers")
    await matched(publisher)
    publisher.publish(Int64(data=7))
    await until(lambda: reader.queued == 1)
    await meeting.settled(owner, other)
    assert (subscription.peers, subscription.queued, client.peers) == (0, 0, 0)
    assert not await client.wait_for_service(0.0)
    assert await other.create_client(AddTwoInts, "/add").wait_for_service()


async def test_awaiting_handlers_of_bare_nodes_do_not_wait_for_each_other(meeting: Meeting) -> None:
    """With `concurrent`, a request and a message are handled while another handler is suspended."""
    owner = await meeting.node("owner")
    go = asyncio.Event()
    begun: list[str] = []

    async def serve(request: bytes) -> bytes:
        begun.append("request")
        await go.wait()
        return request

    async def read(_: bytes) -> None:
        begun.append("message")
        await go.wait()

    one, two = owner.create_bare_node("one"), owner.create_bare_node("two")
    one.create_service(AddTwoInts, "/one", serve, raw=True, concurrent=True)
    two.create_service(AddTwoInts, "/two", serve, raw=True, concurrent=True)
    two.create_subscription(None, "/numbers", read, raw=True, concurrent=True)
    publisher = one.create_publisher(Int64, "/numbers")
    await matched(publisher)
    clients = [owner.create_client(AddTwoInts, name) for name in ("/one", "/two")]
    calls = [asyncio.ensure_future(client.call(AddTwoInts.Request())) for client in clients]
    publisher.publish(Int64())
    await until(lambda: sorted(begun) == ["message", "request", "request"])
    go.set()
    await asyncio.gather(*calls)


async def test_a_refused_bare_node_says_why_and_all_others_go_on(meeting: Meeting) -> None:
    """A name that an unshared node has is refused to it and its endpoints; another name is accepted."""
    owner, _ = await meeting.node("owner"), await meeting.node("taken")
    reasons: list[str] = []
    bare = owner.create_bare_node("taken", shared_name=True, on_refused=reasons.append)
    publisher = bare.create_publisher(String, "/news")
    assert not await bare.wait_until_accepted()
    await until(lambda: bool(reasons and publisher.refusal))
    assert "A node named '/taken' is there already and does not share its name" in bare.refusal
    assert bare.name_taken
    assert publisher.refusal == reasons[0] == bare.refusal
    bare.destroy()
    again = owner.create_bare_node("taken_ros2", shared_name=True)
    assert await again.wait_until_accepted()
    assert owner.connected
    assert await owner.get_node_names() == ["owner", "taken", "taken_ros2"]


async def test_an_older_broker_does_not_get_nodes_that_it_cannot_keep_apart(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Their messages would come back: the bare node is refused, and others are accepted."""
    without_capabilities(monkeypatch)
    owner = await meeting.node("owner")
    bare = owner.create_bare_node("mirror", apart="ros2/7")
    subscription = bare.create_subscription(String, "/news")
    assert not await bare.wait_until_accepted()
    assert "does not know nodes that are kept apart; update it" in bare.refusal
    await until(lambda: subscription.refusal == bare.refusal)
    assert await owner.create_bare_node("plain").wait_until_accepted()
    assert await owner.get_node_names() == ["owner", "plain"]


async def test_destroying_one_sends_its_messages_first_and_frees_its_name(meeting: Meeting) -> None:
    """What it has published in the same turn arrives, and a new one has its unshared name at once."""
    owner, other = await meeting.node("owner"), await meeting.node("other")
    reader = other.create_subscription(Int64, "/numbers")
    for number in range(3):
        bare = owner.create_bare_node("talker")
        publisher = bare.create_publisher(Int64, "/numbers")
        assert await bare.wait_until_accepted()
        await matched(publisher)
        publisher.publish(Int64(data=number))
        bare.destroy()
        bare.destroy()
        assert bare.destroyed
        assert publisher.destroyed
        with pytest.raises(actors.NodeDestroyed):
            bare.create_publisher(Int64, "/numbers")
    early = owner.create_bare_node("talker")  # destroyed before the broker has answered
    early.create_publisher(Int64, "/numbers").publish(Int64(data=3))
    early.destroy()
    await until(lambda: reader.queued == 4)
    assert [(await anext(aiter(reader))).data for _ in range(4)] == [0, 1, 2, 3]
    await meeting.settled(owner)
    assert await owner.get_node_names() == ["other", "owner"]
    assert owner.connected


async def test_what_destroyed_endpoints_have_sent_precedes_its_end(meeting: Meeting) -> None:
    """A publisher and a service that are destroyed just before their node: message and reply arrive."""
    owner, other = await meeting.node("owner"), await meeting.node("other")
    reader = other.create_subscription(Int64, "/numbers")
    client = other.create_client(AddTwoInts, "/add")
    bare = owner.create_bare_node("talker")
    publisher = bare.create_publisher(Int64, "/numbers")

    def leave() -> None:
        publisher.publish(Int64(data=7))
        publisher.destroy()
        service.destroy()
        bare.destroy()

    def serve(request: AddTwoInts.Request) -> AddTwoInts.Response:
        asyncio.get_running_loop().call_soon(leave)
        return AddTwoInts.Response(sum=request.a)

    service = bare.create_service(AddTwoInts, "/add", serve)
    await matched(publisher)
    await client.wait_for_service()
    assert (await client.call(AddTwoInts.Request(a=7))).sum == 7
    assert (await anext(aiter(reader))).data == 7
    while "talker" in await owner.get_node_names():
        pass
    assert owner.diagnostics().connections == 1


async def test_publishers_that_come_and_go_leave_nothing_behind(meeting: Meeting) -> None:
    """Messages of one that went in an earlier session do not keep its node in the graph."""
    owner = await meeting.node("owner", shared_memory=False)
    other = await meeting.node("other", shared_memory=False)
    reader = other.create_subscription(String, "/texts", qos_profile=KEEP_ALL)
    bare = owner.create_bare_node("talker")
    publisher = bare.create_publisher(String, "/texts", KEEP_ALL)
    await matched(publisher)
    for number in range(12):  # the reader lets 8 MiB be sent
        publisher.publish(String(data=f"{number}" + "x" * MIB))
    publisher.destroy()
    await until(lambda: reader.queued >= 8)
    await meeting.stop_broker()
    await until(lambda: not owner.connected)
    await meeting.restart_broker()
    assert await bare.wait_until_accepted()
    bare.destroy()
    while "talker" in await owner.get_node_names():
        pass


async def test_messages_that_wait_for_credit_are_sent_before_it_leaves(meeting: Meeting) -> None:
    """A reader that takes nothing holds them back; the node stays in the graph until it does."""
    owner = await meeting.node("owner", shared_memory=False)
    other = await meeting.node("other", shared_memory=False)
    reader = other.create_subscription(String, "/texts", qos_profile=KEEP_ALL)
    bare = owner.create_bare_node("talker")
    publisher = bare.create_publisher(String, "/texts", KEEP_ALL)
    await matched(publisher)
    texts = [f"{number}" + "x" * MIB for number in range(12)]  # the reader lets 8 MiB be sent
    for text in texts:
        publisher.publish(String(data=text))
    bare.destroy()
    await until(lambda: reader.queued >= 8)
    await meeting.settled(owner, other)
    assert "talker" in await owner.get_node_names()
    stream = aiter(reader)
    assert [(await anext(stream)).data for _ in texts] == texts
    while "talker" in await owner.get_node_names():
        pass
    assert owner.connected


async def test_a_reply_is_sent_before_its_node_leaves(meeting: Meeting) -> None:
    """A handler that destroys its own bare node has answered the call."""
    owner, other = await meeting.node("owner"), await meeting.node("other")
    bare = owner.create_bare_node("server")

    def serve(request: AddTwoInts.Request) -> AddTwoInts.Response:
        asyncio.get_running_loop().call_soon(bare.destroy)
        return AddTwoInts.Response(sum=request.a)

    bare.create_service(AddTwoInts, "/add", serve)
    client = other.create_client(AddTwoInts, "/add")
    await client.wait_for_service()
    assert (await client.call(AddTwoInts.Request(a=7))).sum == 7
    while "server" in await owner.get_node_names():
        pass


async def test_every_session_declares_all_of_them_again(meeting: Meeting) -> None:
    """After a restart of the broker all are there, and one that was destroyed meanwhile is not."""
    owner = await meeting.node("owner")
    bare = [owner.create_bare_node(f"n{number}", labels={"n": str(number)}) for number in range(50)]
    endpoints = [each.create_publisher(Int64, f"/t{number}") for number, each in enumerate(bare)]
    assert all([await each.wait_until_accepted() for each in bare])
    await meeting.stop_broker()
    await until(lambda: not owner.connected)
    bare[7].destroy()
    await meeting.restart_broker()
    await until(lambda: owner.connected)
    alive = [each for each in bare if not each.destroyed]
    assert all([await each.wait_until_accepted() for each in alive])
    await meeting.settled(owner)
    graph = await owner.get_graph()
    assert len(graph.nodes()) == 50
    assert len(list(graph.of_kind(EntryKind.PUBLISHER))) == 49
    assert graph.node_labels()["/n9"] == {"n": "9"}
    assert endpoints[7].destroyed


async def test_it_ends_with_its_owner(meeting: Meeting) -> None:
    """Leaving the owner sends what was published; the bare node is destroyed, and waits on it end."""
    other = await meeting.node("other")
    reader = other.create_subscription(Int64, "/numbers")
    async with meeting.absent("owner") as owner:
        bare = owner.create_bare_node("talker")
        publisher = bare.create_publisher(Int64, "/numbers")
        await matched(publisher)
        publisher.publish(Int64(data=7))
    assert bare.destroyed
    await until(lambda: reader.queued == 1)
    while await other.get_node_names() != ["other"]:
        pass
    with pytest.raises(actors.NodeDestroyed):
        owner.create_bare_node("late")
    with pytest.raises((actors.NodeDestroyed, RuntimeError)):
        await bare.wait_until_accepted()


async def test_it_may_be_made_before_its_owner_runs(meeting: Meeting) -> None:
    """It is declared with the first session."""
    owner = meeting.absent("owner")
    bare = owner.create_bare_node("talker")
    bare.create_publisher(Int64, "/numbers")
    async with owner:
        assert await bare.wait_until_accepted()
        assert await owner.count_publishers("/numbers") == 1


async def test_errors_of_its_callbacks_are_handled_as_the_owners(meeting: Meeting) -> None:
    """They are counted there, and the drops of its subscriptions are in the owner's diagnostics."""
    owner = await meeting.node("owner")
    bare = owner.create_bare_node("reader")

    def fail(_: Int64) -> None:
        raise ValueError("wrong")

    bare.create_subscription(Int64, "/numbers", fail)
    idle = bare.create_subscription(Int64, "/numbers", qos_profile=1)
    publisher = owner.create_publisher(Int64, "/numbers")
    await matched(publisher, 2)
    for number in range(3):
        publisher.publish(Int64(data=number))
    await until(lambda: owner.callback_errors == 3)
    (found,) = [each for each in owner.diagnostics().subscriptions if each.id == idle.id]
    assert found.dropped == 2


async def test_no_rule_renames_it(meeting: Meeting) -> None:
    """Rules of the command line are for the owner; names are full, or relative to the bare node."""
    rules = ["--ros-args", "-r", "__node:=renamed", "-r", "__ns:=/ns", "-r", "/chatter:=/news"]
    owner = await meeting.node("owner", cli_args=rules)
    bare = owner.create_bare_node("talker", namespace="robot")
    assert owner.get_fully_qualified_name() == "/ns/renamed"
    assert bare.get_fully_qualified_name() == "/robot/talker"
    names = [bare.resolve_topic_name(name) for name in ("/chatter", "chatter", "~/chatter")]
    assert names == ["/chatter", "/robot/chatter", "/robot/talker/chatter"]


async def test_what_is_wrong_is_refused_at_once(meeting: Meeting) -> None:
    """Names, labels and overrides of a QoS that has no parameters; nothing is declared then."""
    owner = await meeting.node("owner")
    with pytest.raises(actors.InvalidNameError):
        owner.create_bare_node("a b")
    with pytest.raises(ValueError, match="a label's name is 1 to 64 letters"):
        owner.create_bare_node("a", labels={"": "x"})
    with pytest.raises(ValueError, match="apart is printable text"):
        owner.create_bare_node("a", apart="\n")
    with pytest.raises(ValueError, match="a label's name"):
        actors.Node("a", labels={"ü": "x"})
    bare = owner.create_bare_node("a")
    with pytest.raises(ValueError, match="a bare node has no parameters"):
        bare.create_publisher(Int64, "/t", qos_overriding_options=actors.QoSOverridingOptions([]))
    await turns()
    assert await owner.get_node_names() == ["a", "owner"]


def rules(*nodes: str) -> str:
    """Return rules with one user, and which names its nodes may have."""
    names = ", ".join(f'"{name}"' for name in nodes)
    rights = f'allow.node = [{names}]\nallow.publish = ["/robot/**"]\nallow.see = ["/**"]\n'
    return f'[users.robot]\ntokens = ["{hash_token(TOKEN)}"]\nroles = ["r"]\n[roles.r]\n{rights}'


async def test_access_rules_judge_it_as_any_node(tmp_path: Path) -> None:
    """Each name and topic for itself, also when rules change; what is refused says so, the rest works."""
    file = tmp_path / "access.toml"
    file.write_text(rules("/owner", "/robot/**"))
    async with (
        Broker(BrokerOptions(port=0, auth=file)) as broker,
        actors.Node("owner", url=broker.url, token=TOKEN, **BARE) as owner,
    ):
        reasons: list[str] = []
        allowed = owner.create_bare_node("talker", namespace="/robot", on_refused=reasons.append)
        refused = owner.create_bare_node("talker")
        good, bad = (allowed.create_publisher(Int64, name) for name in ("news", "/news"))
        served = allowed.create_service(AddTwoInts, "add", lambda _, response: response)
        assert await allowed.wait_until_accepted()
        assert not await refused.wait_until_accepted()
        acting = allowed.create_action_server(Fibonacci, "go", lambda _: Fibonacci.Result())
        await until(lambda: bool(bad.refusal and served.refusal and acting.refusal))
        assert "do not allow 'robot' to take the node name '/talker'" in refused.refusal
        assert "do not allow 'robot' to publish on '/news'" in bad.refusal
        assert "to serve '/robot/add'" in served.refusal
        assert "to serve '/robot/go/_action/" in acting.refusal
        assert good.refusal == ""
        assert await owner.get_node_names() == ["owner", "talker"]
        file.write_text(rules("/owner"))
        broker.reload()
        await until(lambda: bool(reasons and good.refusal))
        assert "to take the node name '/robot/talker'" in reasons[0]
        assert await owner.get_node_names() == ["owner"]
