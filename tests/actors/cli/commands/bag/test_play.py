"""`callboard bag play`: its options, and what it prints."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest

from actors.bags import BagTopic, Writer
from actors.bags.player.player import PlayingStatistics
from actors.cli.commands.bag.play import progress_line
from actors.cli.main import main
from actors.endpoints.service_introspection import EventKind
from actors.interfaces import cdr
from actors.interfaces.rosbag2_interfaces.srv import Burst, GetRate, IsPaused, Resume
from actors.interfaces.service_event import service_event
from actors.interfaces.service_msgs.msg import ServiceEventInfo
from actors.interfaces.std_msgs.msg import String
from actors.interfaces.std_srvs.srv import SetBool
from tests.actors.bags.bags import START_NS, write_bag
from tests.actors.meeting import KEEP_ALL
from tests.waiting import until

if TYPE_CHECKING:
    from pathlib import Path

    from tests.actors.cli.conftest import Desk


async def test_it_plays_a_bag(desk: Desk, tmp_path: Path) -> None:
    """The last line says how much; a topic gets another name, and the other is not played."""
    write_bag(tmp_path / "trip")
    heard: list[str] = []
    async with desk.node() as node:
        node.create_subscription(String, "/other", lambda msg: heard.append(msg.data), KEEP_ALL)
        await node.get_graph()
        result = await desk.callboard(
            *("bag", "play", str(tmp_path / "trip"), "--topics", "chatter", "--remap", "/chatter:=other"),
            *("--rate", "1000", "--wait-for-all-acked", "0"),
        )
        await until(lambda: len(heard) == 10)
    assert result.code == 0
    assert result.out.splitlines() == [
        f"Playing {tmp_path / 'trip'}",
        f"{tmp_path / 'trip'}: 10 messages of 1 topic",
    ]
    assert heard[:2] == ["text 0", "text 2"]


async def test_options_reach_the_player(desk: Desk, tmp_path: Path) -> None:
    """The name of the node, the rate and pausing; with --json, one document at the end."""
    write_bag(tmp_path / "trip")
    async with desk.node() as node:
        ended = desk.start(
            *("bag", "play", str(tmp_path / "trip"), "--start-paused", "--node-name", "player"),
            *("--rate", "3", "--json", "-x", "count", "--message-order", "sent", "--clock"),
        )
        client = node.create_client(IsPaused, "/player/is_paused")
        await client.wait_for_service(20.0)
        assert (await client.call(IsPaused.Request())).paused
        assert (await node.create_client(GetRate, "/player/get_rate").call(GetRate.Request())).rate == 3
        request = Burst.Request(num_messages=4)
        assert (await node.create_client(Burst, "/player/burst").call(request)).actually_burst == 4
        await node.create_client(Resume, "/player/resume").call(Resume.Request())
        result = await ended
    found = json.loads(result.out)
    assert (found["published"], found["topics"], found["rate"]) == (10, {"/chatter": 10}, 3)


async def test_a_burst(desk: Desk, tmp_path: Path) -> None:
    """Everything at once, and the end; or some messages, and then it waits, paused."""
    write_bag(tmp_path / "trip")
    async with desk.node() as node:
        result = await desk.callboard("bag", "burst", str(tmp_path / "trip"), "--json")
        assert json.loads(result.out)["published"] == 20
        ended = desk.start(
            "bag", "burst", str(tmp_path / "trip"), "-n", "3", "--topics", "/chatter", "--json"
        )
        client = node.create_client(Resume, "/bag_player/resume")
        await client.wait_for_service(20.0)
        paused = node.create_client(IsPaused, "/bag_player/is_paused")
        assert (await paused.call(IsPaused.Request())).paused
        await client.call(Resume.Request())
        assert json.loads((await ended).out)["published"] == 10


async def test_several_bags(desk: Desk, tmp_path: Path) -> None:
    """Each behind an -i of its own, and the storage behind it as ROS 2 has it."""
    write_bag(tmp_path / "one")
    write_bag(tmp_path / "two", 6)
    one, two = str(tmp_path / "one"), str(tmp_path / "two")
    result = await desk.callboard("bag", "play", "-i", one, "mcap", "--input", two, "--rate", "1000")
    assert result.out.splitlines() == [f"Playing {one}, {two}", f"{one}, {two}: 26 messages of 2 topics"]
    for arguments in ([], ["-i", one, two], ["-i", one, "mcap", two]):
        result = await desk.callboard("bag", "play", *arguments)
        assert (result.code, result.out) == (2, "")
        assert "with -i BAG -i BAG" in result.err or "name further bags with another -i" in result.err


async def test_service_requests(desk: Desk, tmp_path: Path) -> None:
    """They are sent to their services, and the last line counts those without a server."""
    event = service_event(SetBool)
    with Writer(tmp_path / "trip") as bag:
        for name in ("/lamp", "/other"):
            topic = bag.add_topic(BagTopic.of_class(f"{name}/_service_event", event))
            for kind in (EventKind.REQUEST_SENT, EventKind.REQUEST_RECEIVED):
                info = ServiceEventInfo(event_type=kind)
                message = event(info=info, request=[SetBool.Request(data=True)])
                bag.write(topic, cdr.encode(message), START_NS, START_NS)
    seen: list[bool] = []

    def handle(request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        seen.append(request.data)
        return response

    trip = str(tmp_path / "trip")
    async with desk.node() as node:
        node.create_service(SetBool, "/lamp", handle)
        await node.get_graph()
        result = await desk.callboard("bag", "play", trip, "--publish-service-requests")
        assert result.out.splitlines()[1] == f"{trip}: 1 message of 1 topic; not played: 1 without a server"
        source = ("--service-requests-source", "client_introspection", "--json")
        result = await desk.callboard("bag", "play", trip, "--publish-service-requests", *source)
    assert [result.json[each] for each in ("answered", "failed", "unserved")] == [1, 0, 1]
    assert seen == [True, True]


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["--remap", "/a"], "expected OLD:=NEW"),
        (["--rate", "1e300"], "rate must be from"),
        (["--regex", "("], "not a valid regular expression"),
        (["--clock", "1e6"], "--clock must be at most 1000 Hz, not"),
        (["--delay", "1e10"], "--delay must be from 0 to 1e9 s, not 1e+10"),
        (["--read-ahead-queue-size", "2000000"], "--read-ahead-queue-size must be from 1 to"),
        (["--clock", "--clock-topics-all"], "not allowed with"),
        (["-i", "other"], "Name 'trip' with -i, too"),
        (["--service-requests-source", "x"], "there is service_introspection"),
    ],
)
def test_wrong_options(arguments: list[str], text: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Each is refused with its reason, before anything is read."""
    with pytest.raises(SystemExit) as error:
        raise SystemExit(main(["bag", "play", "trip", *arguments]))
    assert error.value.code == 2
    assert text in capsys.readouterr().err


def test_the_line_with_the_position() -> None:
    """It says where, how fast, how much, and what was dropped."""
    found = PlayingStatistics(
        start_ns=START_NS,
        end_ns=START_NS + 60 * 10**9,
        position_ns=START_NS + 12_340_000_000,
        rate=1.1**2,
        is_paused=True,
        is_playing=True,
        passes=0,
        published=1234,
        dropped=5,
        invalid=0,
        answered=0,
        failed=0,
        unserved=0,
        topics={},
        problems=(),
    )
    assert progress_line(found) == "12.3 of 60.0 s, rate 1.21, 1,234 messages, 5 dropped, paused"
