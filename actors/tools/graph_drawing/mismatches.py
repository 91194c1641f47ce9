"""Nodes that a topic or service does not connect, although both have it: types that differ, or strict QoS."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from proto.wire.codes import EntryKind
from proto.wire.qos import Refusal, incompatible_policy, parse_qos

if TYPE_CHECKING:
    from collections.abc import Iterable

    from proto.wire.frames import GraphEntry
    from proto.wire.qos import Qos

MAX_MISMATCHES: Final = 1000
"""Mismatches reported for one topic or service; the search ends there."""


class Mismatch(NamedTuple):
    """Two nodes that a topic or service does not connect.

    Attributes:
        name: The full name of the topic, service or action.
        source: The full name of the publisher's or the client's node.
        target: The full name of the subscription's or the server's node.
        policy: The last incompatible policy; empty if the types keep them apart.
        types: The type of the source's endpoint and of the target's; empty if QoS keeps them apart.
        kind: "topic", "service" or "action".
    """

    name: str
    source: str
    target: str
    policy: str = ""
    types: tuple[str, ...] = ()
    kind: str = "topic"

    @property
    def text(self) -> str:
        """A sentence that says what is not connected and why."""
        does, answers = ("publishes", "subscribes to") if self.kind == "topic" else ("calls", "serves")
        if self.policy:
            wants = f"with a QoS that {self.target} does not match: {self.policy}"
            return f"Not connected, as one of them is strict: {self.source} {does} {self.name} {wants}"
        one, other = self.types
        if one == other:
            ends = f"{self.source} {does} {self.name} and {self.target} {answers} it as {one}"
            return f"Not connected, as their definitions of the type differ: {ends}"
        ends = f"{self.source} {does} {self.name} as {one}, {self.target} {answers} it as {other}"
        return f"Not connected, as their types differ: {ends}"

    def document(self) -> dict[str, Any]:
        """Return it as plain data; docs/reference/json.md describes it."""
        ends = ("publisher", "subscriber") if self.kind == "topic" else ("client", "server")
        return {
            **dict(zip((self.kind, *ends), (self.name, self.source, self.target), strict=True)),
            "policy": self.policy or None,
            "types": list(self.types) or None,
            "text": self.text,
        }


class _End(NamedTuple):
    """The part of an endpoint on which matching depends."""

    type_name: str
    type_hash: str
    qos: Qos | None = None
    """None for services, whose QoS keeps nobody apart."""


_Ends = dict[_End, set[str]]
"""The nodes that have such endpoints."""


def mismatches_of(entries: Iterable[GraphEntry]) -> list[Mismatch]:
    """Return the pairs of nodes of which no endpoint matches one of the other's.

    Args:
        entries: The endpoints.

    Returns:
        The pairs, by topic and service, at most `MAX_MISMATCHES` of each.
    """
    ends: dict[tuple[str, EntryKind], _Ends] = {}
    for entry in entries:
        kind = EntryKind(entry.kind)
        try:
            qos = parse_qos(entry.qos) if kind in {EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION} else None
        except Refusal:
            continue  # of a later version
        end = _End(entry.type_name, entry.type_hash, qos)
        ends.setdefault((entry.name, kind), {}).setdefault(end, set()).add(entry.node)
    found: list[Mismatch] = []
    for (name, kind), sources in sorted(ends.items()):
        if kind is EntryKind.PUBLISHER:
            found += _between(name, sources, ends.get((name, EntryKind.SUBSCRIPTION), {}), "topic")
        elif kind is EntryKind.CLIENT:
            found += _between(name, sources, ends.get((name, EntryKind.SERVICE), {}), "service")
    return found


def _between(name: str, sources: _Ends, targets: _Ends, kind: str) -> list[Mismatch]:
    matching: list[tuple[set[str], set[str]]] = []
    apart: dict[tuple[str, str], Mismatch] = {}
    for offer, request in product(sources, targets):
        policy, types = _difference(offer, request)
        if not (policy or types):
            matching.append((sources[offer], targets[request]))
            continue
        for pair in product(sorted(sources[offer]), sorted(targets[request])):
            if len(apart) >= MAX_MISMATCHES:
                break
            apart.setdefault(pair, Mismatch(name, *pair, policy, types, kind))
    return [
        mismatch
        for (source, target), mismatch in sorted(apart.items())
        if not any(source in offering and target in asking for offering, asking in matching)
    ]


def _difference(offer: _End, request: _End) -> tuple[str, tuple[str, ...]]:
    """Return the policy or the two types that keep two endpoints apart; empty if they match."""
    # A raw subscription has no type and takes every one.
    if request.type_name and (request.type_name, request.type_hash) != (offer.type_name, offer.type_hash):
        return "", (offer.type_name, request.type_name)
    if offer.qos is None or request.qos is None or not (offer.qos.strict or request.qos.strict):
        return "", ()
    policy = incompatible_policy(offer.qos, request.qos)
    return "" if policy is None else policy.name, ()
