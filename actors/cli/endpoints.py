"""How endpoints are shown: ROS 2's lines, or JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from actors.cli.names import unknown
from actors.cli.output import say_json
from actors.cli.place import inspector
from actors.cli.tables import Styled, say_styled
from actors.qos.profile import UNLIMITED
from proto.names import full_node_name

if TYPE_CHECKING:
    import argparse

    from actors.graph.snapshot import EndpointInfo
    from actors.qos.profile import QoSProfile
    from actors.time.types import Duration
    from proto.codes import EntryKind


class Side(NamedTuple):
    """Those at one end of a topic or service: their kind, name in JSON, and the heading of their number."""

    kind: EntryKind
    plural: str
    heading: str


def show_info(options: argparse.Namespace, what: str, name: str, *sides: Side) -> int:
    """Print what `topic info` and `service info` print; return the exit code.

    Args:
        options: Say where to look, whether in JSON, and whether to print each endpoint.
        what: "topic" or "service".
        name: Its full name.
        sides: Who is there, in this order.

    Raises:
        CommandError: There is no such name.
    """
    with inspector(options) as look:
        snapshot = look.graph()
    types = dict(snapshot.names_and_types(*(side.kind for side in sides)))
    if name not in types:
        raise unknown(f"Unknown {what} '{name}'", name, types)
    found = {side: snapshot.endpoints(side.kind, name) for side in sides}
    if options.json:
        lists = {side.plural: [document(each) for each in endpoints] for side, endpoints in found.items()}
        say_json({"name": name, "types": types[name], **lists})
    else:
        counted = {side.heading: endpoints for side, endpoints in found.items()}
        _say_info(types[name], counted, verbose=options.verbose)
    return 0


def _say_info(types: list[str], counted: dict[str, list[EndpointInfo]], *, verbose: bool) -> None:
    shown = types[0] if len(types) == 1 else str(types)
    say_styled("Type: ", Styled(shown if types else "any", "type"))  # any: only raw subscriptions
    if verbose:
        print()
    for heading, endpoints in counted.items():
        say_styled(f"{heading}: ", Styled(str(len(endpoints)), "heading"))
        if verbose:
            print()
            for endpoint in endpoints:
                _say_endpoint(endpoint)
                print()


def _say_endpoint(endpoint: EndpointInfo) -> None:
    for line in str(endpoint).splitlines():
        label, colon, value = line.partition(":")
        say_styled(Styled(label, "dim"), colon, Styled(value, "name" if label == "Node name" else ""))


def document(endpoint: EndpointInfo) -> dict[str, Any]:
    """Return an endpoint for JSON."""
    return {
        "node": full_node_name(endpoint.node_namespace, endpoint.node_name),
        "type": endpoint.topic_type,
        "type_hash": endpoint.topic_type_hash,
        "endpoint_id": endpoint.endpoint_id,
        "qos": _qos(endpoint.qos_profile),
    }


def _qos(profile: QoSProfile) -> dict[str, Any]:
    return {
        "history": profile.history.short_key,
        "depth": profile.depth,
        "reliability": profile.reliability.short_key,
        "durability": profile.durability.short_key,
        "lifespan_ns": _nanoseconds(profile.lifespan),
        "deadline_ns": _nanoseconds(profile.deadline),
        "liveliness": profile.liveliness.short_key,
        "liveliness_lease_duration_ns": _nanoseconds(profile.liveliness_lease_duration),
    }


def _nanoseconds(limit: Duration) -> int | None:
    return None if limit == UNLIMITED else limit.nanoseconds
