"""`callboard topic list`."""

from __future__ import annotations

from contextlib import asynccontextmanager
from typing import TYPE_CHECKING

import pytest

from actors.interfaces.std_msgs.msg import Int32, String

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
