"""QoS as the broker needs it: numbers on the wire (docs/protocol.md §5), and which pairs do not agree."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, NamedTuple

from proto import limits
from proto.errors import ErrorCode

if TYPE_CHECKING:
    from proto.frames import Options

KEEP_LAST: Final = 1
KEEP_ALL: Final = 2
RELIABLE: Final = 1
BEST_EFFORT: Final = 2
TRANSIENT_LOCAL: Final = 1
VOLATILE: Final = 2

DEFAULT_DEPTH: Final = 10

BEST_EFFORT_DEPTH: Final = 1000
"""KEEP_ALL with BEST_EFFORT pushes nobody back, so it needs a depth after all."""


class Refusal(Exception):  # noqa: N818 - not an error of the program, an answer
    """A declaration cannot stand; carries what REFUSED says."""

    def __init__(self, code: ErrorCode, text: str) -> None:
        super().__init__(text)
        self.code = code


class Qos(NamedTuple):
    """A QoS map with its defaults filled in."""

    history: int
    depth: int
    reliability: int
    durability: int

    @property
    def needs_credit(self) -> bool:
        """Whether a subscription with it must never lose a message to slowness."""
        return self.history == KEEP_ALL and self.reliability == RELIABLE

    @property
    def latched(self) -> bool:
        """Whether late joiners get old messages."""
        return self.durability == TRANSIENT_LOCAL


def read(options: Options) -> Qos:
    """Return a QoS map's values.

    Raises:
        Refusal: A value is not one of the wire's.
    """
    return Qos(
        _choice(options, "history", KEEP_LAST, KEEP_ALL),
        _depth(options),
        _choice(options, "reliability", RELIABLE, BEST_EFFORT),
        _choice(options, "durability", VOLATILE, TRANSIENT_LOCAL),
    )


def _choice(options: Options, key: str, default: int, other: int) -> int:
    value = options.get(key, default)
    if type(value) is not int or value not in {default, other}:
        raise Refusal(ErrorCode.MALFORMED, f"QoS {key} must be {default} or {other}")
    return value


def _depth(options: Options) -> int:
    value = options.get("depth", DEFAULT_DEPTH)
    if type(value) is not int or not 0 <= value <= limits.MAX_DEPTH:
        raise Refusal(ErrorCode.MALFORMED, f"QoS depth must be from 0 to {limits.MAX_DEPTH}")
    return max(1, value)


def disagreement(publisher: Qos, subscription: Qos) -> str | None:
    """Return the last policy that a publisher does not offer as a subscription wants it, by name, or None."""
    if subscription.latched and not publisher.latched:
        return "DURABILITY"
    if subscription.reliability == RELIABLE and publisher.reliability == BEST_EFFORT:
        return "RELIABILITY"
    return None
