"""The services of rosapi, with which clients ask about the graph.

They are answered here, by their names: no other process is needed, and each user sees what the broker lets
that user see. Only if a node of the graph serves such a name, the call goes there.
"""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, Any, Final

import msgspec

from actors.errors import CallFailed
from actors.interfaces.definition_texts import definition_text
from actors.interfaces.errors import UnknownInterfaceError
from actors.interfaces.message import Message, Service
from actors.interfaces.registry import find_interface
from actors.parameters.types import ParameterType
from actors.tools import graph_documents
from actors.web.javascript_values import to_javascript
from actors.web.json_decoding import decode_json
from actors.web.json_encoding import encode_json
from actors.web.node_names import NODE_NAMES
from actors.web.node_watch import NODE_ANSWER_SEC
from actors.web.parameter_nodes import ParameterNodes, nodes_in
from actors.web.parameter_values import parameter_from_json
from actors.web.rosbridge.operations import OperationError
from actors.web.rosbridge.peer import full_name, full_type
from actors.web.rosbridge.type_definitions import type_definitions
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.graph.snapshot import GraphSnapshot
    from actors.web.rosbridge.operations import Arguments
    from actors.web.workspace import Workspace

PREFIX: Final = "/rosapi/"

NANOSECONDS: Final = 1_000_000_000

TYPES: Final = {
    "action_servers": "GetActionServers",
    "delete_param": "DeleteParam",
    "get_param": "GetParam",
    "get_param_names": "GetParamNames",
    "get_ros_version": "GetROSVersion",
    "get_time": "GetTime",
    "has_param": "HasParam",
    "message_details": "MessageDetails",
    "node_details": "NodeDetails",
    "nodes": "Nodes",
    "publishers": "Publishers",
    "service_node": "ServiceNode",
    "service_providers": "ServiceProviders",
    "service_request_details": "ServiceRequestDetails",
    "service_response_details": "ServiceResponseDetails",
    "service_type": "ServiceType",
    "services": "Services",
    "services_for_type": "ServicesForType",
    "set_param": "SetParam",
    "subscribers": "Subscribers",
    "topic_type": "TopicType",
    "topics": "Topics",
    "topics_and_raw_types": "TopicsAndRawTypes",
    "topics_for_type": "TopicsForType",
}
"""The types of the services, in the package rosapi_msgs, by the ends of their names."""

CONTROLS: Final = frozenset({"set_param", "delete_param"})
"""Services that change something."""

_FIELDS: Final = {
    "topic_type": ("topic",),
    "publishers": ("topic",),
    "subscribers": ("topic",),
    "node_details": ("node",),
    "service_type": ("service",),
    "service_node": ("service",),
    "service_providers": ("service",),
    "topics_for_type": ("type",),
    "services_for_type": ("type",),
    "message_details": ("type",),
    "service_request_details": ("type",),
    "service_response_details": ("type",),
    "get_param": ("name", "default_value"),
    "set_param": ("name", "value"),
    "has_param": ("name",),
    "delete_param": ("name",),
}
"""The fields of the requests that have some."""

_TOPIC_KINDS: Final = (EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION)


def service_of_rosapi(name: str) -> str:
    """Return the end of the name of a service of rosapi; "" for any other service.

    Args:
        name: The full name of a service.
    """
    end = name.removeprefix(PREFIX)
    return end if name.startswith(PREFIX) and end in TYPES else ""


async def answer(workspace: Workspace, service: str, args: Arguments) -> bytes:
    """Answer a request.

    Args:
        workspace: Of the user who asks.
        service: The end of the service's name.
        args: The request.

    Returns:
        The response as JSON.

    Raises:
        OperationError: The request does not fit.
        CallboardError: A type is not known, or a node does not answer.
    """
    given = _given(service, args)
    if service in _OF_NODES:
        return encode_json(await _OF_NODES[service](workspace, *given))
    if service in _OF_TYPES:
        found = find_interface(full_type(given[0], "msg" if service == "message_details" else "srv"))
        return encode_json(await workspace.work.run(_OF_TYPES[service], found))
    # The newest graph: a client asks for what another operation of it has just made.
    snapshot = NODE_NAMES.without_own(await workspace.observer.newest())
    return await workspace.work.run(lambda: encode_json(_OF_GRAPH[service](snapshot, *given)))


def _given(service: str, args: Arguments) -> list[str]:
    names = _FIELDS.get(service, ())
    values = args if isinstance(args, dict) else dict(zip(names, args or (), strict=False))
    given = [values.get(name, "") for name in names]
    if not all(isinstance(each, str) for each in given):
        raise OperationError(f"The fields of the request are strings: {', '.join(names)}")
    return given


# Of the graph


def _topics(snapshot: GraphSnapshot) -> dict[str, Any]:
    found = graph_documents.topics(snapshot)
    return {"topics": [each["name"] for each in found], "types": [_first(each["types"]) for each in found]}


def _topics_and_raw_types(snapshot: GraphSnapshot) -> dict[str, Any]:
    found = _topics(snapshot)
    return {**found, "typedefs_full_text": [_full_text(each) for each in found["types"]]}


def _topics_for_type(snapshot: GraphSnapshot, kind: str) -> dict[str, Any]:
    wanted = full_type(kind, "msg")
    return {"topics": [each["name"] for each in graph_documents.topics(snapshot) if wanted in each["types"]]}


def _topic_type(snapshot: GraphSnapshot, topic: str) -> dict[str, Any]:
    return {"type": _first(dict(snapshot.names_and_types(*_TOPIC_KINDS)).get(full_name(topic), []))}


def _services(snapshot: GraphSnapshot) -> dict[str, Any]:
    found = [each["name"] for each in graph_documents.services(snapshot)]
    return {"services": sorted({*found, *(PREFIX + end for end in TYPES)})}


def _services_for_type(snapshot: GraphSnapshot, kind: str) -> dict[str, Any]:
    wanted = full_type(kind, "srv")
    found = graph_documents.services(snapshot)
    return {"services": [each["name"] for each in found if wanted in each["types"]]}


def _service_type(snapshot: GraphSnapshot, service: str) -> dict[str, Any]:
    name = full_name(service)
    kind = _first(dict(snapshot.names_and_types(EntryKind.SERVICE)).get(name, []))
    if not kind and (end := service_of_rosapi(name)):
        kind = f"rosapi_msgs/srv/{TYPES[end]}"
    return {"type": kind}


def _nodes(snapshot: GraphSnapshot) -> dict[str, Any]:
    return {"nodes": sorted({each["name"] for each in graph_documents.nodes(snapshot)})}


def _node_details(snapshot: GraphSnapshot, node: str) -> dict[str, Any]:
    name = full_name(node)
    kinds = {
        "subscribing": EntryKind.SUBSCRIPTION,
        "publishing": EntryKind.PUBLISHER,
        "services": EntryKind.SERVICE,
    }
    return {
        key: [each for each, _ in snapshot.names_and_types(kind, node=name)] for key, kind in kinds.items()
    }


def _action_servers(snapshot: GraphSnapshot) -> dict[str, Any]:
    return {"action_servers": [each["name"] for each in graph_documents.actions(snapshot)]}


def _publishers(snapshot: GraphSnapshot, topic: str) -> dict[str, Any]:
    return {"publishers": _nodes_with(snapshot, EntryKind.PUBLISHER, topic)}


def _subscribers(snapshot: GraphSnapshot, topic: str) -> dict[str, Any]:
    return {"subscribers": _nodes_with(snapshot, EntryKind.SUBSCRIPTION, topic)}


def _service_providers(snapshot: GraphSnapshot, service: str) -> dict[str, Any]:
    return {"providers": _nodes_with(snapshot, EntryKind.SERVICE, service)}


def _service_node(snapshot: GraphSnapshot, service: str) -> dict[str, Any]:
    return {"node": _first(_nodes_with(snapshot, EntryKind.SERVICE, service))}


def _nodes_with(snapshot: GraphSnapshot, kind: EntryKind, name: str) -> list[str]:
    full = full_name(name)
    return sorted({each.node for each in snapshot.of_kind(kind) if each.name == full})


def _first(found: list[str]) -> str:
    return found[0] if found else ""


def _full_text(kind: str) -> str:
    try:
        found = find_interface(kind)
        return definition_text(found) if issubclass(found, Message) else ""
    except UnknownInterfaceError as error:
        return f"# {error}"


def _get_time(_: GraphSnapshot) -> dict[str, Any]:
    sec, nanosec = divmod(time.time_ns(), NANOSECONDS)
    return {"time": {"sec": sec, "nanosec": nanosec}}


def _get_ros_version(_: GraphSnapshot) -> dict[str, Any]:
    return {"version": 2, "distro": "kilted"}


_OF_GRAPH: Final[dict[str, Callable[..., dict[str, Any]]]] = {
    "topics": _topics,
    "topics_and_raw_types": _topics_and_raw_types,
    "topics_for_type": _topics_for_type,
    "topic_type": _topic_type,
    "services": _services,
    "services_for_type": _services_for_type,
    "service_type": _service_type,
    "service_node": _service_node,
    "service_providers": _service_providers,
    "nodes": _nodes,
    "node_details": _node_details,
    "action_servers": _action_servers,
    "publishers": _publishers,
    "subscribers": _subscribers,
    "get_time": _get_time,
    "get_ros_version": _get_ros_version,
}


# Of types


def _message_details(found: type[Any]) -> dict[str, Any]:
    return {"typedefs": type_definitions(found) if issubclass(found, Message) else []}


def _request_details(found: type[Any]) -> dict[str, Any]:
    return {"typedefs": _part_definitions(found, "Request")}


def _response_details(found: type[Any]) -> dict[str, Any]:
    return {"typedefs": _part_definitions(found, "Response")}


def _part_definitions(found: type[Any], part: str) -> list[dict[str, Any]]:
    return type_definitions(getattr(found, part)) if issubclass(found, Service) else []


_OF_TYPES: Final[dict[str, Callable[[Any], dict[str, Any]]]] = {
    "message_details": _message_details,
    "service_request_details": _request_details,
    "service_response_details": _response_details,
}


# Of nodes: their parameters, named NODE:PARAMETER, with values in JSON


async def _get_param(workspace: Workspace, name: str, default: str) -> dict[str, Any]:
    node, parameter = _node_and_parameter(name)
    try:
        async with workspace.shared(ParameterNodes).client(node) as client:
            found = (await client.get_parameters([parameter], NODE_ANSWER_SEC))[0].value
    except CallFailed:  # as without a value: the client has said what it wants then
        found = None
    if found is None:
        return {"value": default or '""'}
    value = list(found) if isinstance(found, bytes | bytearray) else found
    return {"value": encode_json(to_javascript(value)).decode()}


async def _set_param(workspace: Workspace, name: str, value: str) -> dict[str, Any]:
    node, parameter = _node_and_parameter(name)
    try:
        decoded = decode_json(value, object)
    except msgspec.DecodeError as error:
        raise OperationError(f"The value of a parameter is JSON: {error}") from None
    async with workspace.shared(ParameterNodes).client(node) as client:
        kind = (await client.get_parameter_types([parameter], NODE_ANSWER_SEC))[0]
        wanted = parameter_from_json(parameter, kind or None, decoded)
        result = (await client.set_parameters([wanted], NODE_ANSWER_SEC))[0]
    if not result.successful:
        raise OperationError(f"'{name}' has not been set: {result.reason}")
    return {}


async def _has_param(workspace: Workspace, name: str) -> dict[str, Any]:
    node, parameter = _node_and_parameter(name)
    try:
        async with workspace.shared(ParameterNodes).client(node) as client:
            kind = (await client.get_parameter_types([parameter], NODE_ANSWER_SEC))[0]
    except CallFailed:
        return {"exists": False}
    return {"exists": kind is not ParameterType.NOT_SET}


async def _delete_param(workspace: Workspace, name: str) -> dict[str, Any]:
    node, parameter = _node_and_parameter(name)
    async with workspace.shared(ParameterNodes).client(node) as client:
        result = (await client.delete_parameters([parameter], NODE_ANSWER_SEC))[0]
    if not result.successful:
        raise OperationError(f"'{name}' has not been deleted: {result.reason}")
    return {}


async def _get_param_names(workspace: Workspace) -> dict[str, Any]:
    async def names_of(node: str) -> list[str]:
        try:
            async with workspace.shared(ParameterNodes).client(node) as client:
                found = await client.list_parameters((), 0, NODE_ANSWER_SEC)
        except CallFailed:  # it may have stopped
            return []
        return [f"{node}:{each}" for each in found.names]

    nodes = sorted(nodes_in(await workspace.observer.newest()))
    found = await asyncio.gather(*map(names_of, nodes))
    return {"names": [each for names in found for each in sorted(names)]}


def _node_and_parameter(name: str) -> tuple[str, str]:
    node, separator, parameter = name.partition(":")
    if not (node and separator and parameter):
        raise OperationError(f"A parameter has a name such as /node:parameter, not '{name}'")
    return full_name(node), parameter


_OF_NODES: Final[dict[str, Callable[..., Any]]] = {
    "get_param": _get_param,
    "set_param": _set_param,
    "has_param": _has_param,
    "delete_param": _delete_param,
    "get_param_names": _get_param_names,
}
