"""Reads and sets the parameters of another node, through ROS 2's parameter services."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any, Final, TypeVar

from actors.callbacks.must_await import must_await
from actors.endpoints.context import time_limit
from actors.endpoints.endpoint import endpoint_of
from actors.errors import RemoteError
from actors.interfaces.rcl_interfaces import srv
from actors.parameters.errors import InvalidParameterFileError
from actors.parameters.types import (
    ListParametersResult,
    Parameter,
    ParameterDescriptor,
    ParameterType,
    SetParametersResult,
    parameter_value_to_python,
)
from actors.time.timeout import DEFAULT_TIMEOUT
from proto.untrusted_text import peer_text

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence
    from pathlib import Path

    from actors.endpoints.client.client import Client
    from actors.interfaces.rcl_interfaces.msg import SetParametersResult as ResultMessage
    from actors.node.node import Node
    from actors.time.timeout import Timeout

T = TypeVar("T")

_SERVICES: Final[dict[str, Any]] = {
    "describe_parameters": srv.DescribeParameters,
    "get_parameter_types": srv.GetParameterTypes,
    "get_parameters": srv.GetParameters,
    "list_parameters": srv.ListParameters,
    "set_parameters": srv.SetParameters,
    "set_parameters_atomically": srv.SetParametersAtomically,
}


class ParameterClient:
    """The parameters of another node.

    Each method is one call, with the deadline and the errors of `Client.call`: ServiceUnavailable if the node
    does not serve its parameters, ServiceTimeout, RemoteError if one of its callbacks raises. After an error
    of a call that sets parameters, `get_parameters` says what became of it.

    Args:
        node: The node that calls.
        remote_node_name: The name of the other node; relative to the namespace of `node` without a slash.

    Attributes:
        remote_node_name: The full name of the other node.

    Raises:
        InvalidServiceNameError: The name breaks the naming rules.
    """

    def __init__(self, node: Node, remote_node_name: str) -> None:
        full = node.resolve_service_name(f"{remote_node_name}/get_parameters", only_expand=True)
        self.remote_node_name = full.removesuffix("/get_parameters")
        self._node = node
        # Made when they are used: most programs need one or two of the six, and each is declared to the
        # broker.
        self._clients: dict[str, Client[Any, Any]] = {}
        """Made when they are first used."""

    def services_are_ready(self) -> bool:
        """Return whether all services are available now. The first call makes the clients, and returns False.

        Returns:
            True if each client is matched with a server.
        """
        # A list first: `all` on a generator would stop at the first, and the other clients would never be
        # made, nor become ready.
        ready = [self._client(name).service_is_ready() for name in _SERVICES]
        return all(ready)

    @must_await
    async def wait_for_services(self, timeout_sec: Timeout = DEFAULT_TIMEOUT) -> bool:
        """Wait until all services are available.

        Args:
            timeout_sec: Seconds to wait at most; None for no limit.

        Returns:
            True if they are; False if one was missing after `timeout_sec`.

        Raises:
            RuntimeError: The node does not run.
            NodeDestroyed: The node has been destroyed.
            ServiceUnavailable: The broker refuses a client; the text says why.
        """
        clients = [self._client(name) for name in _SERVICES]
        try:
            # One limit for all six, not one for each.
            async with time_limit(endpoint_of(clients[0]).context.limit_sec(timeout_sec)):
                for client in clients:
                    await client.wait_for_service(None)
        except TimeoutError:
            return False
        return True

    @must_await
    async def list_parameters(
        self, prefixes: Sequence[str] = (), depth: int = 0, timeout_sec: Timeout = DEFAULT_TIMEOUT
    ) -> ListParametersResult:
        """List the names of parameters.

        Args:
            prefixes: Only these names and those below them, levels separated by dots; empty for all.
            depth: Levels below each prefix, or from the top; 0 for all.
            timeout_sec: As for `Client.call`.

        Returns:
            The names, and what precedes the last dot of each.

        Raises:
            CallFailed: There is no reply.
        """
        response = await self._call("list_parameters", timeout_sec, prefixes=[*prefixes], depth=depth)
        return ListParametersResult(response.result.names, response.result.prefixes)

    @must_await
    async def get_parameters(
        self, names: Sequence[str], timeout_sec: Timeout = DEFAULT_TIMEOUT
    ) -> list[Parameter]:
        """Read parameters.

        Args:
            names: Their names.
            timeout_sec: As for `Client.call`.

        Returns:
            The parameters, in the same order; without a value (None) what is not declared, or not set.

        Raises:
            CallFailed: There is no reply, or an invalid one.
        """
        values = (await self._call("get_parameters", timeout_sec, names=[*names])).values
        found = self._each(
            "get_parameters",
            lambda value: (ParameterType(value.type), parameter_value_to_python(value)),
            values,
            len(names),
        )
        return [Parameter(name, *each) for name, each in zip(names, found, strict=True)]

    @must_await
    async def get_parameter_types(
        self, names: Sequence[str], timeout_sec: Timeout = DEFAULT_TIMEOUT
    ) -> list[ParameterType]:
        """Read the types of parameters.

        Args:
            names: Their names.
            timeout_sec: As for `Client.call`.

        Returns:
            The types, in the same order; NOT_SET for what is not declared, or not set.

        Raises:
            CallFailed: There is no reply, or an invalid one.
        """
        types = (await self._call("get_parameter_types", timeout_sec, names=[*names])).types
        return self._each("get_parameter_types", ParameterType, types, len(names))

    @must_await
    async def describe_parameters(
        self, names: Sequence[str], timeout_sec: Timeout = DEFAULT_TIMEOUT
    ) -> list[ParameterDescriptor]:
        """Read the constraints of parameters.

        Args:
            names: Their names.
            timeout_sec: As for `Client.call`.

        Returns:
            The descriptors, in the same order; with an empty name for what is not declared.

        Raises:
            CallFailed: There is no reply, or an invalid one.
        """
        descriptors = (await self._call("describe_parameters", timeout_sec, names=[*names])).descriptors
        return self._each("describe_parameters", ParameterDescriptor.from_msg, descriptors, len(names))

    @must_await
    async def set_parameters(
        self, parameters: Sequence[Parameter], timeout_sec: Timeout = DEFAULT_TIMEOUT
    ) -> list[SetParametersResult]:
        """Set parameters one by one; each has its own result.

        Args:
            parameters: Names and values.
            timeout_sec: As for `Client.call`.

        Returns:
            One result for each, in the same order.

        Raises:
            CallFailed: There is no reply, or an invalid one; some may have been set.
        """
        wanted = [each.to_parameter_msg() for each in parameters]
        results = (await self._call("set_parameters", timeout_sec, parameters=wanted)).results
        return self._each("set_parameters", _result, results, len(wanted))

    @must_await
    async def set_parameters_atomically(
        self, parameters: Sequence[Parameter], timeout_sec: Timeout = DEFAULT_TIMEOUT
    ) -> SetParametersResult:
        """Set all of the parameters, or none.

        Args:
            parameters: Names and values.
            timeout_sec: As for `Client.call`.

        Returns:
            The result for all.

        Raises:
            CallFailed: There is no reply; all may have been set, or none.
        """
        wanted = [each.to_parameter_msg() for each in parameters]
        return _result((await self._call("set_parameters_atomically", timeout_sec, parameters=wanted)).result)

    @must_await
    async def delete_parameters(
        self, names: Sequence[str], timeout_sec: Timeout = DEFAULT_TIMEOUT
    ) -> list[SetParametersResult]:
        """Remove parameters, whose type must be dynamic.

        Args:
            names: Their names.
            timeout_sec: As for `Client.call`.

        Returns:
            One result for each, in the same order.

        Raises:
            CallFailed: There is no reply, or an invalid one; some may have been removed.
        """
        return await self.set_parameters([Parameter(name) for name in names], timeout_sec)

    @must_await
    async def load_parameter_file(
        self,
        parameter_file: str | Path,
        use_wildcard: bool = False,  # noqa: FBT001, FBT002 - rclpy's order
        timeout_sec: Timeout = DEFAULT_TIMEOUT,
    ) -> dict[str, SetParametersResult]:
        """Set the parameters that a file has for the node, one by one.

        Args:
            parameter_file: A YAML file in the form of `callboard param dump`.
            use_wildcard: Also take what the file has for patterns such as `/**`.
            timeout_sec: As for `Client.call`.

        Returns:
            The results by the parameters' names, in the order of the file.

        Raises:
            InvalidParameterFileError: The file cannot be used, or has nothing for the node.
            CallFailed: There is no reply, or an invalid one; some may have been set.
        """
        from actors.parameters.overrides import load_parameter_file, overrides_for  # noqa: PLC0415 - only with files

        # In a thread: reading a file may block, and a file of 100,000 parameters takes seconds to parse.
        entries = await asyncio.to_thread(load_parameter_file, parameter_file)
        wanted = (entry for entry in entries if use_wildcard or "*" not in entry.pattern)
        values = overrides_for(wanted, self.remote_node_name)
        if not values:
            raise InvalidParameterFileError(str(parameter_file), f"no parameters of {self.remote_node_name}")
        parameters = [Parameter(name, value=value) for name, value in values.items()]
        return dict(zip(values, await self.set_parameters(parameters, timeout_sec), strict=True))

    def destroy(self) -> None:
        """Take the clients of the services out of service; calls in flight raise NodeDestroyed."""
        for client in self._clients.values():
            client.destroy()

    def _client(self, name: str) -> Client[Any, Any]:
        if name not in self._clients:
            self._clients[name] = self._node.create_client(_SERVICES[name], f"{self.remote_node_name}/{name}")
        return self._clients[name]

    async def _call(self, name: str, timeout_sec: Timeout, **fields: object) -> Any:
        return await self._client(name).call(_SERVICES[name].Request(**fields), timeout_sec)

    def _each(self, name: str, convert: Callable[[Any], T], items: Iterable[Any], count: int) -> list[T]:
        """Convert the items of a reply, which another implementation may have sent.

        Raises:
            RemoteError: There are not so many, or one is invalid.
        """
        service = self._client(name).srv_name
        try:
            # From another process, which may not be callboard: nothing in a reply is certain.
            found = [convert(item) for item in items]
        except ValueError as error:
            raise RemoteError("InvalidReply", peer_text(str(error)), service) from None
        if len(found) != count:
            raise RemoteError("InvalidReply", f"{len(found)} items for {count} parameters", service)
        return found


def _result(message: ResultMessage) -> SetParametersResult:
    return SetParametersResult(message.successful, message.reason)
