"""Each side's nodes are in the other side's graph, with their endpoints, marked as what they are."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

import actors
from actors.interfaces.message import type_hash
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import SetBool
from actors.interfaces.type_description_interfaces.srv import GetTypeDescription
from actors.qos.profile import DurabilityPolicy, QoSProfile
from tests.ros2.graphs import full_name, graph_until, names_of, nodes_until
from tests.waiting import until

if TYPE_CHECKING:
    from actors.graph.snapshot import GraphSnapshot
    from tests.ros2.conftest import Pair

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
MANY = 300
MOST_LINKS = 4
STRING, SETBOOL = "std_msgs/msg/String", "std_srvs/srv/SetBool"


async def test_a_node_of_ros_is_a_node_here(pair: Pair) -> None:
    """It has its name and endpoints, and the origin as a label; its end is seen, too."""
    namespace = f"{pair.name}/arm"
    node = await pair.ros.node("driver", namespace)
    await node.publisher("state", String)
    await node.subscription("command", String)
    await node.service("enable", SetBool, SetBool.Response())
    await node.client("/somewhere", SetBool)
    name = f"{namespace}/driver"

    def is_complete(snapshot: GraphSnapshot) -> bool:
        found = names_of(snapshot, name)
        return (
            found["publishers"].get(f"{namespace}/state") == [STRING]
            and found["subscriptions"].get(f"{namespace}/command") == [STRING]
            and found["services"].get(f"{namespace}/enable") == [SETBOOL]
            and found["clients"].get("/somewhere") == [SETBOOL]
            and f"{name}/get_parameters" in found["services"]
        )

    snapshot = await graph_until(pair.here, is_complete)
    labels = snapshot.node_labels()[name]
    assert labels["origin"] == f"ros2/{pair.network.domain}"
    shown = [info for _, info in snapshot.all_endpoints() if full_name(info) == name]
    assert {info.node_labels["origin"] for info in shown} == {labels["origin"]}
    hashes = {info.topic_type_hash for info in shown if info.topic_type == STRING}
    assert all(each.startswith("RIHS01_") for each in hashes)
    await node.destroy()
    await nodes_until(pair.here, absent=(name,))


async def test_a_node_of_callboard_is_a_node_of_ros(pair: Pair) -> None:
    """It has its name, namespace and endpoints; its end is seen, too."""
    namespace = f"{pair.name}/leg"
    node = pair.here.create_bare_node("walker", namespace=namespace)
    node.create_publisher(String, "state", 10)
    node.create_subscription(String, "command", print, 10)
    node.create_service(SetBool, "enable", lambda request, response: response)
    node.create_client(SetBool, f"{namespace}/elsewhere")
    name = f"{namespace}/walker"
    await pair.there.node_names(name)
    await pair.there.endpoints(f"{namespace}/state", "publishers", 1)
    await pair.there.endpoints(f"{namespace}/command", "subscriptions", 1)
    await pair.there.service_count(f"{namespace}/enable", 1)
    found = await pair.there.names_of(name)
    assert found["publishers"][f"{namespace}/state"] == [STRING]
    assert found["subscriptions"][f"{namespace}/command"] == [STRING]
    assert found["services"] == {f"{namespace}/enable": [SETBOOL]}
    assert found["clients"] == {f"{namespace}/elsewhere": [SETBOOL]}
    node.destroy()
    await pair.there.node_names(absent=[name])


async def test_hashes_of_types_are_the_same_on_both_sides(pair: Pair) -> None:
    """What ROS says of a mirror's type is what callboard says."""
    topic = f"{pair.name}/hashed"
    pair.here.create_publisher(String, topic, 10)
    own = await graph_until(pair.here, lambda graph: any(name == topic for name, _ in graph.all_endpoints()))
    [[_, type_name, type_hash, *_]] = await pair.there.endpoints(topic, "publishers", 1)
    [hashed] = [info.topic_type_hash for name, info in own.all_endpoints() if name == topic]
    assert (type_name, type_hash) == (STRING, hashed)


async def test_type_descriptions_come_from_the_original(pair: Pair) -> None:
    """A node of each side describes a type to the other one, as if it was asked at home."""
    asked = GetTypeDescription.Request(
        type_name=STRING, type_hash=type_hash(String), include_type_sources=True
    )
    await pair.there.publisher(f"{pair.name}/described", String)
    pair.here.create_publisher(String, f"{pair.name}/described", 10)
    answers: list[GetTypeDescription.Response] = []
    for name in (pair.there.name, f"{pair.name}_here"):
        here = pair.here.create_client(GetTypeDescription, f"{name}/get_type_description")
        assert await here.wait_for_service()
        answers.append(await here.call(asked))
        there = await pair.there.client(f"{name}/get_type_description", GetTypeDescription)
        answers.append(await there.call(asked))
    theirs, theirs_at_home, ours_at_home, ours = answers
    assert theirs == theirs_at_home
    assert ours == ours_at_home
    for each in (ours, theirs):
        assert each.successful, each.failure_reason
        described = each.type_description.type_description
        assert (described.type_name, [field.name for field in described.fields]) == (STRING, ["data"])
        assert "string data" in each.type_sources[0].raw_file_contents
    other = GetTypeDescription.Request(type_name=STRING, type_hash="RIHS01_" + 64 * "0")
    refused = await there.call(other)
    assert not refused.successful
    assert refused.failure_reason


async def test_a_mirror_describes_no_types_if_its_original_does_not(pair: Pair) -> None:
    """A node of ROS may have no such service."""
    node = await pair.ros.node(f"{pair.name[1:]}_silent", start_type_description_service=False)
    snapshot = await graph_until(
        pair.here, lambda graph: f"{node.name}/get_parameters" in names_of(graph, node.name)["services"]
    )
    assert f"{node.name}/get_type_description" not in names_of(snapshot, node.name)["services"]


async def test_mirrors_have_no_endpoints_that_their_originals_lack(pair: Pair) -> None:
    """A bare node here has no services of parameters in ROS, an ordinary one has its own."""
    pair.here.create_bare_node("plain", namespace=pair.name).create_publisher(String, "text", 10)
    await pair.there.node_names(f"{pair.name}/plain", f"{pair.name}_here")
    await pair.there.service_count(f"{pair.name}_here/get_parameters", 1)
    assert (await pair.there.names_of(f"{pair.name}/plain"))["services"] == {}


async def test_node_list_and_info_mark_what_is_bridged(pair: Pair) -> None:
    """They print the origin beside a node of ROS."""
    await nodes_until(pair.here, pair.there.name)
    origin = f"ros2/{pair.network.domain}"
    for command in (("node", "list"), ("node", "info", pair.there.name)):
        process = pair.network.callboard(*command)
        assert await asyncio.to_thread(process.wait) == 0, process.output()
        output = process.output()
        assert pair.there.name in output
        assert origin in output


async def test_a_node_of_ros_beside_an_unshared_one_gets_another_name(pair: Pair) -> None:
    """A node here that shares its name with nobody keeps it; the one of ROS is NAME_ros2."""
    name = f"{pair.name[1:]}_here"
    node = await pair.ros.node(name)
    await node.publisher(f"{pair.name}/same", String)
    snapshot = await graph_until(
        pair.here, lambda graph: any(topic == f"{pair.name}/same" for topic, _ in graph.all_endpoints())
    )
    [shown] = [info for topic, info in snapshot.all_endpoints() if topic == f"{pair.name}/same"]
    assert full_name(shown) == f"{pair.name}_here_ros2"


async def test_a_node_of_ros_gives_way_to_an_unshared_one_that_comes_later(pair: Pair) -> None:
    """The newcomer here has its name at once; the one of ROS is NAME_ros2, with what it has latched."""
    node = await pair.ros.node(f"{pair.name[1:]}_robot")
    topic = f"{node.name}/map"
    await (await node.publisher(topic, String, LATCHED)).publish(String(data="map"))
    before: list[str] = []
    after: list[str] = []
    pair.here.create_subscription(String, topic, lambda each: before.append(each.data), LATCHED)
    await until(lambda: before)
    async with actors.Node(node.name[1:], url=pair.network.url) as newcomer:
        assert newcomer.connected

        def has_given_way(snapshot: GraphSnapshot) -> bool:
            shown = [info for name, info in snapshot.all_endpoints() if name == topic]
            return f"{node.name}_ros2" in {full_name(info) for info in shown}

        snapshot = await graph_until(pair.here, has_given_way)
        assert snapshot.nodes().count(node.name) == 1
        assert not snapshot.node_labels().get(node.name)
        pair.here.create_subscription(String, topic, lambda each: after.append(each.data), LATCHED)
        await until(lambda: after == ["map"])
        await pair.there.node_names(f"{node.name}_callboard")


async def test_a_node_that_is_back_at_once_has_its_endpoints(pair: Pair) -> None:
    """Its mirror has not gone yet, and ROS mixes up the endpoints of two nodes of one name in a process."""
    topic, name = f"{pair.name}/numbers", f"{pair.name[1:]}_restarting"
    subscription = await pair.there.subscription(topic, String)
    for text in ("first", "second"):
        node = pair.here.create_bare_node(name)
        node.create_service(SetBool, f"{pair.name}/enable", lambda request, response: response)
        publisher = node.create_publisher(String, topic, 10)
        await pair.there.service_count(f"{pair.name}/enable", 1)
        await publisher.wait_for_subscriptions()
        while text not in await subscription.take_texts():
            publisher.publish(String(data=text))
        if text == "first":
            node.destroy()
            await pair.there.service_count(f"{pair.name}/enable", 0)  # a service does not linger
    await subscription.matched()  # what lingers of the first one has gone
    [(shown, *_)] = await pair.there.endpoints(topic, "publishers", 1)
    assert shown == f"/{name}"


async def test_hundreds_of_mirrors_use_few_connections(pair: Pair) -> None:
    """A process of ROS with 300 nodes is 300 nodes here, and the bridge has at most 4 links."""
    prefix = f"{pair.name[1:]}_many_"
    await pair.ros.ask("make_plain_nodes", prefix, MANY)
    names = [f"/{prefix}{number}" for number in range(MANY)]
    await nodes_until(pair.here, *names)
    links = (await pair.here.get_broker_stats()).links
    assert len(links) - 1 <= MOST_LINKS, "one is that of the test's own node"
