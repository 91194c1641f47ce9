"""The graph as plain data for JSON: what `--json` prints (docs/reference/json.md). Pure: no I/O."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, Final

from actors.graph.snapshot import actions_among
from actors.qos.profile import UNLIMITED
from actors.tools.graph_drawing.mismatches import mismatches_of
from proto.wire.codes import EntryKind
from proto.wire.names import full_node_name, is_hidden

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.graph.snapshot import EndpointInfo, GraphSnapshot, NamesAndTypes
    from actors.time.types import Duration
    from actors.tools.broker_names import BrokerNames

TOPIC_KINDS: Final = (EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION)
_SECTIONS: Final = {
    "subscribers": EntryKind.SUBSCRIPTION,
    "publishers": EntryKind.PUBLISHER,
    "service_servers": EntryKind.SERVICE,
    "service_clients": EntryKind.CLIENT,
}
_ACTION_SECTIONS: Final = {"action_servers": EntryKind.SERVICE, "action_clients": EntryKind.CLIENT}


def topics(snapshot: GraphSnapshot, *, hidden: bool = False) -> list[dict[str, Any]]:
    """Return the topics: name, types, publisher_count, subscription_count.

    Args:
        snapshot: The graph.
        hidden: Also names with a token that begins with `_`.
    """
    publishers, subscriptions = (
        Counter(entry.name for entry in snapshot.of_kind(kind)) for kind in TOPIC_KINDS
    )
    return [
        {
            "name": name,
            "types": types,
            "publisher_count": publishers[name],
            "subscription_count": subscriptions[name],
        }
        for name, types in _shown(snapshot.names_and_types(*TOPIC_KINDS), hidden=hidden)
    ]


def services(snapshot: GraphSnapshot, *, hidden: bool = False) -> list[dict[str, Any]]:
    """Return the services: name, types.

    Args:
        snapshot: The graph.
        hidden: Also names with a token that begins with `_`.
    """
    found = _shown(snapshot.names_and_types(EntryKind.SERVICE), hidden=hidden)
    return [{"name": name, "types": types} for name, types in found]


def actions(snapshot: GraphSnapshot, *, hidden: bool = False) -> list[dict[str, Any]]:
    """Return the actions: name, types.

    Args:
        snapshot: The graph.
        hidden: Also names with a token that begins with `_`.
    """
    found = actions_among(snapshot.names_and_types(EntryKind.SERVICE, EntryKind.CLIENT))
    return [{"name": name, "types": types} for name, types in _shown(found, hidden=hidden)]


def nodes(
    snapshot: GraphSnapshot, names: BrokerNames | None = None, *, hidden: bool = False
) -> list[dict[str, Any]]:
    """Return the nodes: name; in a mesh also broker, duplicate; labels of a node that has some.

    Args:
        snapshot: The graph.
        names: The names of the brokers if a mesh has several; else None.
        hidden: Also names with a token that begins with `_`.
    """
    duplicates = {} if names is None else snapshot.duplicate_nodes()
    found: list[dict[str, Any]] = []
    for entry in snapshot.of_kind(EntryKind.NODE):
        if hidden or not is_hidden(entry.node):
            place = {"broker": names[entry.broker], "duplicate": entry.node in duplicates} if names else {}
            found.append({"name": entry.node, **place, **_labels(snapshot.labels_of(entry))})
    return sorted(found, key=lambda node: (node["name"], node.get("broker", ""), [*node.get("labels", ())]))


def topic(snapshot: GraphSnapshot, name: str, names: BrokerNames | None = None) -> dict[str, Any] | None:
    """Return a topic: name, types, publishers, subscriptions, mismatches, or None.

    Args:
        snapshot: The graph.
        name: Its full name.
        names: As for `nodes`.
    """
    sides = {"publishers": EntryKind.PUBLISHER, "subscriptions": EntryKind.SUBSCRIPTION}
    return _named(snapshot, name, names, sides)


def service(snapshot: GraphSnapshot, name: str, names: BrokerNames | None = None) -> dict[str, Any] | None:
    """Return a service: name, types, clients, servers, mismatches, or None.

    Args:
        snapshot: The graph.
        name: Its full name.
        names: As for `nodes`.
    """
    return _named(snapshot, name, names, {"clients": EntryKind.CLIENT, "servers": EntryKind.SERVICE})


def action(snapshot: GraphSnapshot, name: str, _: BrokerNames | None = None) -> dict[str, Any] | None:
    """Return an action: name, types, clients, servers, or None.

    Args:
        snapshot: The graph.
        name: Its full name.
    """
    types = dict(actions_among(snapshot.names_and_types(EntryKind.SERVICE, EntryKind.CLIENT))).get(name)
    if types is None:
        return None
    sides = {"clients": EntryKind.CLIENT, "servers": EntryKind.SERVICE}
    return {
        "name": name,
        "types": types,
        **{side: action_nodes(snapshot, kind, name) for side, kind in sides.items()},
    }


def action_nodes(snapshot: GraphSnapshot, kind: EntryKind, name: str) -> list[dict[str, Any]]:
    """Return the nodes with servers or clients of an action: node, types.

    Args:
        snapshot: The graph.
        kind: SERVICE or CLIENT.
        name: The action's full name.
    """
    found: dict[str, set[str]] = {}  # nodes that share a name are one here
    for entry in snapshot.of_kind(kind):
        for action, types in actions_among([(entry.name, [entry.type_name])]):
            if action == name:
                found.setdefault(entry.node, set()).update(types)
    return [{"node": node, "types": sorted(found[node] - {""})} for node in sorted(found)]


def node(
    snapshot: GraphSnapshot, name: str, names: BrokerNames | None = None, *, hidden: bool = False
) -> dict[str, Any] | None:
    """Return a node: name, broker, labels, what it publishes, subscribes to, serves and calls; None for none.

    Args:
        snapshot: The graph.
        name: Its full name.
        names: As for `nodes`.
        hidden: Also what has a token that begins with `_`.
    """
    brokers = snapshot.node_brokers().get(name)
    if brokers is None:
        return None
    found = {title: snapshot.names_and_types(kind, node=name) for title, kind in _SECTIONS.items()}
    for title, kind in _ACTION_SECTIONS.items():
        found[title] = actions_among(snapshot.names_and_types(kind, node=name))
    return {
        "name": name,
        **({} if names is None else {"broker": names.joined(brokers)}),
        **_labels(snapshot.node_labels().get(name, {})),
        **{
            title: [{"name": each, "types": types} for each, types in _shown(listed, hidden=hidden)]
            for title, listed in found.items()
        },
    }


def endpoint(info: EndpointInfo, names: BrokerNames | None = None) -> dict[str, Any]:
    """Return an endpoint: node, node_labels, broker, type, type_hash, endpoint_id, qos.

    Args:
        info: The endpoint.
        names: As for `nodes`.
    """
    qos = info.qos_profile
    return {
        "node": full_node_name(info.node_namespace, info.node_name),
        **_labels(info.node_labels, "node_labels"),
        **({} if names is None else {"broker": names[info.broker]}),
        "type": info.topic_type,
        "type_hash": info.topic_type_hash,
        "endpoint_id": info.endpoint_id,
        "qos": {
            "history": qos.history.short_key,
            "depth": qos.depth,
            "reliability": qos.reliability.short_key,
            "durability": qos.durability.short_key,
            "lifespan_ns": _nanoseconds(qos.lifespan),
            "deadline_ns": _nanoseconds(qos.deadline),
            "liveliness": qos.liveliness.short_key,
            "liveliness_lease_duration_ns": _nanoseconds(qos.liveliness_lease_duration),
            "strict": info.strict_qos,
        },
    }


def _labels(labels: Mapping[str, str], key: str = "labels") -> dict[str, Any]:
    """Return the key of labels for a document; nodes without labels have none."""
    return {key: dict(labels)} if labels else {}


def _named(
    snapshot: GraphSnapshot, name: str, names: BrokerNames | None, sides: dict[str, EntryKind]
) -> dict[str, Any] | None:
    types = dict(snapshot.names_and_types(*sides.values()))
    if name not in types:
        return None
    found = {
        side: [endpoint(each, names) for each in snapshot.endpoints(kind, name)]
        for side, kind in sides.items()
    }
    apart = mismatches_of(entry for entry in snapshot.of_kind(*sides.values()) if entry.name == name)
    return {
        "name": name,
        "types": types[name],
        **found,
        "mismatches": [each.document() for each in apart],
    }


def _shown(found: NamesAndTypes, *, hidden: bool) -> NamesAndTypes:
    return [each for each in found if hidden or not is_hidden(each[0])]


def _nanoseconds(limit: Duration) -> int | None:
    return None if limit == UNLIMITED else limit.nanoseconds
