"""`callboard log`."""

from __future__ import annotations

import asyncio
import dataclasses
import re
from contextlib import AsyncExitStack
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.cli.completion import Offer, offers
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.rcl_interfaces.msg import Log
from actors.interfaces.std_msgs.msg import String
from actors.qos.profile import QoSPresetProfiles
from actors.testing import Direction, FaultProxy
from broker import Broker, BrokerOptions

if TYPE_CHECKING:
    from pathlib import Path

    from tests.actors.cli.conftest import Desk, Ended

ROSOUT = QoSPresetProfiles.ROSOUT_DEFAULT.value


def rosout(node: actors.Node) -> actors.Publisher[Log]:
    """Return a publisher as nodes have it."""
    return node.create_publisher(Log, "/rosout", ROSOUT)


def line(second: int, name: str, msg: str, level: int = Log.INFO, **fields: Any) -> Log:
    """Return a line of the log."""
    return Log(stamp=Time(sec=second, nanosec=5), level=level, name=name, msg=msg, **fields)


async def test_lines_of_all_nodes_by_time(desk: Desk) -> None:
    """What is kept of each node, sorted; nothing else, and no wait for more."""
    async with desk.node("a") as a, desk.node("b") as b:
        for node, seconds in ((a, (1, 4)), (b, (2, 3))):
            publisher = rosout(node)
            for second in seconds:
                publisher.publish(line(second, node.get_name(), f"at {second}"))
            await node.get_graph()
        assert await desk.callboard("log") == (
            0,
            (
                "[INFO] [1.000000005] [a]: at 1\n"
                "[INFO] [2.000000005] [b]: at 2\n"
                "[INFO] [3.000000005] [b]: at 3\n"
                "[INFO] [4.000000005] [a]: at 4\n"
            ),
            "",
        )


async def logged(desk: Desk, *lines: Log, options: tuple[str, ...] = ()) -> Ended:
    """Return what the command prints of the lines of a node called /a."""
    async with desk.node("a") as node:
        publisher = rosout(node)
        for each in lines:
            publisher.publish(each)
        await node.get_graph()
        return await desk.callboard("log", *options)


async def test_nothing(desk: Desk) -> None:
    """Without nodes, and with one that has not logged anything, there is nothing to wait for."""
    assert await desk.callboard("log") == (0, "", "")
    assert await logged(desk) == (0, "", "")


@pytest.mark.parametrize(
    ("options", "levels"),
    [
        ((), ["DEBUG", "INFO", "Level 25", "WARN", "ERROR", "FATAL"]),
        (("--level", "INFO"), ["INFO", "Level 25", "WARN", "ERROR", "FATAL"]),
        (("--level", "warn"), ["WARN", "ERROR", "FATAL"]),
        (("--level", "fatal"), ["FATAL"]),
    ],
)
async def test_level(desk: Desk, options: tuple[str, ...], levels: list[str]) -> None:
    """The least severity, in any case; by default all that is published."""
    lines = [line(level, "a", "x", level) for level in (10, 20, 25, 30, 40, 50)]
    ended = await logged(desk, *lines, options=options)
    assert re.findall(r"^\[(.*?)\]", ended.out, re.MULTILINE) == levels


async def test_json(desk: Desk) -> None:
    """A document for each line: its fields, its node and its severity."""
    where: dict[str, Any] = {"file": "a.py", "function": "tick", "line": 7}
    ended = await logged(desk, line(1, "a.child", "hi", Log.WARN, **where), options=("--json",))
    assert ended.json == {
        "node": "/a", "severity": "WARN", "stamp": {"sec": 1, "nanosec": 5}, "level": 30,
        "name": "a.child", "msg": "hi", **where,
    }  # fmt: skip


async def test_verbose(desk: Desk) -> None:
    """Where it was logged, as ROS 2's console format has it."""
    where: dict[str, Any] = {"file": "/x/a.py", "function": "tick", "line": 7}
    ended = await logged(desk, line(1, "a", "hi", **where), options=("--verbose",))
    assert ended.out == "[INFO] [1.000000005] [a]: hi (tick() at /x/a.py:7)\n"


@pytest.mark.parametrize("options", [(), ("-v",), ("--json",)])
async def test_what_steers_terminals_is_escaped(desk: Desk, options: tuple[str, ...]) -> None:
    """In every part of a line; a message may have several lines."""
    evil = "\x1b[2J\u202e"
    ended = await logged(
        desk, line(1, f"a{evil}\n", f"b{evil}\nc", file=evil, function=evil), options=options
    )
    assert ended.code == 0
    assert not {"\x1b", "\u202e"} & set(ended.out)
    assert ended.out.count("\n") == (1 if options == ("--json",) else 2)


async def test_colours(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those of the nodes' own output, if colours are wanted."""
    monkeypatch.setenv("FORCE_COLOR", "1")
    ended = await logged(desk, line(1, "a", "x", Log.WARN))
    assert ended.out == "\x1b[33m[WARN] [1.000000005] [a]: x\x1b[0m\n"
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b" not in (await logged(desk, line(1, "a", "x", Log.WARN))).out


@pytest.mark.parametrize(
    ("options", "names"),
    [
        (("--node", "/a"), "a a.child a.b"),
        (("--node", "a"), "a a.child a.b"),
        (("--node", "/a/b"), "a.b"),
        (("--node", "/a/child/"), "a.child"),
        (("--node", "/a/b", "--node", "/ab"), "a.b ab"),
        (("--node", "/"), "a a.child a.b ab"),
    ],
)
async def test_node(desk: Desk, options: tuple[str, ...], names: str) -> None:
    """A node with its child loggers, one of these, or a namespace; several times."""
    async with desk.node("a") as a, desk.node("ab") as ab, desk.node("b", namespace="a") as b:
        for second, (node, name) in enumerate([(a, "a"), (a, "a.child"), (b, "a.b"), (ab, "ab")]):
            rosout(node).publish(line(second, name, "x"))
            await node.get_graph()
        ended = await desk.callboard("log", *options)
    assert re.findall(r"\[([a-z.]+)\]:", ended.out) == names.split()


async def test_unknown_node(desk: Desk) -> None:
    """An error with a suggestion; with --follow a warning, as it may come later."""
    async with desk.node("talker") as node:
        await node.get_graph()
        assert await desk.callboard("log", "--node", "talkr") == (
            1, "", "Node not found: '/talkr'; did you mean '/talker'?\n"
        )  # fmt: skip
        followed = await desk.callboard("log", "--node", "talkr", "--follow", "--timeout", "0.1")
    assert followed.code == 124
    assert followed.err.startswith("WARNING: there is no node '/talkr' yet; did you mean '/talker'?\n")


def test_completion() -> None:
    """The levels; --node can be given again, other options cannot."""
    assert offers(["log", "--level", "e"]) == [Offer("error")]
    assert [offer.word for offer in offers(["log", "--node", "/a", "--level", "warn", "--n"])] == ["--node"]
    assert offers(["log", "--level", "warn", "--level"]) == []


async def test_every_kept_line_is_received(desk: Desk) -> None:
    """Of many nodes, more bytes than a broker sends in advance; publishers that keep nothing do no harm."""
    count, nodes = 1000, 5
    async with AsyncExitStack() as stack:
        volatile, other = [await stack.enter_async_context(desk.node(each)) for each in ("volatile", "other")]
        volatile.create_publisher(Log, "/rosout", 10).publish(line(1, "volatile", "gone"))
        other.create_publisher(String, "/rosout", ROSOUT).publish(String(data="another type"))
        for number in range(nodes):
            publisher = rosout(await stack.enter_async_context(desk.node(f"n{number}")))
            for second in range(count):
                publisher.publish(line(second, f"n{number}", "x" * 500))
            await publisher.flush(20)
        ended = await desk.callboard("log", "--json", "--timeout", "60")
    stamps = [(each["stamp"]["sec"], each["node"]) for each in ended.documents]
    assert stamps == [(second, f"/n{number}") for second in range(count) for number in range(nodes)]


class Followed:
    """A publisher of lines, and a command that follows them: it has printed the lines that are kept."""

    def __init__(self, node: actors.Node, **options: Any) -> None:
        self._following = asyncio.Event()
        profile = dataclasses.replace(ROSOUT, **options)
        events = actors.PublisherEventCallbacks(matched=self._matched)
        self.publisher = node.create_publisher(Log, "/rosout", profile, event_callbacks=events)

    def _matched(self, info: actors.MatchedInfo) -> None:
        """Note when the second subscription, with which the command finds the end of these lines, is gone."""
        if (info.total_count, info.current_count) == (2, 1):
            self._following.set()

    async def begin(self, desk: Desk, *options: str) -> asyncio.Task[Ended]:
        await self.publisher.flush(20)
        command = desk.start("log", "--follow", *options)
        await asyncio.wait_for(self._following.wait(), 20)
        return command


async def test_follow(desk: Desk) -> None:
    """The lines that are kept by their time, then new ones as they come, until none comes for long."""
    async with desk.node("a") as node:
        followed = Followed(node)
        for second in (2, 1, 9, 8):
            if second == 9:
                command = await followed.begin(desk, "--timeout", "3")
            followed.publisher.publish(line(second, "a", "x"))
        assert await command == (
            124,
            "".join(f"[INFO] [{second}.000000005] [a]: x\n" for second in (1, 2, 9, 8)),
            "No message on /rosout within 3 s\n",
        )


async def test_lines_that_are_lost_are_counted(desk: Desk) -> None:
    """Those too that expired because the command was slow, but not those that were old when it started."""
    async with desk.node("a") as node:
        followed = Followed(node, lifespan=1e-9)
        followed.publisher.publish(line(1, "a", "old"))
        command = await followed.begin(desk, "--timeout", "3")
        for second in (2, 3):
            followed.publisher.publish(line(second, "a", "too late"))
        assert await command == (
            124,
            "",
            (
                "2 message(s) of /rosout lost: too fast, or lost on the way; 2 in all\n"
                "No message on /rosout within 3 s\n"
            ),
        )


async def test_an_end_in_time(desk: Desk) -> None:
    """The command ends at its timeout even if not all lines have arrived."""
    assert await desk.callboard("log", "--timeout", "0.000001") == (
        124, "", "Not all lines were received within 1e-06 s\n"
    )  # fmt: skip


@pytest.mark.parametrize("options", [(), ("--follow", "--timeout", "3")])
async def test_a_link_that_breaks(desk: Desk, options: tuple[str, ...]) -> None:
    """While lines arrive: what has come is printed, and the command says that something is missing."""
    count = 500
    async with desk.node("a") as node, FaultProxy(desk.url) as proxy:
        publisher = rosout(node)
        for second in range(count):
            publisher.publish(line(second, "a", "x" * 5000))
        await publisher.flush(20)
        desk.url = proxy.url
        proxy.drip(200_000, every_sec=0.01, direction=Direction.TO_NODE)
        command = desk.start("log", "--timeout", "60", *options)
        await proxy.wait_until(lambda: proxy.forwarded_bytes(Direction.TO_NODE) > 1_500_000)
        proxy.refuse()
        proxy.reset()
        code, out, err = await command
    assert 0 < len(out.splitlines()) < count
    assert code == (124 if options else 3)
    last = "No message on /rosout within 3 s" if options else "The link to the broker broke"
    assert err.splitlines()[-1] == last


async def test_a_refused_subscription(desk: Desk, tmp_path: Path) -> None:
    """A refused subscription ends the command with the broker's reason."""
    rules = tmp_path / "rules.toml"
    rules.write_text(
        '[local]\nuser = "guest"\n[users.guest]\nroles = ["guest"]\n[roles.guest]\n'
        'allow.node = ["/**"]\nallow.subscribe = ["/chatter"]\n'
    )
    async with Broker(BrokerOptions(port=0, auth=rules)) as broker:
        desk.url = broker.url
        ended = await desk.callboard("log")
    assert (ended.code, ended.out) == (1, "")
    assert "/rosout" in ended.err
