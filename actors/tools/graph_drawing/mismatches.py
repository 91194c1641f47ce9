"""Strict QoS in a drawing: the nodes that a topic does not connect, although both have it."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Final, NamedTuple

from proto.wire.codes import EntryKind
from proto.wire.qos import Refusal, incompatible_policy, parse_qos

if TYPE_CHECKING:
    from collections.abc import Iterable

    from proto.wire.codes import PolicyKind
    from proto.wire.frames import GraphEntry
    from proto.wire.qos import Qos

MAX_MISMATCHES: Final = 1000
"""Mismatches reported for one topic; the search ends there."""


class Mismatch(NamedTuple):
    """A publisher's and a subscription's node that strict QoS keeps apart.

    Attributes:
        topic: Its full name.
        publisher, subscriber: The full names of the nodes.
        policy: The last incompatible policy.
    """

    topic: str
    publisher: str
    subscriber: str
    policy: str


class _End(NamedTuple):
    """The part of an endpoint on which matching depends."""

    qos: Qos
    type_name: str
    type_hash: str


def mismatches_of(entries: Iterable[GraphEntry]) -> list[Mismatch]:
    """Return the pairs of nodes of which no publisher matches a subscription because of strict QoS.

    Args:
        entries: The endpoints.
    """
    topics: dict[str, dict[EntryKind, dict[_End, set[str]]]] = {}
    for entry in entries:
        if entry.kind in {EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION}:
            try:
                end = _End(parse_qos(entry.qos), entry.type_name, entry.type_hash)
            except Refusal:
                continue  # of a later version
            ends = topics.setdefault(entry.name, {}).setdefault(EntryKind(entry.kind), {})
            ends.setdefault(end, set()).add(entry.node)
    return [each for topic, ends in sorted(topics.items()) for each in _on_topic(topic, ends)]


def _on_topic(topic: str, ends: dict[EntryKind, dict[_End, set[str]]]) -> list[Mismatch]:
    offers, requests = ends.get(EntryKind.PUBLISHER, {}), ends.get(EntryKind.SUBSCRIPTION, {})
    matching: list[tuple[set[str], set[str]]] = []
    apart: dict[tuple[str, str], PolicyKind] = {}
    for offer, request in product(offers, requests):
        if request.type_name and request[1:] != offer[1:]:
            continue
        strict = offer.qos.strict or request.qos.strict
        policy = incompatible_policy(offer.qos, request.qos) if strict else None
        if policy is None:
            matching.append((offers[offer], requests[request]))
        else:
            for pair in product(sorted(offers[offer]), sorted(requests[request])):
                if len(apart) < MAX_MISMATCHES:
                    apart.setdefault(pair, policy)
    return [
        Mismatch(topic, source, target, policy.name)
        for (source, target), policy in sorted(apart.items())
        if not any(source in sources and target in targets for sources, targets in matching)
    ]
