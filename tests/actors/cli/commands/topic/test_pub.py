"""`callboard topic pub`."""

from __future__ import annotations

import os
import sys
from typing import TYPE_CHECKING

import pytest

import actors
from actors.endpoints.endpoint import endpoint_of
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.rosgraph_msgs.msg import Clock
from actors.interfaces.sensor_msgs.msg import Imu
from actors.interfaces.std_msgs.msg import Header, Int32, String

if TYPE_CHECKING:
    from pathlib import Path

    from tests.actors.cli.conftest import Desk

HELLO = ("topic", "pub", "/said", "std_msgs/msg/String", "{data: hello}")


async def test_pub_says_what_it_publishes(desk: Desk) -> None:
    """ROS 2's texts; every message comes, in order."""
    async with desk.node() as node:
        subscription = node.create_subscription(String, "said", qos_profile=10)
        await node.get_graph()
        ended = await desk.callboard(*HELLO, "-t", "2", "-r", "1000")
        received = aiter(subscription)
        assert [await anext(received), await anext(received)] == [String(data="hello")] * 2
    assert (ended.code, ended.err) == (0, "")
    assert ended.out == (
        "publisher: beginning loop\n"
        "publishing #1: std_msgs.msg.String(data='hello')\n\n"
        "publishing #2: std_msgs.msg.String(data='hello')\n\n"
    )


async def test_options_may_stand_between_arguments(desk: Desk) -> None:
    """In front of the values, too, as people type them."""
    ended = await desk.callboard(
        "topic", "pub", "-w", "0", "/said", "std_msgs/msg/String", "-1", "{data: hi}"
    )
    assert ended.code == 0
    assert "String(data='hi')" in ended.out


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
        subscription = node.create_subscription(String, "said", qos_profile=10)
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


READ = ("topic", "pub", "/said", "std_msgs/msg/String", "--stdin")


async def test_pub_from_stdin_publishes_what_comes_as_it_comes(
    desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    """YAML and JSON; a message leaves when it is whole, however it was cut; the end of stdin ends it."""
    reading, writing = os.pipe()
    with os.fdopen(reading, encoding="utf-8") as stream:
        monkeypatch.setattr(sys, "stdin", stream)
        async with desk.node() as node:
            received = aiter(node.create_subscription(String, "said", qos_profile=10))
            await node.get_graph()
            pub = desk.start(*READ)
            os.write(writing, b"data: \xc3")
            os.write(writing, b"\xa4\n---\n")
            assert await anext(received) == String(data="\xe4")
            os.write(writing, b'{"data": "b"}\n{"data": "c"}\ndata: d')
            assert [await anext(received), await anext(received)] == [String(data="b"), String(data="c")]
            os.close(writing)
            assert await anext(received) == String(data="d")
            ended = await pub
    assert (ended.code, ended.err) == (0, "")
    assert ended.out.count("publishing #") == 4


async def test_pub_from_a_file(desk: Desk, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """As fast as it is read; --times ends it sooner."""
    for options, count in (((), 500), (("-t", "3", "-w", "0"), 3)):
        with (tmp_path / "said").open("w+", encoding="utf-8") as stream:
            stream.writelines(f"data: {number}\n---\n" for number in range(500))
            stream.seek(0)
            monkeypatch.setattr(sys, "stdin", stream)
            async with desk.node() as node:
                subscription = node.create_subscription(String, "said", qos_profile=1000)
                await node.get_graph()
                ended = await desk.callboard(*READ, *options)
                received = aiter(subscription)
                assert [await anext(received) for _ in range(count)] == [
                    String(data=str(n)) for n in range(count)
                ]
                assert subscription.queued == 0
        assert (ended.code, ended.err) == (0, "")


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"data: a\n---\ndata: [\n---\n", "Message 2 on stdin: The values are not YAML"),
        (
            b'{"daata": 1}\n',
            "Message 1 on stdin: Failed to populate a message: std_msgs/msg/String has no field",
        ),
        (b"data: \xff\n", "What comes on stdin is not UTF-8"),
    ],
)
async def test_pub_of_what_is_no_message(
    desk: Desk, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, data: bytes, text: str
) -> None:
    """It ends with the number of the message and what is wrong with it."""
    (tmp_path / "said").write_bytes(data)
    with (tmp_path / "said").open(encoding="utf-8") as stream:
        monkeypatch.setattr(sys, "stdin", stream)
        ended = await desk.callboard(*READ)
    assert ended.code == 1
    assert ended.err.startswith(text)


async def test_pub_without_a_stdin(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    """The shell has closed it: `<&-`."""
    monkeypatch.setattr(sys, "stdin", None)
    ended = await desk.callboard(*READ)
    assert (ended.code, ended.err) == (1, "There is nothing to read from: stdin is closed\n")


async def test_pub_takes_values_or_stdin(desk: Desk) -> None:
    """Not both."""
    ended = await desk.callboard(*READ, "{data: x}")
    assert (ended.code, ended.err) == (2, "Give VALUES or --stdin, not both\n")


async def test_pub_fills_in_times(desk: Desk) -> None:
    """Each message has that at which it was sent."""
    async with desk.node() as node:
        subscription = node.create_subscription(Imu, "imu", qos_profile=10)
        await node.get_graph()
        values = "{header: auto}"
        ended = await desk.callboard(
            "topic", "pub", "imu", "sensor_msgs/msg/Imu", values, "-t", "2", "-r", "100"
        )
        received = aiter(subscription)
        stamps = [(await anext(received)).header.stamp for _ in range(2)]
    assert ended.code == 0
    assert 1_600_000_000 < stamps[0].sec <= stamps[1].sec
    assert stamps[0] != stamps[1]


async def test_pub_stays_when_it_is_told_to(desk: Desk) -> None:
    """Late joiners get what it has latched."""
    options = (
        "-w",
        "0",
        "--once",
        "--keep-alive",
        "1.5",
        "--qos-durability",
        "transient_local",
        "-n",
        "speaker",
    )
    async with desk.node() as node:
        pub = desk.start(*HELLO, *options)
        assert await node.wait_for_node("speaker", 30)
        latched = actors.QoSProfile(depth=1, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)
        assert await anext(aiter(node.create_subscription(String, "said", qos_profile=latched))) == String(
            data="hello"
        )
        assert (await pub).code == 0


async def test_pub_as_a_named_node(desk: Desk) -> None:
    """Seen in the graph; two nodes cannot have one name, and a bad one is wrong usage."""
    async with desk.node() as node:
        subscription = node.create_subscription(String, "said", qos_profile=10)
        pub = desk.start(*HELLO, "-w", "2", "--once", "--timeout", "30", "--node-name", "speaker")
        await endpoint_of(subscription).context.wait_until(
            lambda: subscription.get_publisher_count() > 0, "Matching", 30
        )
        publishers = await node.get_publishers_info_by_topic("said")
        node.create_subscription(String, "said", qos_profile=10)
        assert await anext(aiter(subscription)) == String(data="hello")
        assert (await pub).code == 0  # before the next prints: whoever ends takes all that was printed
        taken = await desk.callboard(*HELLO, "--once", "-n", "fellow")
        bad = await desk.callboard(*HELLO, "--once", "-n", "9")
    assert [info.node_name for info in publishers] == ["speaker"]
    assert (taken.code, bad.code) == (1, 2)
    assert "/fellow" in taken.err


async def test_pub_without_an_end_and_without_words(
    desk: Desk, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """-t 0 has no limit, and -p 0 prints no message, as in ROS 2."""
    async with desk.node() as node:
        subscription = node.create_subscription(String, "said", qos_profile=10)
        await node.get_graph()
        (tmp_path / "said").write_text("data: a\n---\ndata: b\n", encoding="utf-8")
        with (tmp_path / "said").open(encoding="utf-8") as stream:
            monkeypatch.setattr(sys, "stdin", stream)
            ended = await desk.callboard(*READ, "-t", "0", "-p", "0")
        received = aiter(subscription)
        assert [(await anext(received)).data for _ in range(2)] == ["a", "b"]
    assert ended == (0, "publisher: beginning loop\n", "")


async def test_pub_stamps_with_simulated_time(desk: Desk) -> None:
    """With -s, 'now' is the time of /clock."""
    async with desk.node() as node:
        clock = node.create_publisher(
            Clock, "clock", actors.QoSProfile(depth=1, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL)
        )
        node.create_timer(0.01, lambda: clock.publish(Clock(clock=Time(sec=7))))
        subscription = node.create_subscription(Header, "head", qos_profile=100)
        await node.get_graph()
        command = desk.start(
            *("topic", "pub", "head", "std_msgs/msg/Header", "{stamp: now}", "-s", "-r", "100", "-t", "50")
        )
        stamps = [(await anext(aiter(subscription))).stamp.sec for _ in range(50)]
        assert (await command).code == 0
    assert set(stamps) <= {0, 7}
    assert stamps[-1] == 7


async def test_pub_in_simulated_time_without_a_clock(desk: Desk) -> None:
    """What it publishes has the time 0."""
    ended = await desk.callboard("topic", "pub", "head", "std_msgs/msg/Header", "-s", "-1", "-w", "0")
    assert ended.code == 0
    assert ended.err == "WARNING: topic [/clock] does not appear to be published yet\n"


async def test_pub_of_another_type_than_the_topic_has(desk: Desk) -> None:
    """What would wait for ever ends at once, and says why; what goes on warns; bytes fit every type."""
    async with desk.node() as node:
        reader = node.create_subscription(Int32, "said", qos_profile=10)
        node.create_publisher(Int32, "told", 10)
        node.create_subscription(None, "raw", qos_profile=10, raw=True)
        await node.get_graph()
        waits = await desk.callboard(*HELLO, "--once")
        assert (waits.code, waits.out) == (1, "")
        assert waits.err == "'/said' is subscribed to as std_msgs/msg/Int32, not std_msgs/msg/String\n"
        told = await desk.callboard("topic", "pub", "/told", "std_msgs/msg/String", "-1", "-w", "0")
        assert told.code == 0
        assert told.err == "WARNING: '/told' is published as std_msgs/msg/Int32, not std_msgs/msg/String\n"
        assert (await desk.callboard("topic", "pub", "/raw", "std_msgs/msg/String", "--once")).code == 0
        assert (await desk.callboard("topic", "pub", "/said", "std_msgs/msg/Int32", "--once")).code == 0
        assert await anext(aiter(reader)) == Int32()
