"""A whole bridge between a broker and a stand-in for ROS 2."""

from __future__ import annotations

import asyncio
import os
import sys
from functools import partial
from types import ModuleType
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.bridges.counters import Counters
from actors.bridges.graph import SideGraph, our_graph
from actors.bridges.planning_budget import PlanningBudget
from actors.bridges.ros2 import bridge as bridge_module
from actors.bridges.ros2.bridge import Bridge
from actors.bridges.ros2.errors import SuspendedError, UnknownTypeError
from actors.bridges.ros2.message_taker import RosMessageInfo
from actors.bridges.ros2.types import MessageTypes, ServiceTypes, TypePair
from actors.bridges.rules import Rules
from actors.endpoints.service.service import ServiceServer
from actors.interfaces import cdr
from actors.interfaces.message import type_hash
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import SetBool
from actors.node.bare_node import BareNode
from actors.qos.profile import DurabilityPolicy, QoSProfile
from proto.aio.tasks import cancel_and_wait
from proto.wire.codes import EntryKind
from tests.actors.bridges.ros2_stand_in import Network, make_ros
from tests.actors.meeting import latched, until

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from actors.graph.snapshot import GraphSnapshot
    from tests.actors.bridges.ros2_stand_in import Shown
    from tests.actors.meeting import Meeting

pytestmark = pytest.mark.skipif(not hasattr(os, "eventfd"), reason="needs eventfd")

PUBLISHER, SUBSCRIPTION = EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION
SERVICE, CLIENT = EntryKind.SERVICE, EntryKind.CLIENT
STRING, SET_BOOL = "std_msgs/msg/String", "std_srvs/srv/SetBool"
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Types:
    """Both sides have the same classes."""

    def known(self, name: str) -> TypePair:
        if name == STRING:
            return TypePair(name, "msg", String, String, type_hash(String), type_hash(String))
        if name == SET_BOOL:
            return TypePair(name, "srv", SetBool, SetBool, type_hash(SetBool), "", type_hash(SetBool.Request))
        return TypePair(name, "msg", None, None, reason=f"there is no {name}")

    def message(self, name: str) -> MessageTypes:
        if name != STRING:
            raise UnknownTypeError(name)
        return MessageTypes(String, String)

    def service(self, name: str) -> ServiceTypes:
        assert name == SET_BOOL
        parts = [MessageTypes(each, each) for each in (SetBool.Request, SetBool.Response)]
        return ServiceTypes(SetBool, SetBool, *parts)


class Between:
    """A bridge, its networks and a node of callboard."""

    def __init__(self, here: actors.Node, network: Network, bridge: Bridge) -> None:
        self.here = here
        self.network = network
        self.bridge = bridge

    def shown(self, side: str) -> tuple[int, int]:
        """Return how many nodes and endpoints the bridge shows on a side."""
        found = self.bridge.document()["shown"][side]
        return found["nodes"], found["endpoints"]

    def native(self, node: str, *endpoints: tuple[EntryKind, str, str]) -> list[Shown]:
        """Show a native node of ROS 2, whose endpoints do not tell hashes."""
        made = self.network.show(node, *endpoints)
        for each in made:
            each.type_hash = ""
        return made

    def send(self, gid: bytes, text: str, number: int, topic: str = "/up") -> None:
        """Let a message of ROS 2 arrive at the bridge."""
        message = cdr.encode(String(data=text)), RosMessageInfo(gid, number, number, number)
        self.network.arrive(self.network.pointers[SUBSCRIPTION, topic], message)


@pytest.fixture
async def between(meeting: Meeting, monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Between]:
    """A running bridge."""
    serialization: Any = ModuleType("rclpy.serialization")
    serialization.serialize_message = cdr.encode
    serialization.deserialize_message = lambda data, cls: cdr.decode(cls, data)
    monkeypatch.setitem(sys.modules, "rclpy.serialization", serialization)
    monkeypatch.setattr(bridge_module, "Types", Types)
    network = Network()
    node = await meeting.node("bridge")
    bridge = Bridge(node, make_ros(network), Rules(), Counters(), bridge_id="one", domain_id=7)
    running = asyncio.create_task(bridge.run())
    yield Between(await meeting.node("here"), network, bridge)
    await cancel_and_wait(running)


async def test_topics_cross_while_somebody_listens(between: Between) -> None:
    """A node of each side is shown on the other; messages arrive, and nothing is left once they have gone."""
    received: list[str] = []
    subscription = between.here.create_subscription(
        String, "/up", lambda each: received.append(each.data), 10
    )
    publisher = between.here.create_publisher(String, "/down", 10)
    up, _ = between.native("/native", (PUBLISHER, "/up", STRING), (SUBSCRIPTION, "/down", STRING))
    await until(lambda: between.shown("callboard") == (1, 2) and between.shown("ros2") == (1, 2))
    await until(lambda: between.network.pointers[SUBSCRIPTION, "/up"] in between.network.eventfds)
    between.send(up.gid, "one", 1)
    await until(lambda: received == ["one"])
    await publisher.wait_for_subscriptions(1)
    publisher.publish(String(data="two"))
    await until(lambda: cdr.encode(String(data="two")) in between.network.published)
    subscription.destroy()
    await until(lambda: not between.network.eventfds)
    publisher.destroy()
    await until(lambda: between.shown("ros2") == (0, 0))
    between.network.leave("/native")
    await until(lambda: between.shown("callboard") == (0, 0))


async def test_reading_and_planning_have_a_budget(
    meeting: Meeting, monkeypatch: pytest.MonkeyPatch, between: Between
) -> None:
    """What they cost is counted, and the bridge asks how long to pause before it reads or plans again."""
    asked: list[str] = []

    class Budget(PlanningBudget):
        def spend(self, now: float, seconds: float) -> None:
            asked.append("spend")
            super().spend(now, seconds)

        def pause(self, now: float) -> float:
            asked.append("pause")
            return super().pause(now)

    monkeypatch.setattr(bridge_module, "PlanningBudget", Budget)
    node, network = await meeting.node("second"), Network()
    bridge = Bridge(node, make_ros(network), Rules(), Counters(), bridge_id="two", domain_id=8)
    running = asyncio.create_task(bridge.run())
    between.here.create_publisher(String, "/down", 10)
    await until(lambda: bridge.document()["shown"]["ros2"]["endpoints"] == 1)
    await until(lambda: asked.count("spend") > 1 and asked[-1] == "pause")
    await cancel_and_wait(running)


async def test_the_last_words_of_a_second_clock_do_not_cross(between: Between) -> None:
    """What a second clock here has published is dropped, and not sent to ROS 2 when it leaves."""
    bare = [between.here.create_bare_node(name) for name in ("a", "b")]
    first, second = [each.create_publisher(String, "/clock", 10) for each in bare]
    between.native("/native", (SUBSCRIPTION, "/clock", STRING))
    await first.wait_for_subscriptions(1)
    await second.wait_for_subscriptions(1)
    second.publish(String(data="second"))
    await until(lambda: "its publisher does not cross" in str(between.bridge.document()["topics"]))
    bare[1].destroy()
    await until(lambda: not between.bridge.document()["refusals"])
    first.publish(String(data="first"))
    await until(lambda: cdr.encode(String(data="first")) in between.network.published)
    assert cdr.encode(String(data="second")) not in between.network.published


async def test_a_second_clock_of_ros_begins_with_its_next_time(between: Between) -> None:
    """When the first one has left; what it has published before is dropped."""
    received: list[str] = []
    between.here.create_subscription(String, "/clock", lambda each: received.append(each.data), 10)
    between.native("/a", (PUBLISHER, "/clock", STRING))
    (second,) = between.native("/b", (PUBLISHER, "/clock", STRING))
    await until(lambda: between.bridge.document()["refusals"] and between.network.eventfds)
    between.send(second.gid, "old", 1, "/clock")
    await until(lambda: "its publisher does not cross" in str(between.bridge.document()["topics"]))
    between.network.leave("/a")
    await until(lambda: not between.bridge.document()["refusals"])
    between.send(second.gid, "new", 2, "/clock")
    await until(lambda: received)
    assert received == ["new"]


async def test_publishers_with_different_offers(between: Between) -> None:
    """Each message is received once, by the subscription that fits its publisher's offer."""
    received: list[str] = []
    between.here.create_subscription(String, "/up", lambda each: received.append(each.data), LATCHED)
    (plain,) = between.native("/plain", (PUBLISHER, "/up", STRING))
    (latched,) = between.native("/latched", (PUBLISHER, "/up", STRING))
    latched.qos = LATCHED
    await until(lambda: len(between.network.eventfds) == 2)
    for number, (gid, text) in enumerate(((plain.gid, "plain"), (latched.gid, "latched")), 1):
        data = cdr.encode(String(data=text)), RosMessageInfo(gid, number, number, number)
        for pointer in tuple(between.network.eventfds):
            between.network.arrive(pointer, data)
    await until(lambda: sorted(received) == ["latched", "plain"])


async def test_calls_cross(between: Between) -> None:
    """A service of each side is called from the other."""

    def answer(request: Any, response: Any) -> Any:
        response.success = request.data
        return response

    between.here.create_service(SetBool, "/here", answer)
    between.native("/native", (SERVICE, "/there", SET_BOOL), (CLIENT, "/here", SET_BOOL))
    client = between.here.create_client(SetBool, "/there")
    await client.wait_for_service()
    call = asyncio.create_task(client.call(SetBool.Request(data=True)))
    await until(lambda: SetBool.Request(data=True) in between.network.published)
    header: Any = ModuleType("header")
    header.request_id = ModuleType("request_id")
    header.request_id.sequence_number = between.network.published.index(SetBool.Request(data=True)) + 1
    header.request_id.writer_guid = bytes(16)
    pointer = between.network.pointers[CLIENT, "/there"]
    between.network.arrive(pointer, (header, SetBool.Response(success=True)))
    assert (await call).success
    await until(lambda: (SERVICE, "/here") in between.network.pointers)
    between.network.arrive(between.network.pointers[SERVICE, "/here"], (SetBool.Request(data=True), header))
    wanted = SetBool.Response(success=True), header.request_id
    await until(lambda: wanted in between.network.published)
    between.network.leave("/native")
    await until(lambda: between.shown("callboard") == (0, 0))


async def test_what_ros_refuses_is_reported(between: Between) -> None:
    """It concerns one name; a type that callboard does not have is a refusal."""
    between.native("/native", (SUBSCRIPTION, "/down", STRING), (PUBLISHER, "/odd", "odd/msg/Odd"))
    between.network.refuses = RuntimeError("no memory")
    between.here.create_publisher(String, "/down", 10)
    await until(lambda: "no memory" in str(between.bridge.document()))
    assert "there is no odd/msg/Odd" in str(between.bridge.document())


async def test_a_node_that_is_back_has_the_mirror_that_lingers(between: Between) -> None:
    """ROS 2 mixes up endpoints of two nodes of one name in one process: there is never a second one."""

    def shown() -> int:
        return sum(name == "/here" for name, _ in between.network.nodes)

    between.native("/native", (SUBSCRIPTION, "/down", STRING))
    for text in ("one", "two", "three"):
        message = String(data=text)
        publisher = between.here.create_publisher(String, "/down", 10)
        await until(lambda: between.shown("ros2") == (1, 1))
        assert shown() == 1
        publisher.publish(message)
        await until(lambda: cdr.encode(message) in between.network.published)  # noqa: B023 - called at once
        publisher.destroy()
        await until(lambda: between.shown("ros2") == (0, 0))
    await until(lambda: not shown())


async def test_what_ros_has_refused_is_tried_again(between: Between) -> None:
    """The reason may be gone, though neither graph has changed."""
    between.native("/native", (SUBSCRIPTION, "/down", STRING))
    between.network.refuses = RuntimeError("another type lingers")
    between.here.create_publisher(String, "/down", 10)
    await until(lambda: "another type lingers" in str(between.bridge.document()))
    between.network.refuses = None
    await until(lambda: between.shown("ros2") == (1, 1))


async def test_a_node_that_the_broker_refuses_is_reported_once(
    between: Between, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not once more for each of its endpoints; neither it nor they count as shown."""
    between.native("/native", (PUBLISHER, "/up", STRING), (SERVICE, "/light", SET_BOOL))
    await until(lambda: between.shown("callboard") == (1, 2))
    for each in (BareNode, actors.Publisher, ServiceServer):
        monkeypatch.setattr(each, "refusal", "not allowed")
    assert between.shown("callboard") == (0, 0)
    assert between.bridge.document()["refused_by_broker"] == ["/native: not allowed"]


async def test_a_mirror_comes_back_after_a_node_that_took_its_name_and_was_not_seen(
    between: Between, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It came and went between two looks at the graph, say: the broker had refused the mirror meanwhile."""
    (up,) = between.native("/native", (PUBLISHER, "/up", STRING))
    up.qos = LATCHED
    received: list[str] = []
    between.here.create_subscription(String, "/up", lambda each: received.append(each.data), LATCHED)
    await until(lambda: between.shown("callboard") == (1, 1))

    def without_newcomer(snapshot: GraphSnapshot) -> SideGraph:
        graph = our_graph(snapshot)
        return graph._replace(nodes=frozenset(each for each in graph.nodes if each.name != "/native"))

    monkeypatch.setattr(bridge_module, "our_graph", without_newcomer)
    async with actors.Node("native", url=meeting.url):
        await until(lambda: between.bridge.document()["refused_by_broker"])
    watch = between.here.watch_graph()
    await until(lambda: watch.snapshot.node_labels().get("/native"))
    assert not between.bridge.document()["refused_by_broker"]
    between.send(up.gid, "one", 1)
    await until(lambda: received == ["one"])


async def test_a_latched_mirror_in_ros_that_is_made_again_gets_what_was_latched(between: Between) -> None:
    """In order and once, as what follows: the second subscription that brings it receives that, too."""
    texts = ["one", "two", "three", "four"]
    one, two, three, four = (cdr.encode(String(data=each)) for each in texts)
    publisher = between.here.create_publisher(String, "/down", latched(2))
    for text in texts[:2]:
        publisher.publish(String(data=text))
    between.native("/native", (SUBSCRIPTION, "/down", STRING))
    await until(lambda: between.network.published == [one, two])
    between.native("/here")
    await until(lambda: between.network.published == [one, two, one, two])
    assert [each.node for each in between.network.endpoints if each.name == "/down"][-1] == "/here_callboard"
    for text in texts[2:]:
        publisher.publish(String(data=text))
    await until(lambda: between.network.published[-1] == four)
    assert between.network.published[4:] == [three, four]


async def test_latched_messages_are_asked_for_again_until_ros_lets_them(
    between: Between, meeting: Meeting
) -> None:
    """The bridge's own node gets no subscription at first, and the mirror here was made again."""
    received: list[str] = []
    between.here.create_subscription(String, "/up", lambda each: received.append(each.data), LATCHED)
    (up,) = between.native("/native", (PUBLISHER, "/up", STRING))
    up.qos = LATCHED
    await until(lambda: between.network.eventfds)
    between.send(up.gid, "one", 1)
    await until(lambda: received == ["one"])
    between.network.refuses = RuntimeError("too many open files")
    between.network.refusing_node = "/callboard_bridge_one"
    async with actors.Node("native", url=meeting.url):
        await until(lambda: "too many open files" in str(between.bridge.document()["failures"]))
        between.network.refuses = None
        await until(lambda: len(between.network.eventfds) == 2)
        between.send(up.gid, "one", 1)
        await until(lambda: received == ["one", "one"])


async def test_an_unexpected_error_costs_one_message(
    between: Between, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The bridge says so, and goes on with the next message and with all else."""

    def convert(types: MessageTypes, data: bytes) -> bytes:
        if cdr.decode(types.ours, data) == String(data="odd"):
            raise RuntimeError("nobody expects this")
        return to_callboard(types, data)

    to_callboard = MessageTypes.to_callboard
    monkeypatch.setattr(MessageTypes, "to_callboard", convert)
    received: list[str] = []
    between.here.create_subscription(String, "/up", lambda each: received.append(each.data), 10)
    (up,) = between.native("/native", (PUBLISHER, "/up", STRING))
    await until(lambda: between.network.eventfds)
    between.send(up.gid, "odd", 1)
    between.send(up.gid, "even", 2)
    await until(lambda: received == ["even"])
    assert "nobody expects this" in str(between.bridge.document()["failures"])


async def test_what_cannot_be_prepared_is_shown_once(between: Between) -> None:
    """ROS 2 refuses the client that would call for others: those are shown, and hidden when they end."""

    def shown() -> list[str]:
        found = [each for each in between.network.endpoints if each.node == "/here"]
        return sorted(each.name for each in found if each.kind in {CLIENT, SUBSCRIPTION})

    between.native("/native", (SERVICE, "/there", SET_BOOL))
    await until(lambda: between.shown("callboard") == (1, 1))
    between.network.refuses = RuntimeError("too many open files")
    between.network.refusing_node = "/callboard_bridge_one"
    client = between.here.create_client(SetBool, "/there")
    await until(lambda: shown() == ["/there"])
    between.native("/native", (PUBLISHER, "/up", STRING))
    between.here.create_subscription(String, "/up", print, 10)
    await until(lambda: shown() == ["/there", "/up"])
    client.destroy()
    await until(lambda: shown() == ["/up"])
    assert "too many open files" in str(between.bridge.document()["failures"])


async def test_a_bridge_that_was_suspended_hides_everything_and_ends(
    meeting: Meeting, between: Between
) -> None:
    """ROS 2 may have dropped it, as its lease was nearly over. Another bridge of its ID can follow."""
    elapsed, network = [0.0], Network()
    network.show("/listener", (SUBSCRIPTION, "/down", STRING))[0].type_hash = ""
    between.here.create_publisher(String, "/down", 10)
    node = await meeting.node("suspended")
    make = partial(Bridge, node, make_ros(network), Rules(), Counters(), bridge_id="two", domain_id=8)
    for lease_sec in (3, 20):
        bridge = make(clock=lambda: elapsed[0], lease_sec=lease_sec)
        running = asyncio.create_task(bridge.run())
        await until(lambda: ("/here", "/callboard_bridge/two") in network.nodes)
        elapsed[0] += lease_sec - 0.9
        with pytest.raises(SuspendedError, match=rf"was suspended for {lease_sec - 1}\.1 s"):
            await running
        assert network.nodes == [("/listener", "/")]
