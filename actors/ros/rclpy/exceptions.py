"""rclpy's exceptions. Where callboard has the same error, it is the same class."""

from __future__ import annotations

from typing import TypeAlias

from actors.errors import TimeSourceChanged
from actors.parameters.errors import InvalidParameterException as InvalidParameterException
from actors.parameters.errors import InvalidParameterTypeException as InvalidParameterTypeException
from actors.parameters.errors import InvalidParameterValueException as InvalidParameterValueException
from actors.parameters.errors import ParameterAlreadyDeclaredException as ParameterAlreadyDeclaredException
from actors.parameters.errors import ParameterException as ParameterException
from actors.parameters.errors import ParameterImmutableException as ParameterImmutableException
from actors.parameters.errors import ParameterNotDeclaredException as ParameterNotDeclaredException
from actors.parameters.errors import ParameterUninitializedException as ParameterUninitializedException
from actors.ros.rclpy._rclpy_pybind11 import InvalidHandle as InvalidHandle
from actors.ros.rclpy._rclpy_pybind11 import TimerCancelledError as TimerCancelledError
from proto.errors import InvalidNameError
from proto.errors import InvalidNamespaceError
from proto.errors import InvalidNodeNameError
from proto.errors import InvalidServiceNameError
from proto.errors import InvalidTopicNameError

InvalidNamespaceException: TypeAlias = InvalidNamespaceError
InvalidNodeNameException: TypeAlias = InvalidNodeNameError
InvalidServiceNameException: TypeAlias = InvalidServiceNameError
InvalidTopicNameException: TypeAlias = InvalidTopicNameError
NameValidationException: TypeAlias = InvalidNameError
TimeSourceChangedError: TypeAlias = TimeSourceChanged


class NotInitializedException(Exception):
    """`rclpy.init` has not been called, or the context has been shut down."""

    def __init__(self, *args: object) -> None:
        super().__init__("rclpy.init() has not been called", *args)


class NoTypeSupportImportedException(Exception):
    """A class is no message, service or action class."""


class ROSInterruptException(Exception):
    """The context was shut down during a sleep."""

    def __init__(self) -> None:
        super().__init__("rclpy.shutdown() has been called")
