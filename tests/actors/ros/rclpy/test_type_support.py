"""Checks of classes, names and hashes."""

from __future__ import annotations

import pytest

from actors.interfaces.example_interfaces.action import Fibonacci
from actors.interfaces.example_interfaces.srv import AddTwoInts
from actors.interfaces.std_msgs.msg import String
from actors.ros.rclpy.exceptions import (
    InvalidHandle,
    InvalidParameterException,
    NoTypeSupportImportedException,
)
from actors.ros.rclpy.impl import implementation_singleton, logging_severity, rcutils_logger
from actors.ros.rclpy.logging import LoggingSeverity, get_logger
from actors.ros.rclpy.type_hash import TypeHash
from actors.ros.rclpy.type_support import (
    check_for_type_support,
    check_is_valid_msg_type,
    check_is_valid_srv_type,
)
from actors.ros.rclpy.validate_parameter_name import validate_parameter_name


class GeneratedType(type):
    """As ROS 2's classes have it."""

    def __import_type_support__(cls) -> None:
        """Load the C code."""


class Generated(metaclass=GeneratedType):
    """A class of ROS 2's own, without its C code."""


def test_classes_are_checked() -> None:
    """Messages, services and actions have type support, and are told from each other."""
    for each in (String, AddTwoInts, Fibonacci):
        check_for_type_support(each)
    with pytest.raises(AttributeError):
        check_for_type_support(int)
    with pytest.raises(NoTypeSupportImportedException):
        check_for_type_support(Generated)
    check_is_valid_msg_type(String)
    check_is_valid_srv_type(AddTwoInts)
    with pytest.raises(RuntimeError, match="no message class"):
        check_is_valid_msg_type(AddTwoInts)
    with pytest.raises(RuntimeError, match="no service class"):
        check_is_valid_srv_type(String)


def test_hashes_are_texts_and_bytes() -> None:
    """A hash is read from callboard's text and written back; any other text is an invalid hash."""
    text = "RIHS01_" + "0f" * 32
    assert TypeHash.from_text(text) == TypeHash(1, b"\x0f" * 32)
    assert str(TypeHash.from_text(text)) == text
    assert TypeHash.from_text("") == TypeHash()
    assert str(TypeHash(1, b"short")) == str(TypeHash()) == "INVALID"


def test_parameters_have_names() -> None:
    """The empty name is no parameter's."""
    assert validate_parameter_name("a.b")
    with pytest.raises(InvalidParameterException):
        validate_parameter_name("")


def test_internals_are_offered_as_far_as_they_make_sense() -> None:
    """The classes of loggers are there, and of the C library its errors."""
    assert isinstance(get_logger("x"), rcutils_logger.RcutilsLogger)
    assert logging_severity.LoggingSeverity is LoggingSeverity
    assert implementation_singleton.rclpy_implementation.InvalidHandle is InvalidHandle
