"""How endpoints are shown: ROS 2's lines, or JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.cli.tables import Styled, say_styled
from actors.qos import UNLIMITED
from proto.names import full_node_name

if TYPE_CHECKING:
    from actors.picture import EndpointInfo
    from actors.qos import QoSProfile
    from actors.time_types import Duration


def say_info(types: list[str], counted: dict[str, list[EndpointInfo]], *, verbose: bool) -> None:
    """Print what `topic info` and `service info` print.

    Args:
        types: Of the topic or service.
        counted: The endpoints below each of their headings.
        verbose: Whether to print each endpoint, and blank lines between all.
    """
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
