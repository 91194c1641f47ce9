"""Message classes, messages and QoS profiles from a command line's arguments."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast

from actors.cli.errors import CommandError
from actors.cli.output import shortened
from actors.cli.parsing import Options, import_from_working_directory
from actors.errors import BrokerUnreachable
from actors.interfaces.convert import message_from_fields
from actors.interfaces.errors import UnknownInterfaceError
from actors.interfaces.message import Action, Message, Service, type_hash, type_name
from actors.interfaces.registry import find_interface
from actors.interfaces.yaml_reader import PlainText, YamlError, load_yaml
from actors.qos.profile import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSPresetProfiles,
    QoSProfile,
    ReliabilityPolicy,
)
from actors.tools.stamps import Stamps
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    import argparse

    from actors.graph.snapshot import GraphSnapshot

M = TypeVar("M", bound=Message)
_DONE_BY: Final = {
    EntryKind.PUBLISHER: "published",
    EntryKind.SUBSCRIPTION: "subscribed to",
    EntryKind.SERVICE: "served",
}


def named_interface(name: str, options: Options | None = None) -> type[Any]:
    """Return the class with this type name: an installed one, or one that a node publishes or serves.

    Args:
        name: The type's name; full, unless it is installed.
        options: Those of the command, with the broker's; None: only an installed one.

    Raises:
        UnknownInterfaceError: There is no such interface; the text suggests a similar one.
    """
    import_from_working_directory()
    try:
        return find_interface(name)
    except UnknownInterfaceError:
        found = None if options is None else _class_in_graph(name, options)
        if found is None:
            raise
        return found


def _class_in_graph(name: str, options: Options) -> type[Any] | None:
    from actors.cli.broker_target import open_inspector  # noqa: PLC0415 - seldom needed
    from actors.tools.definitions import class_in_graph  # noqa: PLC0415 - seldom needed

    if name.count("/") != 2:
        return None
    try:
        with open_inspector(options) as inspector:
            return class_in_graph(inspector, name)
    except BrokerUnreachable:  # the unknown type is the better error
        return None


def named_message(name: str, options: Options | None = None) -> type[Message]:
    """Return the message class with this type name."""
    found = named_interface(name, options)
    if not issubclass(found, Message):
        raise CommandError(
            f"'{type_name(found)}' is not a message type; write one such as std_msgs/msg/String"
        )
    return found


def named_service(name: str, options: Options | None = None) -> type[Service]:
    """Return the service class with this type name."""
    found = named_interface(name, options)
    if not issubclass(found, Service):
        example = "example_interfaces/srv/AddTwoInts"
        raise CommandError(f"'{type_name(found)}' is not a service type; write one such as {example}")
    return found


def named_action(name: str, options: Options | None = None) -> type[Action]:
    """Return the action class with this type name."""
    found = named_interface(name, options)
    if not issubclass(found, Action):
        example = "example_interfaces/action/Fibonacci"
        raise CommandError(f"'{type_name(found)}' is not an action type; write one such as {example}")
    return found


def message_from_text(msg_type: type[M], text: str) -> M:
    """Return a message with the values of a YAML map; an empty text means defaults.

    Raises:
        CommandError: The text is not a YAML map, or does not fit the type.
    """
    return _filled(msg_type, _fields(text))


def stamped_message_from_text(msg_type: type[M], text: str) -> tuple[M, Stamps]:
    """Return a message like `message_from_text`, and the places of `auto` and `now` in it.

    Raises:
        CommandError: The text is not a YAML map, or does not fit the type.
    """
    try:
        values, stamps = Stamps.taken_from(msg_type, _fields(text))
    except RecursionError:
        raise CommandError("Failed to populate a message: nested too deeply") from None
    return _filled(msg_type, values), stamps


def _filled(msg_type: type[M], values: dict[str, Any]) -> M:
    try:
        return message_from_fields(msg_type, values)
    except (AttributeError, OverflowError, TypeError, ValueError, RecursionError) as error:
        reason = "nested too deeply" if isinstance(error, RecursionError) else shortened(str(error))
        raise CommandError(f"Failed to populate a message: {reason}") from None


def _fields(text: str) -> dict[str, Any]:
    try:
        # The types of the fields decide what unquoted texts are.
        values = _json(text) or load_yaml(text, rules=PlainText)
    except YamlError as error:
        raise CommandError(f"The values are not YAML: {error}") from None
    if values is None:
        return {}
    if not isinstance(values, dict):
        raise CommandError(f"The values must be a YAML map such as '{{data: hello}}', got: {shortened(text)}")
    return {str(key): value for key, value in cast("Any", values).items()}


def _json(text: str) -> object:
    """Return the values of a JSON object, and None for any other text.

    YAML's rules differ from JSON's for some strings: for pairs of escaped surrogates, and control characters.
    """
    if text.lstrip()[:1] != "{":
        return None
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return None


def profile(options: argparse.Namespace, default: QoSProfile) -> QoSProfile:
    """Return `default`, or the preset of --qos-profile, changed by the other --qos options.

    What they leave open (`unknown`, `best_available`) is as in `default`, which fits the other endpoints.
    """
    preset = options.qos_profile
    base = default if preset is None else QoSPresetProfiles.get_from_short_key(preset)
    policies = {
        "history": (HistoryPolicy, options.qos_history),
        "reliability": (ReliabilityPolicy, options.qos_reliability),
        "durability": (DurabilityPolicy, options.qos_durability),
        "liveliness": (LivelinessPolicy, options.qos_liveliness),
    }
    changes: dict[str, Any] = {
        name: kind.get_from_short_key(key) for name, (kind, key) in policies.items() if key is not None
    }
    if options.qos_depth:
        changes["depth"] = options.qos_depth
    if options.qos_liveliness_lease_duration_seconds is not None:
        changes["liveliness_lease_duration"] = options.qos_liveliness_lease_duration_seconds
    chosen = replace(base, **changes)
    left_open = {
        name: getattr(default, name)
        for name in policies
        if getattr(chosen, name).short_key in {"unknown", "best_available"}
    }
    if "history" in left_open and not options.qos_depth:
        left_open["depth"] = default.depth
    return replace(chosen, **left_open)


def require_type(snapshot: GraphSnapshot, kind: EntryKind, name: str, wanted: type[Any]) -> bool:
    """Check that a topic's endpoints, or a service's servers, include one of a type; or that there are none.

    Returns:
        Whether there are any.

    Raises:
        CommandError: All have other types, which the text names.
    """
    offers = {(entry.type_name, entry.type_hash) for entry in snapshot.of_kind(kind) if entry.name == name}
    raw = any(not each for each, _ in offers)  # a subscription to all types
    if not offers or raw or (type_name(wanted), type_hash(wanted)) in offers:
        return bool(offers)
    own = type_name(wanted)
    types = sorted(f"another definition of {own}" if each == own else each for each, _ in offers)
    raise CommandError(f"'{name}' is {_DONE_BY[kind]} as {' and '.join(dict.fromkeys(types))}, not {own}")
