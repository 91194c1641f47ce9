"""The numeric codes of the wire protocol: opcodes and the values of coded fields.

The error codes are in errors.py, with the exceptions.
"""

from __future__ import annotations

from enum import IntEnum, StrEnum


class Op(IntEnum):
    """The opcodes. The gaps are for later frames of the same group."""

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

    ARENA = 60
    MAPPED = 61
    UNMAP = 62
    REFERENCE = 63
    RELEASE = 64
    PROOF = 65


class NoticeKind(IntEnum):
    """The kinds of warnings in NOTICE."""

    INCOMPATIBLE_QOS = 1
    """A counterpart's QoS is incompatible; messages are delivered only if neither endpoint is strict."""
    INCOMPATIBLE_TYPE = 2
    """A counterpart on the same topic or service has another type; the two are not matched."""
    SUSPENDED = 3
    """The link was silent for the keepalive limit, so its endpoints left the graph for a time."""

    STALLED = 4
    """A KEEP_ALL subscription has granted nothing for too long; KEEP_ALL publishers do not wait for it."""
    DUPLICATE_NAME = 5
    """A node of another broker of the mesh has the same name, since both took it during a partition."""


class Capability(StrEnum):
    """Abilities of a broker that older ones lack: words in `capabilities` of WELCOME."""

    STRICT_QOS = "strict_qos"
    """It keeps to `strict` in qos maps: incompatible endpoints do not match if one of them is strict."""
    SHARED_NAMES = "shared_names"
    """It accepts several nodes of one name if each declares that it shares the name."""
    APART = "apart"
    """It keeps the endpoints of nodes with the same text in `apart` from each other, and shows labels."""
    SHARED_MEMORY = "shared_memory"
    """It is on the client's host, and takes and sends large messages by reference (§6.10)."""


class PolicyKind(IntEnum):
    """QoS policies for which a publisher may offer less than a subscription requests: `policy` of NOTICE.

    The numbers are ROS 2's (rmw's `rmw_qos_policy_kind_t`).
    """

    DURABILITY = 2
    """The subscription requests latched messages, the publisher keeps none."""
    DEADLINE = 4
    """The subscription requests a shorter deadline than the publisher offers."""
    LIVELINESS = 8
    """The subscription requests MANUAL_BY_TOPIC, the publisher is AUTOMATIC."""
    RELIABILITY = 16
    """The subscription requests RELIABLE, the publisher is BEST_EFFORT."""
    LIVELINESS_LEASE_DURATION = 256
    """The subscription requests a shorter lease duration than the publisher offers."""


class DetachReason(IntEnum):
    """Why a publisher is detached from subscriptions."""

    GONE = 0
    """One of the two was undeclared, the publisher's link ended, or the subscription's link was silent."""
    SUSPENDED = 1
    """The publisher's link was silent for the keepalive limit."""


class Status(IntEnum):
    """How a call ended."""

    OK = 0
    """The body is the reply message."""
    REMOTE_ERROR = 1
    """The handler raised; the body is a msgpack array [exception type, text]."""
    UNAVAILABLE = 2
    """No server, or its link broke; the body is a string."""
    INVALID_REQUEST = 3
    """The server could not decode the request; the body is as with REMOTE_ERROR."""
    INVALID_REPLY = 4
    """The handler returned something that is not a valid reply; the body is as with REMOTE_ERROR."""
    OVERLOADED = 5
    """A limit on pending requests is reached; the body is a string."""
    CANCELLED = 6
    """The server ended the call (its node stopped, or its deadline passed); the body is a string."""


class EntryKind(IntEnum):
    """The kinds of graph entries."""

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
