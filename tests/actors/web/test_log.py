"""The log of all nodes, for pages and as a stream."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.rcl_interfaces.msg import Log
from actors.web import log_reader
from actors.web.log_reader import LogFilter, LogReaders, TooManyLogReadersError
from tests.actors.meeting import DEADLINE_SEC, latched, until
from tests.actors.web.site import Page

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from tests.actors.meeting import Meeting
    from tests.actors.web.site import Site


@pytest.fixture
async def page(site: Site) -> AsyncIterator[Page]:
    """A page that has just connected."""
    async with site.client.ws_connect("/api/live") as socket:
        yield Page(socket)


async def lines_until(page: Page, last: str) -> list[dict[str, Any]]:
    """Return the lines of panel 1 up to one with this text."""
    lines: list[dict[str, Any]] = []
    while not lines or lines[-1]["msg"] != last:
        lines += (await page.next())["lines"]
    return lines


async def test_a_page_gets_the_kept_lines_and_then_new_ones(page: Page, meeting: Meeting) -> None:
    """As `callboard log --json` prints them."""
    node = await meeting.node("talker", enable_rosout=True)
    node.get_logger().warning("before")
    await node.get_graph()
    await page.open(1, "log")
    await lines_until(page, "before")
    node.get_logger().get_child("motor").error("after")
    line = (await lines_until(page, "after"))[-1]
    assert (line["node"], line["name"], line["severity"]) == ("/talker", "talker.motor", "ERROR")
    assert line["stamp"]["sec"] > 0


async def test_a_page_gets_the_kept_lines_of_all_nodes(page: Page, meeting: Meeting) -> None:
    """Each is latched by its own publisher."""
    publishers = [
        (await meeting.node(name)).create_publisher(Log, "/rosout", latched(10)) for name in ("a", "b")
    ]
    for number in range(6):
        publishers[number % 2].publish(Log(stamp=Time(sec=number), msg=str(number)))
    reader = await meeting.node("reader")
    await reader.get_graph()
    await page.open(1, "log")
    seen: list[str] = []
    while len(seen) < 6:
        seen += [each["msg"] for each in (await page.next())["lines"]]
    assert sorted(seen) == [str(number) for number in range(6)]


@pytest.mark.parametrize(
    ("chosen", "expected"),
    [
        ({}, "abcde"),
        ({"level": "warn"}, "bd"),
        ({"node": "/talker"}, "abc"),
        ({"node": "/ns"}, "e"),
        ({"node": "/ns/talker/"}, "e"),
        ({"node": "/"}, "abcde"),
        ({"node": "TALK"}, "abcde"),
        ({"node": "motor"}, "c"),
        ({"text": "HOT"}, "cd"),
        ({"text": "hot", "level": "warn", "node": "/talker2"}, "d"),
    ],
)
def test_lines_are_chosen_by_level_node_and_text(chosen: dict[str, Any], expected: str) -> None:
    """A full name is not the beginning of another one; a part of a name is found anywhere, in any case."""
    lines = {
        "a": (Log(level=20, name="talker", msg="fine"), "/talker"),
        "b": (Log(level=40, name="talker", msg="broken"), "/talker"),
        "c": (Log(level=10, name="talker.motor", msg="Hot"), "/talker"),
        "d": (Log(level=30, name="talker2", msg="too hot"), "/talker2"),
        "e": (Log(level=20, name="ns.talker", msg="fine"), "/ns/talker"),
    }
    matches = LogFilter(**chosen).matcher()
    assert "".join(key for key, line in lines.items() if matches(*line)) == expected


async def test_a_slow_reader_gets_the_newest_lines(
    site: Site, meeting: Meeting, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By their time; the others are counted."""
    monkeypatch.setattr(log_reader, "MAX_WAITING", 3)
    reader = LogReaders(site.observer).read(LogFilter(), lambda: None)
    node = await meeting.node("talker")
    publisher = node.create_publisher(Log, "/rosout", 100)
    await until(publisher.get_subscription_count)
    for number in (5, 1, 9, 7, 3, 8):
        publisher.publish(Log(stamp=Time(sec=number), msg=str(number)))
    await until(lambda: reader.skipped == 3)
    assert [each["msg"] for each in reader.pop()] == ["7", "8", "9"]
    reader.close()


async def test_readers_are_limited(site: Site, monkeypatch: pytest.MonkeyPatch) -> None:
    """One that is closed, even twice, makes room for one."""
    monkeypatch.setattr(log_reader, "MAX_READERS", 1)
    readers = LogReaders(site.observer)
    first = readers.read(LogFilter(), lambda: None)
    with pytest.raises(TooManyLogReadersError):
        readers.read(LogFilter(), lambda: None)
    first.close()
    first.close()
    readers.read(LogFilter(), lambda: None)
    with pytest.raises(TooManyLogReadersError):
        readers.read(LogFilter(), lambda: None)


async def test_the_log_is_a_stream_of_events(site: Site, meeting: Meeting) -> None:
    """With the same filters; a wrong one is refused."""
    node = await meeting.node("talker", enable_rosout=True)
    node.get_logger().info("quiet")
    node.get_logger().error("loud")
    async with asyncio.timeout(DEADLINE_SEC):
        async with site.client.get("/api/log", params={"level": "error", "node": "/talker"}) as response:
            event = await response.content.readuntil(b"\n\n")
    assert event.startswith(b"event: message\ndata: ")
    assert b'"msg":"loud"' in event
    assert "level" in (await site.json("/api/log?level=loud", 400))["error"]
    assert "nodes" in (await site.json("/api/log?nodes=a", 400))["error"]
