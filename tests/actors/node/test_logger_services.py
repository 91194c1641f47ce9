"""The services that read and set the levels of a process's loggers, as another node calls them."""

from __future__ import annotations

import itertools
import logging
from typing import TYPE_CHECKING

import pytest

import actors
from actors import LoggingSeverity
from actors.interfaces.rcl_interfaces.msg import Log, LoggerLevel
from actors.interfaces.rcl_interfaces.srv import GetLoggerLevels, SetLoggerLevels
from actors.node import logger_services
from actors.node.logger_services import MAX_ITEMS
from tests.actors.meeting import until

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.actors.meeting import Meeting

UNKNOWN, DEBUG, WARN = LoggerLevel.LOG_LEVEL_UNKNOWN, LoggerLevel.LOG_LEVEL_DEBUG, LoggerLevel.LOG_LEVEL_WARN
INVALID = "Failed reason: Invalid logger level."
_numbers = itertools.count()


class Remote:
    """Calls the logger services of `/ns/server`."""

    def __init__(self, node: actors.Node) -> None:
        self._get = node.create_client(GetLoggerLevels, "/ns/server/get_logger_levels")
        self._set = node.create_client(SetLoggerLevels, "/ns/server/set_logger_levels")

    async def get(self, *names: str) -> list[tuple[str, int]]:
        await self._get.wait_for_service()
        response = await self._get.call(GetLoggerLevels.Request(names=list(names)))
        return [(each.name, each.level) for each in response.levels]

    async def set(self, *levels: tuple[str, int]) -> list[tuple[bool, str]]:
        await self._set.wait_for_service()
        wanted = [LoggerLevel(name=name, level=level) for name, level in levels]
        response = await self._set.call(SetLoggerLevels.Request(levels=wanted))
        return [(each.successful, each.reason) for each in response.results]


@pytest.fixture
def name() -> str:
    """The name of a logger that no other test uses."""
    return f"logger_services_{next(_numbers)}"


@pytest.fixture
async def server(meeting: Meeting) -> actors.Node:
    return await meeting.node("server", namespace="ns", enable_logger_service=True)


@pytest.fixture
async def remote(meeting: Meeting, server: actors.Node) -> Remote:
    assert server.connected
    return Remote(await meeting.node("caller"))


@pytest.fixture(autouse=True)
def levels() -> Iterator[None]:
    """The level above all is as before when a test has ended."""
    yield
    logging.getLogger("callboard").setLevel(logging.INFO)


async def test_they_are_there_if_wanted(meeting: Meeting, server: actors.Node) -> None:
    """A node has them only if it is asked to, and declares them without their definitions."""
    await meeting.node("other")
    assert await server.get_service_names_and_types() == [
        ("/ns/server/get_logger_levels", ["rcl_interfaces/srv/GetLoggerLevels"]),
        ("/ns/server/set_logger_levels", ["rcl_interfaces/srv/SetLoggerLevels"]),
    ]
    assert meeting.broker.stats().definitions == 0


async def test_levels_are_set_and_read(remote: Remote, name: str) -> None:
    """A level is a logger's own; one that inherits it, or that nobody knows, has none."""
    child = actors.get_logger(name).get_child("child")
    assert await remote.get(name, f"{name}.child", f"{name}.nobody") == [
        (name, UNKNOWN), (f"{name}.child", UNKNOWN), (f"{name}.nobody", UNKNOWN),
    ]  # fmt: skip
    assert await remote.set((name, DEBUG), (f"{name}.new", WARN)) == [(True, ""), (True, "")]
    assert await remote.get(name, f"{name}.child", f"{name}.new") == [
        (name, DEBUG), (f"{name}.child", UNKNOWN), (f"{name}.new", WARN),
    ]  # fmt: skip
    assert child.get_effective_level() is LoggingSeverity.DEBUG
    assert await remote.set((name, UNKNOWN)) == [(True, "")]
    assert child.get_effective_level() is LoggingSeverity.INFO


async def test_an_invalid_level(remote: Remote, name: str) -> None:
    """It is refused with rclpy's text, and the others of the request are set."""
    wanted = [(name, 22), (f"{name}.b", DEBUG), (name, 2**32 - 1)]
    assert await remote.set(*wanted) == [(False, INVALID), (True, ""), (False, INVALID)]
    assert await remote.get(name, f"{name}.b") == [(name, UNKNOWN), (f"{name}.b", DEBUG)]


async def test_the_logger_above_all(remote: Remote, name: str) -> None:
    """The empty name is the level that all others inherit; without one of its own it is INFO."""
    log = actors.get_logger(name)
    assert await remote.set(("", WARN)) == [(True, "")]
    assert await remote.get("") == [("", WARN)]
    assert log.get_effective_level() is LoggingSeverity.WARN
    assert await remote.set(("", UNKNOWN)) == [(True, "")]
    assert log.get_effective_level() is LoggingSeverity.INFO


async def test_reading_makes_no_loggers(remote: Remote, name: str) -> None:
    """Python keeps loggers for as long as a process runs, so that callers must not make any number."""
    await remote.get(name, f"{name}.below.far")
    assert not [each for each in logging.Logger.manager.loggerDict if name in each]


async def test_limits(remote: Remote, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """New loggers, their names and the loggers in one request are limited; known loggers can still be set."""
    monkeypatch.setattr(logger_services, "MAX_NEW_LOGGERS", 2)
    actors.get_logger(name)
    names = [f"{name}.{number}" for number in range(3)]
    results = await remote.set(*((each, DEBUG) for each in names), (name, DEBUG), (names[0], WARN))
    assert [successful for successful, _ in results] == [True, True, False, True, True]
    assert results[2][1] == "More than 2 new loggers"
    ((successful, reason),) = await remote.set(("n" * 1025, DEBUG))
    assert (successful, reason) == (False, "The name has more than 1024 characters")
    many = [name] * (MAX_ITEMS + 1)
    assert await remote.get(*many) == []
    assert await remote.set(*((each, WARN) for each in many)) == []


async def test_a_remote_level_changes_what_is_published(meeting: Meeting, remote: Remote, name: str) -> None:
    """A level that another node sets decides at once what reaches `/rosout`."""
    talker = await meeting.node(name, enable_rosout=True)
    lines: list[Log] = []
    talker.create_subscription(Log, "/rosout", lines.append, 10)
    talker.get_logger().debug("below")
    await remote.set((name, DEBUG))
    talker.get_logger().debug("passes")
    await until(lambda: lines)
    assert [line.msg for line in lines] == ["passes"]


def test_a_name_too_long_for_services(caplog: pytest.LogCaptureFixture) -> None:
    """A node whose name leaves no space for the services' names has none, and says so."""
    with caplog.at_level(logging.WARNING):
        node = actors.Node("n" * 245, start_parameter_services=False, enable_logger_service=True)
    assert "too long for logger services" in caplog.text
    node.destroy_node()
