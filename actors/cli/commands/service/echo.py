"""`callboard service echo`: the service events of clients and servers (service introspection)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, cast

from actors.cli.parsing import Options, Parser, add_broker_options, add_print_options, add_qos_options
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.cli.echoing import EchoedTopic
    from actors.graph.snapshot import GraphSnapshot
    from actors.node.node import Node

EXAMPLES: Final = {
    "callboard service echo /add_two_ints": "what becomes of its calls, as far as its ends tell",
    "callboard service echo /add_two_ints --flow-style": "an event a line",
}


def add_arguments(parser: Parser) -> None:
    """Describe the arguments."""
    parser.add_argument("service", metavar="SERVICE", help="such as /add_two_ints")
    parser.add_argument(
        "type",
        metavar="TYPE",
        nargs="?",
        help="such as example_interfaces/srv/AddTwoInts; with it, a service may be yet to come",
    )
    add_print_options(parser)
    add_qos_options(parser)
    add_broker_options(parser)


def run(options: Options) -> int:
    """Print events until --once, a timeout or a signal ends it."""
    from actors.cli.echoing import EchoedTopic, echo
    from actors.cli.values import named_service
    from actors.endpoints.service_introspection import TOPIC_SUFFIX

    srv_type = None if options.type is None else named_service(options.type, options)

    def echoed_topics(node: Node, snapshot: GraphSnapshot) -> list[EchoedTopic]:
        service = node.resolve_service_name(options.service)
        _check_service(snapshot, service, typed=srv_type is not None)
        return [EchoedTopic(service + TOPIC_SUFFIX, _decoder(srv_type or _type_of(snapshot, service)))]

    return echo(options, echoed_topics)


def _check_service(snapshot: GraphSnapshot, service: str, *, typed: bool) -> None:
    """Warn if no events can arrive yet.

    Raises:
        CommandError: The service has no server and no client, and no type was given.
    """
    from actors.cli.errors import CommandError
    from actors.cli.output import print_err
    from actors.endpoints.service_introspection import TOPIC_SUFFIX
    from actors.tools.suggestions import did_you_mean

    if snapshot.count(EntryKind.PUBLISHER, service + TOPIC_SUFFIX):
        return
    known = dict(snapshot.names_and_types(EntryKind.SERVICE, EntryKind.CLIENT))
    if service in known:
        print_err(
            f"WARNING: no client or server of {service} publishes its calls yet; they do after "
            "configure_introspection(clock, qos, ServiceIntrospectionState.CONTENTS)"
        )
        return
    hint = did_you_mean(service, known)
    if typed:
        print_err(f"WARNING: service [{service}] is not there yet{hint}")
        return
    remedy = hint or f"; to wait for it, name its type: callboard service echo {service} TYPE"
    raise CommandError(f"Could not determine the type for the passed service: nobody has '{service}'{remedy}")


def _type_of(snapshot: GraphSnapshot, service: str) -> type[Any] | None:
    """Return the service's class, if it has one type and its class is installed."""
    from actors.interfaces.message import Service
    from actors.interfaces.registry import installed_interface

    types = dict(snapshot.names_and_types(EntryKind.SERVICE, EntryKind.CLIENT)).get(service, [])
    if len(types) != 1:
        return None
    found = installed_interface(types[0])
    return found if found is not None and issubclass(found, Service) else None


def _decoder(srv_type: type[Any] | None) -> Callable[[bytes], dict[str, Any]]:
    from actors.interfaces.codec import codec_for, decode_untyped
    from actors.interfaces.errors import InvalidMessageError, MessageBudgetError

    codec = None if srv_type is None else codec_for(srv_type.Event)

    def decode(data: bytes) -> dict[str, Any]:
        try:
            return named(decode_untyped(data) if codec is None else codec.decode(data))
        except MessageBudgetError:
            raise
        except InvalidMessageError:  # another type of the same name
            return named(decode_untyped(data))

    return decode


def named(event: Any) -> dict[str, Any]:
    """Return the fields of an event, with the name of its kind as in ROS 2: REQUEST_SENT."""
    from actors.endpoints.service_introspection import EventKind

    fields = _fields(event)
    info = _fields(fields.get("info"))
    kind = info.get("event_type")
    if kind in set(EventKind):
        info["event_type"] = EventKind(kind).name
    return {**fields, "info": info}


def _fields(value: Any) -> dict[str, Any]:
    if isinstance(value, dict):
        return dict(cast("dict[str, Any]", value))
    return {name: getattr(value, name) for name in getattr(value, "__struct_fields__", ())}
