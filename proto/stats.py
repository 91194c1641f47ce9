"""What a broker has done and holds, as plain numbers: its own, and those of its topics and links.

Counts are totals since the broker began to listen, so two looks give rates: `later.rates_since(earlier)`.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

MAX_NODE_NAMES: Final = 8
"""Nodes that a link's numbers name. A link may have any number; all answers stay small."""

TOTALS: Final = (
    *("routed", "copies", "delivered", "dropped", "abandoned", "lost_on_break", "unmatched", "stale"),
    *("calls", "refused_calls", "late_replies", "refused_connections", "bytes_received", "bytes_sent"),
)
"""The totals: what rates are made of."""

MAY_DECREASE: Final = ("lost_on_break",)
"""Totals that may fall while the thing lives: a subscription's message may come after it was given up."""


def increase(totals: Sequence[str], earlier: object | None, later: object) -> dict[str, Any]:
    """Return by how much each of these totals has risen between two looks at the same thing: never negative.

    Args:
        totals: The names of attributes, ints or floats.
        earlier: The first look; None if it was not there then.
        later: The second snapshot. If a total outside of MAY_DECREASE is smaller in it, counting has started
            again, and all totals count from zero.
    """
    now = {total: getattr(later, total) for total in totals}
    before = {total: getattr(earlier, total, 0) for total in totals}
    if any(now[total] < before[total] for total in totals if total not in MAY_DECREASE):
        return now
    return {total: max(0, now[total] - before[total]) for total in totals}


@dataclass(frozen=True, kw_only=True, slots=True)
class BrokerRates:
    """What happened per second between two looks at a broker; `seconds` is the time between them."""

    seconds: float
    routed: float
    copies: float
    delivered: float
    dropped: float
    abandoned: float
    lost_on_break: float
    unmatched: float
    stale: float
    calls: float
    refused_calls: float
    late_replies: float
    refused_connections: float
    bytes_received: float
    bytes_sent: float

    def as_dict(self) -> dict[str, float]:
        """Return the same by name."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True, slots=True)
class BrokerStats:
    """A broker at one moment.

    `copies`, each message once for every link it was routed to, equals `accounted` at every moment. Each of
    its terms is counted on its own, where it happens.
    """

    broker: str = ""
    """Its instance, in hex: another after a restart."""
    stamp_sec: float = 0.0
    """When this was, by the clock of the broker's loop, which only rises."""
    uptime_sec: float = 0.0
    """Since it began to listen."""
    lag_last_sec: float = 0.0
    """How late its loop was with what was due, at the last look ..."""
    lag_longest_sec: float = 0.0
    """... and at worst in the last minute."""
    connections: int = 0
    """Those of which the handshake is not over included."""
    refused_connections: int = 0
    """Connections turned away because there were too many."""
    suspended: int = 0
    """Links that have been silent for too long, and may come back."""
    endpoints: int = 0
    """Nodes, publishers, subscriptions, services and clients."""
    topics: int = 0
    routed: int = 0
    """Messages that reached at least one link."""
    copies: int = 0
    delivered: int = 0
    """Copies handed whole to a link's transport."""
    dropped: int = 0
    """Copies dropped because a link was slower than its depth allows."""
    dropped_for_bytes: int = 0
    """Those of them that the depth had room for, and a ceiling in bytes had not."""
    abandoned: int = 0
    """Copies that waited when their last reader on the link left or was suspended."""
    lost_on_break: int = 0
    """Copies that waited for a link that ended, or came while it was ending."""
    leaving: int = 0
    """Copies of which some fragments are with the transport, and not yet the last."""
    queued: int = 0
    """Copies that wait now."""
    queued_bytes: int = 0
    """What they take, about; what waits for several links is counted for each."""
    urgent_bytes: int = 0
    """Control frames and calls that wait, large calls included."""
    ordered_bytes: int = 0
    """Control frames and latched messages that wait in order with messages."""
    latched: int = 0
    """Messages kept for late joiners."""
    latched_bytes: int = 0
    latched_dropped: int = 0
    """Messages that late joiners will miss, because more bytes were latched than may be."""
    unmatched: int = 0
    """Messages that nobody was there to hear."""
    stale: int = 0
    """Messages discarded because they had been seen."""
    calls: int = 0
    refused_calls: int = 0
    pending_calls: int = 0
    late_replies: int = 0
    definitions: int = 0
    """Definitions of types kept."""
    definition_bytes: int = 0
    bytes_received: int = 0
    """Over all connections, those that have ended included."""
    bytes_sent: int = 0

    @property
    def accounted(self) -> int:
        """Copies of which it is known what has become of them: all."""
        return (
            self.delivered + self.dropped + self.abandoned + self.lost_on_break + self.leaving + self.queued
        )

    def rates_since(self, earlier: BrokerStats) -> BrokerRates:
        """Return what has happened per second since an earlier look at the same broker.

        If it has been stopped and started again in between, what happened before that is not known.

        Raises:
            ValueError: `earlier` is not earlier, or another broker's.
        """
        seconds = self.stamp_sec - earlier.stamp_sec
        if seconds <= 0 or self.broker != earlier.broker:
            raise ValueError("Rates need an earlier look at the same broker")
        rise = increase(("uptime_sec", *TOTALS), earlier, self)
        return BrokerRates(seconds=seconds, **{name: rise[name] / seconds for name in TOTALS})

    def as_dict(self) -> dict[str, Any]:
        """Return the same by name, ready for `json.dumps`."""
        return asdict(self)

    @classmethod
    def from_map(cls, totals: Mapping[str, object]) -> BrokerStats:
        """Return what a broker, of this version or another, has sent; what is unknown is left out."""
        known: dict[str, Any] = {
            field.name: totals[field.name]
            for field in fields(cls)
            if type(totals.get(field.name)) is type(field.default)
        }
        return cls(**known)


class TopicStats(NamedTuple):
    """A topic that somebody has declared something on; its counts begin anew when nobody has.

    Attributes:
        domain: Of which graph it is.
        name: Its full name.
        publishers: Those that are not suspended.
        subscriptions: Those that are not suspended.
        messages: Messages that publishers have sent.
        bytes: Their size.
        delivered, dropped, abandoned, lost_on_break, leaving, queued: What has become of their copies, as in
            BrokerStats.
        latched_dropped: Messages that late joiners will miss: too many bytes were latched.
    """

    domain: int
    name: str
    publishers: int
    subscriptions: int
    messages: int
    bytes: int
    delivered: int
    dropped: int
    abandoned: int
    lost_on_break: int
    leaving: int
    queued: int
    latched_dropped: int


class LinkStats(NamedTuple):
    """A link whose handshake is over.

    Attributes:
        domain: Which graph it has joined.
        session: Its number, as WELCOME said.
        agent: What it has called itself.
        nodes: The full names of its nodes: the first 8.
        endpoints: What it has declared, nodes included.
        suspended: Whether it has been silent for too long.
        silent_ms: Since when nothing has come from it; not later than the broker's last look at it.
        queued: Messages that wait for it.
        queued_bytes: Their size.
        waiting_bytes: Control frames, latched messages and calls that wait for it.
        dropped: Messages dropped because it was slow.
        bytes_received: From it.
        bytes_sent: To it, or to its transport.
        pending_calls: Calls of its clients that wait for an answer.
        owed_calls: Calls that its servers have not answered.
    """

    domain: int
    session: int
    agent: str
    nodes: tuple[str, ...]
    endpoints: int
    suspended: bool
    silent_ms: int
    queued: int
    queued_bytes: int
    waiting_bytes: int
    dropped: int
    bytes_received: int
    bytes_sent: int
    pending_calls: int
    owed_calls: int
