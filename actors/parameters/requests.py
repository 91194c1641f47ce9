"""Handlers of ROS 2's six services for a node's parameters. No I/O.

They answer as rclpy's do: an unknown name has an empty description, the type NOT_SET and no value, and cannot
be set.
"""

from __future__ import annotations

from collections.abc import Sized
from typing import TYPE_CHECKING, Any, Final, TypeVar

from actors.interfaces.rcl_interfaces.msg import (
    ListParametersResult,
    ParameterDescriptor,
    ParameterEvent,
    ParameterValue,
    SetParametersResult,
)
from actors.interfaces.rcl_interfaces.srv import (
    DescribeParameters,
    GetParameters,
    GetParameterTypes,
    ListParameters,
    SetParameters,
    SetParametersAtomically,
)
from actors.parameters.errors import ParameterNotDeclaredError, ParameterUninitializedError
from actors.parameters.types import Parameter, ParameterType

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actors.interfaces.builtin_interfaces.msg import Time
    from actors.interfaces.rcl_interfaces.msg import Parameter as ParameterMessage
    from actors.parameters.changes import ParameterChanges
    from actors.parameters.store import ParameterStore

T = TypeVar("T")

MAX_ITEMS: Final = 10_000
"""Names, or parameters, in one request. One with more is answered with an empty list, or refused."""


class ParameterRequests:
    """Handles requests about one node's parameters.

    Args:
        parameters: The parameters.
        require_fits: Raises if a reply, named by its first argument, of a number of bytes cannot be sent.
    """

    def __init__(self, parameters: ParameterStore, require_fits: Callable[[str, int], object]) -> None:
        self._parameters = parameters
        self._require_fits = require_fits

    def handlers(self) -> tuple[tuple[str, Any, Callable[[Any], Any]], ...]:
        """Return the name of each service below the node's, its type, and its handler."""
        return (
            ("describe_parameters", DescribeParameters, self._describe),
            ("get_parameter_types", GetParameterTypes, self._get_types),
            ("get_parameters", GetParameters, self._get),
            ("list_parameters", ListParameters, self._list),
            ("set_parameters", SetParameters, self._set),
            ("set_parameters_atomically", SetParametersAtomically, self._set_atomically),
        )

    def _found(self, names: list[str]) -> Iterator[Parameter | None]:
        for name in _limited(names):
            try:
                yield self._parameters.get(name)
            # An unknown name is an answer, not an error: the others in the request get their values.
            except (ParameterNotDeclaredError, ParameterUninitializedError):
                yield None

    def _describe(self, request: DescribeParameters.Request) -> DescribeParameters.Response:
        parameters = self._parameters
        return DescribeParameters.Response(
            descriptors=[
                parameters.describe(name).to_msg() if parameters.has(name) else ParameterDescriptor()
                for name in _limited(request.names)
            ]
        )

    def _get_types(self, request: GetParameterTypes.Request) -> GetParameterTypes.Response:
        found = self._found(request.names)
        types = [ParameterType.NOT_SET if each is None else each.type_ for each in found]
        return GetParameterTypes.Response(types=bytes(types))

    def _get(self, request: GetParameters.Request) -> GetParameters.Response:
        values: list[ParameterValue] = []
        size = 0
        for each in self._found(request.names):
            if each is not None and isinstance(each.value, Sized):
                size += len(each.value)  # encoded it has no fewer bytes
                # Before it is encoded: one large value, asked for many times, would fill the memory.
                self._require_fits("A reply of 'get_parameters'", size)
            values.append(ParameterValue() if each is None else each.get_parameter_value())
        return GetParameters.Response(values=values)

    def _list(self, request: ListParameters.Request) -> ListParameters.Response:
        listed = self._parameters.list_names(request.prefixes, request.depth)
        result = ListParametersResult(names=listed.names, prefixes=listed.prefixes)
        return ListParameters.Response(result=result)

    def _set(self, request: SetParameters.Request) -> SetParameters.Response:
        # One by one: a refused parameter must not affect the others.
        results = [self._set_together([each]) for each in _limited(request.parameters)]
        return SetParameters.Response(results=results)

    def _set_atomically(self, request: SetParametersAtomically.Request) -> SetParametersAtomically.Response:
        return SetParametersAtomically.Response(result=self._set_together(request.parameters))

    def _set_together(self, messages: list[ParameterMessage]) -> SetParametersResult:
        if len(messages) > MAX_ITEMS:
            return SetParametersResult(successful=False, reason=f"more than {MAX_ITEMS} parameters")
        try:
            parameters = [Parameter.from_parameter_msg(each) for each in messages]
        except ValueError as error:  # no such type
            return SetParametersResult(successful=False, reason=str(error))
        try:
            result = self._parameters.set_atomically(parameters)
        except ParameterNotDeclaredError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=result.successful, reason=result.reason)


def _limited(items: list[T]) -> list[T]:
    return items if len(items) <= MAX_ITEMS else []


def event_message(changes: ParameterChanges, stamp: Time, node: str) -> ParameterEvent:
    """Return the message for `/parameter_events`.

    Args:
        changes: The changes.
        stamp: When.
        node: The full name of the node.
    """
    return ParameterEvent(
        stamp=stamp,
        node=node,
        new_parameters=_messages(changes.new),
        changed_parameters=_messages(changes.changed),
        deleted_parameters=_messages(changes.deleted),
    )


def _messages(parameters: list[Parameter]) -> list[ParameterMessage]:
    return [each.to_parameter_msg() for each in parameters]
