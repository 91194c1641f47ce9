"""Loggers: rclpy's levels, filters and inheritance, over the standard logging module."""

from __future__ import annotations

import itertools
import logging
import time
from typing import TYPE_CHECKING, Any

import pytest

from actors.logging.logger import MAX_FILTERS, Logger, get_logger, node_logger_name
from actors.logging.severity import LoggingSeverity, severity_from_name
from actors.time.clock import Clock
from actors.time.types import Time

if TYPE_CHECKING:
    from collections.abc import Callable

_numbers = itertools.count()


@pytest.fixture
def name() -> str:
    """A logger name that no other test uses, because the standard module keeps loggers for ever."""
    return f"test_logger_{next(_numbers)}"


def five(call: Callable[[], bool]) -> list[bool]:
    return [call() for _ in range(5)]


def test_severities() -> None:
    """The numbers are ROS 2's; INFO is the default level."""
    assert [(severity.name, int(severity)) for severity in LoggingSeverity] == [
        ("UNSET", 0),
        ("DEBUG", 10),
        ("INFO", 20),
        ("WARN", 30),
        ("ERROR", 40),
        ("FATAL", 50),
    ]
    assert Logger("test_severities").get_effective_level() is LoggingSeverity.INFO


def test_severity_from_name() -> None:
    """Level words are read in any case; another word lists them."""
    assert severity_from_name("wArN") is LoggingSeverity.WARN
    with pytest.raises(ValueError, match="'foo' is not a log level, expected one of UNSET, DEBUG, INFO"):
        severity_from_name("foo")


@pytest.mark.parametrize(
    ("full", "expected"), [("/my_ns/my_node", "my_ns.my_node"), ("/my_node", "my_node"), ("/a/b/n", "a.b.n")]
)
def test_node_logger_name(full: str, expected: str) -> None:
    """Slashes become dots and the root namespace vanishes."""
    assert node_logger_name(full) == expected


def test_threshold(name: str, caplog: pytest.LogCaptureFixture) -> None:
    """A call below the threshold returns False and logs nothing, any other returns True."""
    logger = get_logger(name)
    logger.set_level(LoggingSeverity.WARN)
    results = [logger.debug("d"), logger.info("i"), logger.warning("w"), logger.warn("w2")]  # noqa: G010 - rclpy's name
    results += [logger.error("e"), logger.fatal("f")]
    assert results == [False, False, True, True, True, True]
    assert [record.levelno for record in caplog.records] == [30, 30, 40, 50]
    assert not logger.log("i", LoggingSeverity.INFO)
    assert logger.log("e", 40)


def test_record(name: str, caplog: pytest.LogCaptureFixture) -> None:
    """A record has the caller's place, a nanosecond stamp, and a message that is never a format."""
    before = time.time_ns()
    assert get_logger(name).info("100 %s {}")
    after = time.time_ns()
    (record,) = caplog.records
    assert record.name == f"callboard.{name}"
    assert record.getMessage() == "100 %s {}"
    assert (record.filename, record.funcName) == ("test_logger.py", "test_record")
    assert before <= record.stamp_ns <= after  # type: ignore[attr-defined]


def test_message_becomes_text_only_when_logged(name: str, caplog: pytest.LogCaptureFixture) -> None:
    """An object is turned into text only above the threshold."""

    class Costly:
        def __str__(self) -> str:
            raise AssertionError("formatted in vain")

    assert not get_logger(name).debug(Costly())
    assert get_logger(name).info(42)
    assert caplog.messages == ["42"]


def test_exception_is_attached(name: str, caplog: pytest.LogCaptureFixture) -> None:
    """exc_info adds the exception with its traceback, and alone is no filter."""
    error = ValueError("boom")
    for _ in range(2):
        assert get_logger(name).error("failed", exc_info=error)
    assert "ValueError: boom" in caplog.text
    assert len(caplog.records) == 2


def test_once(name: str) -> None:
    """`once` logs the first call only."""
    logger = get_logger(name)
    assert five(lambda: logger.info("x", once=True)) == [True, False, False, False, False]


def test_skip_first(name: str) -> None:
    """`skip_first` logs all but the first call."""
    logger = get_logger(name)
    assert five(lambda: logger.info("x", skip_first=True)) == [False, True, True, True, True]


def test_once_and_skip_first(name: str) -> None:
    """Both together log the second call only."""
    logger = get_logger(name)
    assert five(lambda: logger.info("x", once=True, skip_first=True)) == [False, True, False, False, False]


@pytest.mark.parametrize(
    ("skip_first", "expected"),
    [(False, [True, False, False, True, False]), (True, [False, False, False, True, False])],
)
def test_throttle(name: str, skip_first: bool, expected: list[bool]) -> None:
    """At most one message a second, also with the first one skipped."""
    times = iter([0.0, 0.4, 0.8, 1.2, 1.6])
    logger = Logger(name, monotonic=lambda: next(times))
    assert five(lambda: logger.info("x", throttle_duration_sec=1.0, skip_first=skip_first)) == expected


def test_throttle_by_a_clock(name: str) -> None:
    """A clock in the call is the one that throttles."""
    times = iter([0.0, 0.4, 0.8, 1.2, 1.6])

    class Simulated:
        def now(self) -> Time:
            return Time(seconds=next(times))

    clock = Simulated()
    logger = Logger(name, monotonic=lambda: 0.0)
    logged = five(lambda: logger.info("x", throttle_duration_sec=1.0, throttle_time_source_type=clock))
    assert logged == [True, False, False, True, False]


def test_filters_belong_to_a_line(name: str) -> None:
    """Two call sites have separate states, also on one line; get_logger anew keeps them."""
    for turn in range(2):
        pair = [get_logger(name).info("x", once=True), get_logger(name).info("x", once=True)]
        assert pair == ([True, True] if turn == 0 else [False, False])


def test_filters_count_only_what_is_enabled(name: str) -> None:
    """A call below the threshold does not use up `once`."""
    logger = get_logger(name)

    def call() -> bool:
        return logger.debug("x", once=True)

    assert not call()
    logger.set_level(LoggingSeverity.DEBUG)
    assert call()


def test_call_site_cannot_change(name: str) -> None:
    """Another severity or filter value at a line with filters is a ValueError."""
    logger = get_logger(name)

    def call(severity: LoggingSeverity, throttle: float) -> bool:
        return logger.log("x", severity, throttle_duration_sec=throttle)

    assert call(LoggingSeverity.INFO, 1.0)
    with pytest.raises(ValueError, match="cannot be changed between calls"):
        call(LoggingSeverity.WARN, 1.0)
    with pytest.raises(ValueError, match="cannot be changed between calls"):
        call(LoggingSeverity.INFO, 2.0)


def test_a_clock_without_a_duration(name: str) -> None:
    """The clock of a throttle alone is a TypeError, also below the threshold."""
    for call in (get_logger(name).info, get_logger(name).debug):
        with pytest.raises(TypeError, match="needs throttle_duration_sec"):
            call("text", throttle_time_source_type=Clock())


def test_unknown_option(name: str) -> None:
    """A misspelt option is a TypeError, also below the threshold."""
    wrong: dict[str, Any] = {"onec": True}
    for call in (get_logger(name).info, get_logger(name).debug):
        with pytest.raises(TypeError, match="'onec' is not one of the recognized logging options: once"):
            call("x", **wrong)


def test_children_inherit(name: str) -> None:
    """A child has its parent's level until it gets its own, and again after UNSET."""
    parent = get_logger(name)
    child = parent.get_child("child")
    assert child.name == f"{name}.child"
    parent.set_level(LoggingSeverity.ERROR)
    assert child.get_effective_level() is LoggingSeverity.ERROR
    assert not child.is_enabled_for(LoggingSeverity.WARN)
    child.set_level(LoggingSeverity.DEBUG)
    assert child.is_enabled_for(LoggingSeverity.DEBUG)
    assert parent.get_effective_level() is LoggingSeverity.ERROR
    child.set_level(LoggingSeverity.UNSET)
    assert child.get_effective_level() is LoggingSeverity.ERROR


def test_foreign_levels(name: str) -> None:
    """A level that the standard module was given and ROS lacks counts as the next higher one."""
    logger = get_logger(name)
    logging.getLogger(f"callboard.{name}").setLevel(25)
    assert logger.get_effective_level() is LoggingSeverity.WARN
    logging.getLogger(f"callboard.{name}").setLevel(99)
    assert logger.get_effective_level() is LoggingSeverity.FATAL


def test_empty_names_and_bad_levels(name: str) -> None:
    """An empty name or an unknown level is a ValueError."""
    with pytest.raises(ValueError, match="must not be empty"):
        get_logger("")
    with pytest.raises(ValueError, match="must not be empty"):
        get_logger(name).get_child("")
    with pytest.raises(ValueError, match="not a valid LoggingSeverity"):
        get_logger(name).set_level(7)


def test_get_logger_is_one_object(name: str) -> None:
    """The logger of a name is always the same, so that its filters work."""
    assert get_logger(name) is get_logger(name)
    assert repr(get_logger(name)) == f"Logger('{name}')"


def test_filters_of_code_made_on_the_way_are_bounded(name: str) -> None:
    """A program that makes code for ever makes no logger grow; the newest lines keep their state."""
    logger = get_logger(name)
    code = compile("", "made", "exec")
    for number in range(MAX_FILTERS + 10):
        code = compile(f"passed = logger.info('{number}', once=True)", "made", "exec")
        exec(code, {"logger": logger})
    assert logger.filters == MAX_FILTERS
    names: dict[str, object] = {"logger": logger}
    exec(code, names)
    assert names["passed"] is False
