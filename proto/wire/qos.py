"""QoS on the wire: numbers, defaults, and which pairs are incompatible (docs/protocol.md §5)."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Final, NamedTuple

from proto import limits
from proto.errors import ErrorCode
from proto.wire.codes import PolicyKind

if TYPE_CHECKING:
    from collections.abc import Iterator

    from proto.wire.frames import Options, Scalar

KEEP_LAST: Final = 1
KEEP_ALL: Final = 2
RELIABLE: Final = 1
BEST_EFFORT: Final = 2
TRANSIENT_LOCAL: Final = 1
VOLATILE: Final = 2
AUTOMATIC: Final = 1
MANUAL_BY_TOPIC: Final = 3

DEFAULT_DEPTH: Final = 10

BEST_EFFORT_DEPTH: Final = 1000
"""Depth of KEEP_ALL with BEST_EFFORT, which has no flow control and therefore needs one."""


class Refusal(Exception):  # noqa: N818 - not a program error, but an answer
    """A declaration is refused.

    Attributes:
        code: The code of the REFUSED frame; the exception's text is the frame's text.
    """

    def __init__(self, code: ErrorCode, text: str) -> None:
        super().__init__(text)
        self.code = code


class Qos(NamedTuple):
    """A QoS map with its defaults filled in. Times are in nanoseconds, 0 for none.

    `strict`: the endpoint matches none with which its QoS is incompatible.
    """

    history: int
    depth: int
    reliability: int
    durability: int
    liveliness: int
    deadline_ns: int
    lifespan_ns: int
    lease_ns: int
    strict: bool

    @property
    def needs_credit(self) -> bool:
        """Whether a slow subscription limits its publishers instead of losing messages."""
        return self.history == KEEP_ALL and self.reliability == RELIABLE

    @property
    def latched(self) -> bool:
        """Whether late joiners get old messages."""
        return self.durability == TRANSIENT_LOCAL

    def to_map(self) -> Options:
        """Return it as a QoS map: always the first four keys, and the others if they are not the default.

        Equal ones share the map: do not change it.
        """
        return _to_map(self)


_ALWAYS_SENT: Final = frozenset({"history", "depth", "reliability", "durability"})


@lru_cache(maxsize=1000)
def _to_map(qos: Qos) -> Options:
    return {
        key: value
        for key, value in qos._asdict().items()
        if key in _ALWAYS_SENT or (value and (key, value) != ("liveliness", AUTOMATIC))
    }


_KEYS: Final = Qos._fields
_DEFAULTS: Final = (KEEP_LAST, DEFAULT_DEPTH, RELIABLE, VOLATILE, AUTOMATIC, 0, 0, 0, False)


def parse_qos(options: Options) -> Qos:
    """Parse a QoS map.

    Raises:
        Refusal: A value is invalid.
    """
    return _parse(*map(options.get, _KEYS, _DEFAULTS))


@lru_cache(maxsize=1000, typed=True)  # typed: 1.0 and True equal 1
def _parse(*values: Scalar) -> Qos:
    """Parse the values of all policies. Most endpoints have the same few, and share the result."""
    history, depth, reliability, durability, liveliness, deadline_ns, lifespan_ns, lease_ns, strict = values
    return Qos(
        _choice("history", history, KEEP_LAST, KEEP_ALL),
        _depth(depth),
        _choice("reliability", reliability, RELIABLE, BEST_EFFORT),
        _choice("durability", durability, VOLATILE, TRANSIENT_LOCAL),
        _choice("liveliness", liveliness, AUTOMATIC, MANUAL_BY_TOPIC),
        _time("deadline_ns", deadline_ns),
        _time("lifespan_ns", lifespan_ns),
        _time("lease_ns", lease_ns),
        _flag("strict", strict),
    )


def _choice(key: str, value: Scalar, default: int, other: int) -> int:
    if type(value) is not int or value not in {default, other}:
        raise Refusal(ErrorCode.MALFORMED, f"QoS {key} must be {default} or {other}")
    return value


def _depth(value: Scalar) -> int:
    if type(value) is not int or not 0 <= value <= limits.MAX_DEPTH:
        raise Refusal(ErrorCode.MALFORMED, f"QoS depth must be from 0 to {limits.MAX_DEPTH}")
    return max(1, value)


def _time(key: str, value: Scalar) -> int:
    if type(value) is not int or not 0 <= value <= limits.MAX_QOS_NS:
        raise Refusal(ErrorCode.MALFORMED, f"QoS {key} must be from 0 to {limits.MAX_QOS_NS}")
    return value


def _flag(key: str, value: Scalar) -> bool:
    if type(value) is not bool:
        raise Refusal(ErrorCode.MALFORMED, f"QoS {key} must be true or false")
    return value


def incompatible_policy(publisher: Qos, subscription: Qos) -> PolicyKind | None:
    """Return the policy for which a publisher offers less than a subscription requests, or None.

    If there are several, return the last one in PRECEDENCE.
    """
    return max(_incompatible_policies(publisher, subscription), key=PRECEDENCE.index, default=None)


PRECEDENCE: Final = (
    PolicyKind.LIVELINESS_LEASE_DURATION,
    PolicyKind.LIVELINESS,
    PolicyKind.DEADLINE,
    PolicyKind.RELIABILITY,
    PolicyKind.DURABILITY,
)
"""The order in which ROS 2 checks the policies."""


def _incompatible_policies(publisher: Qos, subscription: Qos) -> Iterator[PolicyKind]:
    if _shorter(subscription.lease_ns, publisher.lease_ns):
        yield PolicyKind.LIVELINESS_LEASE_DURATION
    if subscription.liveliness > publisher.liveliness:
        yield PolicyKind.LIVELINESS
    if _shorter(subscription.deadline_ns, publisher.deadline_ns):
        yield PolicyKind.DEADLINE
    if subscription.reliability == RELIABLE and publisher.reliability == BEST_EFFORT:
        yield PolicyKind.RELIABILITY
    if subscription.latched and not publisher.latched:
        yield PolicyKind.DURABILITY


def _shorter(wanted_ns: int, offered_ns: int) -> bool:
    """Return whether a subscription requests a shorter time than a publisher offers; 0 is infinite."""
    return wanted_ns > 0 and (offered_ns == 0 or wanted_ns < offered_ns)
