"""Loggers by name, and their levels."""

from __future__ import annotations

import logging as standard
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from actors.ros.rclpy import logging
from actors.ros.rclpy.clock import Clock
from actors.ros.rclpy.logging import LoggingSeverity

if TYPE_CHECKING:
    from collections.abc import Iterator


@pytest.fixture(autouse=True)
def _levels() -> Iterator[None]:
    """Restore the level of all loggers."""
    top = standard.getLogger("callboard")
    level = top.level
    yield
    logging.clear_config()
    top.setLevel(level)


def test_levels_are_own_or_inherited() -> None:
    """A logger has its own level or UNSET, and an effective one; clearing gives all the first one again."""
    logging.initialize()
    standard.getLogger("callboard").setLevel(standard.INFO)
    logging.set_logger_level("arm", LoggingSeverity.DEBUG)
    assert logging.get_logger_level("arm") is LoggingSeverity.DEBUG
    assert logging.get_logger_level("arm.joint") is LoggingSeverity.UNSET
    assert logging.get_logger_effective_level("arm.joint") is LoggingSeverity.DEBUG
    logging.clear_config()
    logging.shutdown()
    assert logging.get_logger_level("arm") is LoggingSeverity.UNSET
    assert logging.get_logger_effective_level("arm.joint") is LoggingSeverity.INFO


def test_the_root_logger_is_above_all_others() -> None:
    """Its level is that of "", others inherit it, and programs log with it before they have a node."""
    root = vars(logging)["_root_logger"]
    logging.set_logger_level("", LoggingSeverity.ERROR)
    assert logging.get_logger_level("") is logging.get_logger_effective_level("") is LoggingSeverity.ERROR
    assert logging.get_logger_effective_level("arm") is root.get_effective_level() is LoggingSeverity.ERROR
    assert root.get_child("arm") is logging.get_logger("arm")
    assert not root.info("starting")
    assert root.error("no map")


def test_severities_have_names() -> None:
    """A severity is found by its name in any case."""
    assert logging.get_logging_severity_from_string("warn") is LoggingSeverity.WARN
    with pytest.raises(RuntimeError, match="not a log level"):
        logging.get_logging_severity_from_string("loud")


def test_a_clock_throttles() -> None:
    """A log call takes the clock that throttles it, such as a node's."""
    logger, clock = logging.get_logger("throttled"), Clock()
    logged = [
        logger.error("x", throttle_duration_sec=1000.0, throttle_time_source_type=clock) for _ in range(2)
    ]
    assert logged == [True, False]


def test_the_folder_of_log_files(monkeypatch: pytest.MonkeyPatch) -> None:
    """Variables of ROS 2 name it, else it is in the user's home folder."""
    for name in ("ROS_LOG_DIR", "ROS_HOME"):
        monkeypatch.delenv(name, raising=False)
    assert logging.get_logging_directory() == Path.home() / ".ros" / "log"
    monkeypatch.setenv("ROS_HOME", "~/robot")
    assert logging.get_logging_directory() == Path.home() / "robot" / "log"
    monkeypatch.setenv("ROS_LOG_DIR", "/var/log/robot")
    assert logging.get_logging_directory() == Path("/var/log/robot")
