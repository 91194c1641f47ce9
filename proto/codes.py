"""The numbers that stand for something on the wire: opcodes, and what a frame's coded fields may say.

Why a session or a declaration fails is a code, too: those stand with their exceptions in errors.py.
"""

from __future__ import annotations

from enum import IntEnum


class Op(IntEnum):
    """The opcodes. Gaps leave room for the family's later members."""

    HELLO = 1
    WELCOME = 2
    ERROR = 3
    GOODBYE = 4
    PING = 5
    PONG = 6

    NODE = 10
    PUBLISHER = 11
    SUBSCRIPTION = 12
    SERVICE = 13
    CLIENT = 14
    UNDECLARE = 15
    RETIRE = 16

    ACCEPTED = 20
    REFUSED = 21
    MATCHED = 22
    ATTACHED = 23
    DETACHED = 24
    NOTICE = 25

    BATCH = 30
    REPLAY = 31
    FRAGMENT = 32
    ABORT = 33
    GRANT = 34
    CREDIT = 35
    ASSERT = 36

    REQUEST = 40
    REPLY = 41
    CANCEL = 42

    WATCH = 50
    UNWATCH = 51
    GRAPH = 52
    DESCRIBE = 53
    DEFINITION = 54
    INSPECT = 55
    STATS = 56


class NoticeKind(IntEnum):
    """What a NOTICE warns about."""

    INCOMPATIBLE_QOS = 1
    """A counterpart's QoS does not fit; messages are delivered nevertheless."""
    INCOMPATIBLE_TYPE = 2
    """A counterpart on the same topic or service has another type; the two are not matched."""
    SUSPENDED = 3
    """The link was silent for the keepalive limit, so its endpoints left the graph for a time."""


class PolicyKind(IntEnum):
    """QoS policies that a publisher may not offer as a subscription wants them: NOTICE's `policy`.

    The numbers are ROS 2's (rmw's `rmw_qos_policy_kind_t`).
    """

    DURABILITY = 2
    """The subscription wants latched messages, the publisher keeps none."""
    DEADLINE = 4
    """The subscription wants messages more often than the publisher promises them."""
    LIVELINESS = 8
    """The subscription wants MANUAL_BY_TOPIC, the publisher is AUTOMATIC."""
    RELIABILITY = 16
    """The subscription wants RELIABLE, the publisher is BEST_EFFORT."""
    LIVELINESS_LEASE_DURATION = 256
    """The subscription wants signs of life more often than the publisher promises them."""


class DetachReason(IntEnum):
    """Why a publisher's runs end."""

    GONE = 0
    """One of the two has been taken back, the publisher's link has ended, or the reader's own was silent."""
    SUSPENDED = 1
    """The publisher's link has been silent for the keepalive limit."""


class Status(IntEnum):
    """How a call ended."""

    OK = 0
    """The body is the reply message."""
    REMOTE_ERROR = 1
    """The handler raised; the body is a msgpack array [exception type, text]."""
    UNAVAILABLE = 2
    """No server, or its link broke; the body is a text."""
    INVALID_REQUEST = 3
    """The server could not decode the request; the body is as with REMOTE_ERROR."""
    INVALID_REPLY = 4
    """The handler returned something that is not a valid reply; the body is as with REMOTE_ERROR."""
    OVERLOADED = 5
    """A limit on pending requests is reached; the body is a text."""
    CANCELLED = 6
    """The server gave the call up (its node stopped, or its deadline passed); the body is a text."""


class EntryKind(IntEnum):
    """What a graph entry describes."""

    NODE = 0
    """A node; its name, type and QoS fields are empty."""
    PUBLISHER = 1
    """A publisher of a topic."""
    SUBSCRIPTION = 2
    """A subscription to a topic."""
    SERVICE = 3
    """A server of a service."""
    CLIENT = 4
    """A client of a service."""
