"""`callboard topic pub`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.interfaces.std_msgs.msg import String

if TYPE_CHECKING:
    from tests.actors.cli.conftest import Desk

HELLO = ("topic", "pub", "/said", "std_msgs/msg/String", "{data: hello}")


async def test_pub_says_what_it_publishes(desk: Desk) -> None:
    """ROS 2's texts; every message comes, in order."""
    async with desk.node() as node:
        subscription = node.create_subscription(String, "said", qos=10)
        await node.get_graph()
        ended = await desk.callboard(*HELLO, "-t", "2", "-r", "1000")
        heard = aiter(subscription)
        assert [await anext(heard), await anext(heard)] == [String(data="hello")] * 2
    assert (ended.code, ended.err) == (0, "")
    assert ended.out == (
        "publisher: beginning loop\n"
        "publishing #1: std_msgs.msg.String(data='hello')\n\n"
        "publishing #2: std_msgs.msg.String(data='hello')\n\n"
    )


async def test_pub_prints_every_nth(desk: Desk) -> None:
    """-p 2 prints the second and the fourth."""
    ended = await desk.callboard(*HELLO, "-t", "4", "-r", "1000", "-p", "2", "-w", "0")
    assert [line.split(":")[0] for line in ended.out.splitlines()[1:] if line] == [
        "publishing #2",
        "publishing #4",
    ]


async def test_pub_as_json(desk: Desk) -> None:
    """One document a message, and nothing else on stdout."""
    ended = await desk.callboard(*HELLO, "--once", "-w", "0", "--json")
    assert ended.json == {"number": 1, "message": {"data": "hello"}}


async def test_pub_once_waits_for_a_subscription(desk: Desk) -> None:
    """It publishes when there is one, and says so meanwhile."""
    pub = desk.start(*HELLO, "--once")
    async with desk.node() as node:
        assert await node.wait_for_node("/nobody", 0.0) is False
        subscription = node.create_subscription(String, "said", qos=10)
        assert await anext(aiter(subscription)) == String(data="hello")
        ended = await pub
    assert ended.code == 0
    assert ended.err in {"Waiting for at least 1 matching subscription(s) on /said...\n", ""}


async def test_pub_gives_up_waiting(desk: Desk) -> None:
    """--timeout: 124, and nothing was published."""
    ended = await desk.callboard(*HELLO, "--once", "-w", "2", "--timeout", "0.05")
    assert (ended.code, ended.out) == (124, "")
    assert ended.err == (
        "Waiting for at least 2 matching subscription(s) on /said...\n"
        "Only 0 of 2 subscription(s) on /said within 0.05 s\n"
    )


@pytest.mark.parametrize(
    ("arguments", "code", "text"),
    [
        (("/said", "std_msgs/msg/Strin"), 1, "did you mean std_msgs/msg/String?"),
        (("/said", "std_msgs/msg/String", "{data: [}"), 1, "not YAML"),
        (("/said", "std_msgs/msg/String", "{daata: x}"), 1, "no field 'daata'"),
        (("/said", "std_msgs/msg/Int8", "{data: 300}"), 1, "300"),
        (("9said", "std_msgs/msg/String"), 2, "Invalid topic name"),
        (("/said", "std_msgs/msg/String", "-r", "0"), 2, "expected a number above 0, got '0'"),
        (("/said", "std_msgs/msg/String", "-1", "-t", "2"), 2, "not allowed with argument"),
    ],
)
async def test_bad_input_is_named(desk: Desk, arguments: tuple[str, ...], code: int, text: str) -> None:
    """No traceback, nothing on stdout."""
    ended = await desk.callboard("topic", "pub", *arguments)
    assert (ended.code, ended.out) == (code, "")
    assert text in ended.err
    assert "Traceback" not in ended.err
