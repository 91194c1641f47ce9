"""`callboard topic`: list, info, type, find."""

from __future__ import annotations

from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

import pytest

from actors.interfaces.message import type_hash
from actors.interfaces.std_msgs.msg import Int32, String
from actors.qos.profile import QoSProfile

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator

    from tests.actors.cli.conftest import Desk


@asynccontextmanager
async def some_topics(desk: Desk) -> AsyncGenerator[None]:
    """A node with a published, a subscribed and a hidden topic, and one of two types."""
    async with desk.node() as node:
        for kind, topic in ((String, "zoo"), (String, "_secret"), (Int32, "zoo")):
            node.create_publisher(kind, topic, 10)
        node.create_subscription(String, "chatter", print)
        await node.get_graph()
        yield


@pytest.mark.parametrize(
    ("options", "out"),
    [
        ([], "/chatter\n/zoo\n"),
        (["-t"], "/chatter [std_msgs/msg/String]\n/zoo [std_msgs/msg/Int32, std_msgs/msg/String]\n"),
        (["-c"], "2\n"),
        (["-c", "--include-hidden-topics"], "3\n"),
        (["--include-hidden-topics"], "/_secret\n/chatter\n/zoo\n"),
    ],
)
async def test_list(desk: Desk, options: list[str], out: str) -> None:
    """Sorted, one a line, hidden ones left out."""
    async with some_topics(desk):
        assert await desk.callboard("topic", "list", *options) == (0, out, "")


async def test_list_as_json(desk: Desk) -> None:
    """One document, with the types."""
    async with some_topics(desk):
        assert (await desk.callboard("topic", "list", "--json")).json == [
            {"name": "/chatter", "types": ["std_msgs/msg/String"]},
            {"name": "/zoo", "types": ["std_msgs/msg/Int32", "std_msgs/msg/String"]},
        ]


async def test_list_of_an_empty_graph(desk: Desk) -> None:
    """No lines; an empty JSON array."""
    assert await desk.callboard("topic", "list") == (0, "", "")
    assert (await desk.callboard("topic", "list", "--json")).json == []


async def test_verbose_list(desk: Desk) -> None:
    """A block of published topics and one of subscribed ones, with types and how many there are."""
    async with some_topics(desk):
        ended = await desk.callboard("topic", "list", "-v")
    assert (ended.code, ended.err) == (0, "")
    assert ended.out == (
        "Published topics:\n * /zoo [std_msgs/msg/Int32, std_msgs/msg/String] 2 publishers\n\n"
        "Subscribed topics:\n * /chatter [std_msgs/msg/String] 1 subscriber\n\n"
    )


async def test_verbose_list_as_json(desk: Desk) -> None:
    """Each topic once, with both counts."""
    async with some_topics(desk):
        (chatter, _) = (await desk.callboard("topic", "list", "-v", "--json")).json
    assert chatter == {
        "name": "/chatter",
        "types": ["std_msgs/msg/String"],
        "publisher_count": 0,
        "subscription_count": 1,
    }


@pytest.mark.parametrize("name", ["/zoo", "zoo"])
async def test_info(desk: Desk, name: str) -> None:
    """Type and counts; the first slash may be left out."""
    types = "['std_msgs/msg/Int32', 'std_msgs/msg/String']"
    async with some_topics(desk):
        ended = await desk.callboard("topic", "info", name)
    assert ended == (0, f"Type: {types}\nPublisher count: 2\nSubscription count: 0\n", "")


async def test_info_of_a_topic_without_a_type(desk: Desk) -> None:
    """A raw subscription hears any."""
    async with desk.node() as node:
        node.create_subscription(None, "/chatter", print, raw=True)
        await node.get_graph()
        ended = await desk.callboard("topic", "info", "/chatter")
    assert ended == (0, "Type: any\nPublisher count: 0\nSubscription count: 1\n", "")


async def test_verbose_info_counts_messages_in_shared_memory(desk: Desk) -> None:
    """A line at the end, if there are any."""
    async with desk.node() as node:
        publisher = node.create_publisher(String, "chatter", 10)
        for text in ("small", "large" * 100_000, "large" * 100_000):  # the broker opens the memory meanwhile
            publisher.publish(String(data=text))
            await publisher.flush()
        shared = node.diagnostics().shared_memory.active
        ended = await desk.callboard("topic", "info", "-v", "/chatter")
    assert ended.out.endswith("\nIn shared memory: 1 of 3 messages\n") is shared


async def test_verbose_info_of_large_messages_without_shared_memory(desk: Desk) -> None:
    """The line is there, so that nobody believes that they are shared."""
    async with desk.node(shared_memory=False) as node:
        publisher = node.create_publisher(String, "chatter", 10)
        publisher.publish(String(data="large" * 100_000))
        await publisher.flush()
        ended = await desk.callboard("topic", "info", "-v", "/chatter")
    assert ended.out.endswith("\nIn shared memory: 0 of 1 messages\n")


async def test_verbose_info(desk: Desk) -> None:
    """Blank lines between all, and each endpoint as rclpy prints it."""
    async with desk.node("zoe", namespace="/ns") as node:
        node.create_publisher(String, "/chatter", 7)
        (publisher,) = await node.get_publishers_info_by_topic("/chatter")
        ended = await desk.callboard("topic", "info", "-v", "/chatter")
    assert ended == (
        0,
        f"Type: std_msgs/msg/String\n\nPublisher count: 1\n\n{publisher}\n\nSubscription count: 0\n\n",
        "",
    )


async def test_info_as_json(desk: Desk) -> None:
    """With every endpoint; times that are none are null."""
    async with desk.node("zoe", namespace="/ns") as node:
        node.create_subscription(String, "/chatter", print, QoSProfile(depth=3, deadline=1.5))
        (endpoint,) = await node.get_subscriptions_info_by_topic("/chatter")
        ended = await desk.callboard("topic", "info", "/chatter", "--json")
    assert ended.json == {
        "name": "/chatter",
        "types": ["std_msgs/msg/String"],
        "publishers": [],
        "subscriptions": [
            {
                "node": "/ns/zoe",
                "type": "std_msgs/msg/String",
                "type_hash": type_hash(String),
                "endpoint_id": endpoint.endpoint_id,
                "qos": {
                    "history": "keep_last",
                    "depth": 3,
                    "reliability": "reliable",
                    "durability": "volatile",
                    "lifespan_ns": None,
                    "deadline_ns": 1_500_000_000,
                    "liveliness": "automatic",
                    "liveliness_lease_duration_ns": None,
                    "strict": False,
                },
            }
        ],
        "mismatches": [],
    }


async def test_info_names_those_that_are_not_connected(desk: Desk) -> None:
    """On stderr, or in the document: the types of a publisher and a subscription differ."""
    async with desk.node("talker") as node, desk.node("listener") as listener:
        node.create_publisher(Int32, "/chatter", 1)
        listener.create_subscription(String, "/chatter", print, 1)
        await node.get_graph()
        await listener.get_graph()
        ended = await desk.callboard("topic", "info", "/chatter")
        document = (await desk.callboard("topic", "info", "/chatter", "--json")).json
    text = (
        "Not connected, as their types differ: /talker publishes /chatter as std_msgs/msg/Int32, /listener"
        " subscribes to it as std_msgs/msg/String"
    )
    assert ended.err == f"{text}\n"
    assert [each["text"] for each in document["mismatches"]] == [text]


@pytest.mark.parametrize(
    ("options", "out"),
    [
        (["/chatter"], "std_msgs/msg/String\n"),
        (["zoo"], "std_msgs/msg/Int32\nstd_msgs/msg/String\n"),
        (["/_secret", "--include-hidden-topics"], "std_msgs/msg/String\n"),
        (["/chatter", "--json"], '["std_msgs/msg/String"]\n'),
    ],
)
async def test_type(desk: Desk, options: list[str], out: str) -> None:
    """One a line."""
    async with some_topics(desk):
        assert await desk.callboard("topic", "type", *options) == (0, out, "")


async def test_type_of_a_hidden_topic(desk: Desk) -> None:
    """Nothing on stdout, and 1; what helps is on stderr."""
    async with some_topics(desk):
        assert await desk.callboard("topic", "type", "/_secret") == (
            1,
            "",
            "Hidden topic '/_secret': add --include-hidden-topics\n",
        )


@pytest.mark.parametrize(
    ("options", "out"),
    [
        (["std_msgs/msg/String"], "/chatter\n/zoo\n"),
        (["std_msgs/String", "-c"], "2\n"),
        (["std_msgs/msg/String", "--include-hidden-topics"], "/_secret\n/chatter\n/zoo\n"),
        (["std_msgs/msg/Int32", "--json"], '["/zoo"]\n'),
        (["geometry_msgs/msg/Pose"], ""),
        (["geometry_msgs/msg/Pose", "-c"], "0\n"),
        (["geometry_msgs/msg/Pose", "--json"], "[]\n"),
    ],
)
async def test_find(desk: Desk, options: list[str], out: str) -> None:
    """The topics of a type; none is no failure."""
    async with some_topics(desk):
        assert await desk.callboard("topic", "find", *options) == (0, out, "")


async def test_find_with_a_mistyped_type(desk: Desk) -> None:
    """What may have been meant is among the types of the graph."""
    async with some_topics(desk):
        ended = await desk.callboard("topic", "find", "std_msgs/msg/Sting")
    assert ended == (0, "", "Nothing has type 'std_msgs/msg/Sting'; did you mean 'std_msgs/msg/String'?\n")


@pytest.mark.parametrize("verb", ["info", "type"])
@pytest.mark.parametrize(
    ("name", "code", "text"),
    [
        ("/chattr", 1, "Unknown topic '/chattr'; did you mean '/chatter'?\n"),
        ("/qqqqqq", 1, "Unknown topic '/qqqqqq'\n"),
        ("", 2, "topic name must not be empty"),
        ("a b", 2, "must not contain characters other than"),
    ],
)
async def test_unknown_topics(desk: Desk, verb: str, name: str, code: int, text: str) -> None:
    """ROS 2's text, with what may have been meant; impossible names are wrong usage."""
    async with some_topics(desk):
        ended = await desk.callboard("topic", verb, name)
    assert (ended.code, ended.out) == (code, "")
    assert text in ended.err
