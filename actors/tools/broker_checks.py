"""Checks of a broker's welcome, counters and graph. Pure: nothing here does I/O."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING, Final

from actors.qos.compatibility import disagreements
from actors.tools.broker_names import BrokerNames
from actors.tools.check import Check, summed_up
from actors.tools.overview import WITHHELD
from proto.wire.codes import Capability, EntryKind
from proto.wire.identity import VERSION, version_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.graph.broker_report import BrokerReport
    from actors.graph.snapshot import EndpointInfo, GraphSnapshot
    from actors.tools.check import Status
    from proto.wire.frames import GraphEntry
    from proto.wire.stats import BrokerStats, LinkStats

SKEW_SEC: Final = 0.1
"""A larger difference of the clocks makes delays between machines wrong."""
WRONG_CLOCK_SEC: Final = 10.0
"""A larger difference means a wrong clock: messages may expire before they are delivered."""
LATE_SEC: Final = 0.1
"""The longest acceptable lag of a broker's event loop."""
LIMITS: Final = {
    "refused_per_address": (
        "connections refused: too many of one address",
        "look for a client that connects too often, or raise --max-connections-per-address",
    ),
    "unauthorized_connections": (
        "connections without valid credentials",
        "give their users tokens with `callboard auth`",
    ),
    "tls_failures": ("connections failed in TLS", "compare the certificates and authorities of both sides"),
    "reassembly_timeouts": (
        "connections closed: a message stayed incomplete",
        "look for a frozen publisher or a cut network",
    ),
    "stalls": (
        "KEEP_ALL subscriptions took nothing and lost messages",
        "iterate them, use KEEP_LAST, or give them a longer stall_timeout_sec",
    ),
    "departed_overflows": (
        "queues of publishers that have gone were emptied",
        "let the readers read faster, and publishers restart less often",
    ),
    "refused_declarations": (
        "declarations, watches and INSPECTs refused",
        "declare less in one node, or raise the limit that the log names",
    ),
    "overloaded_calls": (
        "calls refused: too much waited for their server",
        "let the server read faster, or raise --max-queued-call-bytes",
    ),
    "refused_messages": ("large messages discarded: the broker held too much", "raise --max-broker-bytes"),
    "closed_for_memory": ("connections closed: the broker held too much", "raise --max-broker-bytes"),
    "refused_arenas": (
        "failed attempts to share memory: large messages go as bytes",
        "see docs/how-to/containers.md",
    ),
    "refused_definitions": ("type definitions not kept", "generate the classes again from one .msg or .srv"),
}
"""By counter, the limit that was reached, and the remedy."""
MAX_PROFILES: Final = 32
"""Different QoS profiles that are compared on each side of a topic."""


def greeting(welcome: Mapping[str, object], ahead_sec: float | None, round_trip_sec: float) -> list[Check]:
    """Return the checks of the broker's version and clock.

    Args:
        welcome: The options of its welcome.
        ahead_sec: By how much its clock is ahead of this machine's; None if unknown.
        round_trip_sec: The time that the greeting took.
    """
    agent = str(welcome.get("agent", ""))
    version = version_of(agent)
    if version == VERSION:
        checks = [Check("versions", "ok", f"{agent}, as here")]
    else:
        remedy = "run the same version on both sides; both speak the same protocol, so most things work"
        checks = [
            Check(
                "versions", "warn", f"the broker is {agent or 'of unknown make'}, here is {VERSION}", remedy
            )
        ]
    if ahead_sec is None:
        return [*checks, Check("clock", "skip", "the broker does not tell its time")]
    sure = max(0.0, abs(ahead_sec) - round_trip_sec / 2)
    apart = f"the broker's is {abs(ahead_sec):.3f} s {'ahead' if ahead_sec > 0 else 'behind'}"
    if sure <= SKEW_SEC:
        within = max(abs(ahead_sec) + round_trip_sec / 2, 0.001)
        return [*checks, Check("clock", "ok", f"the broker's and this one agree within {within:.3f} s")]
    status: Status = "fail" if sure > WRONG_CLOCK_SEC else "warn"
    remedy = "set the clocks with NTP: delays and lifespans are measured with them"
    return [*checks, Check("clock", status, apart, remedy)]


def shared_memory(welcome: Mapping[str, object], totals: BrokerStats) -> Check:
    """Return whether large messages of this process would pass through shared memory, and how many have.

    Args:
        welcome: The options of the broker's welcome.
        totals: Its counters.
    """
    counts = (
        WITHHELD
        if totals.withheld
        else f"{totals.shared_received} messages received, {totals.shared_sent} copies sent by reference and"
        f" {totals.shared_copied} as bytes"
    )
    if Capability.SHARED_MEMORY in str(welcome.get("capabilities", "")).split():
        return Check("sharing", "ok", f"nodes here and the broker share memory: {counts}")
    text = "the broker shares no memory with nodes here: another host, container or user, or it is turned off"
    return Check("sharing", "skip", f"{text}; {counts}" if totals.shared_received else text)


def numbers(report: BrokerReport) -> list[Check]:
    """Return the checks of the broker's counters: load, slow links, lost messages.

    Args:
        report: The counters.
    """
    checks = [Check("load", "skip", WITHHELD)] if report.totals.withheld else _load(report.totals)
    checks += summed_up("links", _slow_links(report), f"{len(report.links)}, none slow, none silent")
    return checks + summed_up(
        "messages", _losing_topics(report), f"{len(report.topics)} topics, nothing lost"
    )


def _load(totals: BrokerStats) -> list[Check]:
    load = f"connections: {totals.connections}; the loop at worst {1000 * totals.lag_longest_sec:.0f} ms late"
    checks = [Check("load", "ok", load)]
    if totals.lag_longest_sec > LATE_SEC:
        remedy = "the machine is too busy, or there is too much traffic for one broker"
        checks = [Check("load", "warn", load, remedy)]
    if totals.refused_connections:
        limits = "--max-connections, --max-connections-per-address, or open files (ulimit -n)"
        remedy = f"its log names the limit to raise: {limits}"
        text = f"{totals.refused_connections} connections turned away: there were too many"
        checks.append(Check("load", "warn", text, remedy))
    return checks + summed_up("limits", _limits_reached(totals), "none reached")


def _limits_reached(totals: BrokerStats) -> list[Check]:
    found: list[Check] = []
    for name, (what, remedy) in LIMITS.items():
        if count := getattr(totals, name):
            found.append(Check("limits", "warn", f"{count} {what}", f"{remedy}; the broker's log says more"))
    return found


def _slow_links(report: BrokerReport) -> list[Check]:
    found: list[Check] = []
    for link in report.links.values():
        who = ", ".join(link.nodes) or f"a link without nodes ({link.agent})"
        if link.suspended:
            text = f"{who} has been silent for {link.silent_ms / 1000:.0f} s and counts as gone"
            remedy = "its process is frozen or stopped, or the network between is cut"
            found.append(Check("links", "warn", text, remedy))
        if link.dropped:
            remedy = "let it read faster, let it keep more (depth), or hold publishers back: history KEEP_ALL"
            found.append(Check("links", "warn", f"{who}: {_slowness(link)}", remedy))
    return found


def _slowness(link: LinkStats) -> str:
    waiting = f", {link.queued} wait" if link.queued else ""
    return f"{link.dropped} messages dropped because it was slow{waiting}"


def _losing_topics(report: BrokerReport) -> list[Check]:
    found: list[Check] = []
    for topic in report.topics.values():
        lost = {
            "dropped for slow readers": topic.dropped,
            "lost with broken links": topic.lost_on_break,
            "missed by late joiners": topic.latched_dropped,
        }
        text = ", ".join(f"{number} {what}" for what, number in lost.items() if number)
        if text:
            remedy = f"see docs/explanation/delivery.md; watch it with: callboard topic hz {topic.name}"
            found.append(Check("messages", "warn", f"{topic.name}: {text}", remedy))
    return found


def mesh(report: BrokerReport, snapshot: GraphSnapshot) -> list[Check]:
    """Return the checks of the mesh, if the broker is in one: other brokers, and unique names of nodes.

    Args:
        report: The counters.
        snapshot: The graph.
    """
    if not report.brokers:
        return []
    if len(report.brokers) == 1:
        remedy = "compare the --mesh options of this broker and of the others; their logs say more"
        return [Check("mesh", "warn", "the broker has joined a mesh and sees no other broker", remedy)]
    names = BrokerNames(report)
    text = f"{len(report.brokers)} brokers: {names.joined(report.brokers)}"
    remedy = "rename one of them, or stop it: both took the name while their brokers did not see each other"
    duplicates = [
        Check("mesh", "warn", f"{len(brokers)} nodes are {name}, on {names.joined(brokers)}", remedy)
        for name, brokers in snapshot.duplicate_nodes().items()
    ]
    return [Check("mesh", "ok", text), *(summed_up("mesh", duplicates, "") if duplicates else ())]


def graph(snapshot: GraphSnapshot) -> list[Check]:
    """Return the checks of the graph: whether both ends of topics and services agree on types and QoS.

    Args:
        snapshot: The graph.
    """
    types = [
        *_type_conflicts(snapshot, "topic", EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION),
        *_type_conflicts(snapshot, "service", EntryKind.SERVICE, EntryKind.CLIENT),
    ]
    quality = _disagreements(snapshot)
    return [
        *summed_up("types", types, "all nodes agree on the type of each topic and service"),
        *summed_up("qos", quality, "every publisher offers what its subscriptions ask for"),
    ]


def _type_conflicts(snapshot: GraphSnapshot, what: str, *kinds: EntryKind) -> list[Check]:
    by_name: dict[str, list[GraphEntry]] = {}
    for entry in snapshot.of_kind(*kinds):
        if entry.type_name:  # a raw subscription takes any
            by_name.setdefault(entry.name, []).append(entry)
    found: list[Check] = []
    for name, entries in sorted(by_name.items()):
        types = sorted({entry.type_name for entry in entries})
        hashes = {entry.type_hash for entry in entries}
        if len(types) > 1:
            each = ", ".join(f"{one} ({_users(entries, one)})" for one in types)
            text = f"{what} {name} has several: {each}"
            remedy = "only those with the same type meet: rename one of them, or give it the other's type"
        elif len(hashes) > 1:
            text = f"{what} {name}: {types[0]} has {len(hashes)} definitions ({_users(entries, types[0])})"
            remedy = "generate the classes again from one .msg or .srv, and restart the nodes"
        else:
            continue
        found.append(Check("types", "fail", text, remedy))
    return found


def _users(entries: list[GraphEntry], type_name: str) -> str:
    return ", ".join(sorted({entry.node for entry in entries if entry.type_name == type_name}))


def _disagreements(snapshot: GraphSnapshot) -> list[Check]:
    found: list[Check] = []
    for name, _ in snapshot.names_and_types(EntryKind.PUBLISHER):
        publishers = _profiles(snapshot.endpoints(EntryKind.PUBLISHER, name))
        subscriptions = _profiles(snapshot.endpoints(EntryKind.SUBSCRIPTION, name))
        for pub, sub in product(publishers, subscriptions):
            for _, why in disagreements(pub.qos_profile, sub.qos_profile):
                strict = pub.strict_qos or sub.strict_qos
                effect = "; one is strict, so nothing is delivered" if strict else ""
                text = f"{name}, from {_node(pub)} to {_node(sub)}: {why}{effect}"
                remedy = f"give both the same profile; see: callboard topic info -v {name}"
                found.append(Check("qos", "fail" if strict else "warn", text, remedy))
    return found


def _profiles(endpoints: list[EndpointInfo]) -> list[EndpointInfo]:
    """Return one endpoint for each distinct profile."""
    distinct = {(repr(each.qos_profile), each.strict_qos): each for each in reversed(endpoints)}
    return list(distinct.values())[:MAX_PROFILES]


def _node(endpoint: EndpointInfo) -> str:
    return f"{endpoint.node_namespace.rstrip('/')}/{endpoint.node_name}"
