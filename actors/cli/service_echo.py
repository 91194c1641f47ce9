"""`callboard service echo`: what clients and servers tell of their calls (service introspection)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, cast

from actors.cli.errors import CommandError
from actors.cli.here import look_here
from actors.cli.listening import Listener
from actors.cli.loop import run_async
from actors.cli.message_printer import MessagePrinter
from actors.cli.output import note
from actors.cli.session import graph_of, session
from actors.cli.values import named_service, profile
from actors.endpoints.service_introspection import TOPIC_SUFFIX, EventKind
from actors.interfaces.codec import codec_for, decode_untyped
from actors.interfaces.errors import InvalidMessageError, UnknownInterfaceError
from actors.interfaces.message import Message, Service
from actors.interfaces.registry import find_interface
from actors.tools.hearing import profile_of
from actors.tools.suggestions import did_you_mean
from proto.codes import EntryKind

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable

    from actors.endpoints.subscription.backlog import MessageInfo
    from actors.graph.snapshot import GraphSnapshot

DEPTH: Final = 1000


def run(options: argparse.Namespace) -> int:
    """Print events until one was enough, a timeout or a signal."""
    printer = MessagePrinter(options)
    look_here()
    srv_type = None if options.type is None else named_service(options.type)
    run_async(lambda: _echo(options, srv_type, printer))
    return 0


async def _echo(options: argparse.Namespace, srv_type: type[Any] | None, printer: MessagePrinter) -> None:
    async with session(options) as node:
        service = node.resolve_service_name(options.service)
        topic = service + TOPIC_SUFFIX
        snapshot = await graph_of(node)
        _check_service(snapshot, service, typed=srv_type is not None)
        decode = _decoder(srv_type or _type_of(snapshot, service))
        qos = profile(options, profile_of(snapshot, topic, depth=DEPTH))
        with Listener(node, timeout_sec=options.timeout) as listener:

            def show(data: bytes, info: MessageInfo) -> None:
                if printer.show(data, info, decode) and options.once:
                    listener.enough()

            listener.hear(topic, show, qos)
            await listener.wait()


def _check_service(snapshot: GraphSnapshot, service: str, *, typed: bool) -> None:
    """Say what keeps events from coming.

    Raises:
        CommandError: Nobody serves or calls it, and no type says that it is yet to come.
    """
    if snapshot.count(EntryKind.PUBLISHER, service + TOPIC_SUFFIX):
        return
    known = dict(snapshot.names_and_types(EntryKind.SERVICE, EntryKind.CLIENT))
    if service in known:
        note(
            f"WARNING: nobody tells of the calls of {service} yet; its clients and servers do after "
            "configure_introspection(clock, qos, ServiceIntrospectionState.CONTENTS)"
        )
        return
    hint = did_you_mean(service, known)
    if typed:
        note(f"WARNING: service [{service}] is not there yet{hint}")
        return
    remedy = hint or f"; to wait for it, name its type: callboard service echo {service} TYPE"
    raise CommandError(f"Could not determine the type for the passed service: nobody has '{service}'{remedy}")


def _type_of(snapshot: GraphSnapshot, service: str) -> type[Any] | None:
    """Return the service's class, where it has one type and its class is at hand."""
    types = dict(snapshot.names_and_types(EntryKind.SERVICE, EntryKind.CLIENT)).get(service, [])
    if len(types) != 1:
        return None
    try:
        found = find_interface(types[0])
    except UnknownInterfaceError:
        return None
    return found if issubclass(found, Service) else None


def _decoder(srv_type: type[Any] | None) -> Callable[[bytes], dict[str, Any]]:
    codec = None if srv_type is None else codec_for(cast("type[Message]", srv_type.Event))

    def decode(data: bytes) -> dict[str, Any]:
        try:
            return named(decode_untyped(data) if codec is None else codec.decode(data))
        except InvalidMessageError:  # another type of the same name
            return named(decode_untyped(data))

    return decode


def named(event: Any) -> dict[str, Any]:
    """Return the fields of an event, the kind by its name as in ROS 2: REQUEST_SENT."""
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
