"""The options of a broker. The daemon's command line flags derive from them."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING

from broker.errors import InvalidOptionError
from proto import limits
from proto.url import DEFAULT_HOST, DEFAULT_PORT

if TYPE_CHECKING:
    from pathlib import Path


@dataclass(frozen=True, kw_only=True, slots=True)
class BrokerOptions:
    """Where a broker listens and what it allows.

    The metadata of each field has its meaning, unit and range; the command line shows the same.

    Raises:
        InvalidOptionError: A value is out of range.
    """

    host: str = field(default=DEFAULT_HOST, metadata={"help": "address or name to listen on"})
    port: int = field(
        default=DEFAULT_PORT,
        metadata={"help": "TCP port; 0 takes a free one", "least": 0, "most": 65_535},
    )
    unix: Path | None = field(
        default=None, metadata={"help": "listen on a unix socket at this path instead of TCP"}
    )
    keepalive_sec: float = field(
        default=limits.DEFAULT_KEEPALIVE_SEC,
        metadata={
            "help": "seconds of silence after which a peer counts as frozen",
            "least": 0.1,
            "most": 3600,
        },
    )
    idle_keepalive_sec: float = field(
        default=limits.IDLE_KEEPALIVE_SEC,
        metadata={
            "help": "the same for a link without matched endpoints",
            "least": 0.1,
            "most": 86_400,
        },
    )
    handshake_timeout_sec: float = field(
        default=limits.HANDSHAKE_TIMEOUT_SEC,
        metadata={"help": "seconds a new connection has for its handshake", "least": 0.1, "most": 3600},
    )
    suspend_close_sec: float = field(
        default=30.0,
        metadata={
            "help": "seconds after which a frozen peer's link is closed",
            "least": 0.1,
            "most": 86_400,
        },
    )
    drain_timeout_sec: float = field(
        default=5.0,
        metadata={
            "help": "seconds a stopping broker waits for answers and unsent messages",
            "least": 0,
            "most": 3600,
        },
    )
    max_connections: int = field(
        default=20_000,
        metadata={
            "help": "connections at the same time, as far as the limit of open files allows",
            "least": 1,
            "most": 1_000_000,
        },
    )
    max_endpoints: int = field(
        default=20_000,
        metadata={
            "help": "nodes, publishers, subscriptions, services and clients of one connection",
            "least": 1,
            "most": 10_000_000,
        },
    )
    max_pending_calls: int = field(
        default=200_000,
        metadata={"help": "unanswered calls of one connection", "least": 1, "most": 100_000_000},
    )
    max_queue_bytes: int = field(
        default=64 * 1024 * 1024,
        metadata={
            "help": "bytes of small calls and control frames that may wait for one connection",
            "least": 65_536,
            "most": 2**40,
        },
    )
    max_link_bytes: int = field(
        default=256 * 1024 * 1024,
        metadata={
            "help": "bytes of messages that may wait for one connection; beyond it the oldest of the"
            " fullest KEEP_LAST queues go, and if that is not enough, the connection",
            "least": 65_536,
            "most": 2**40,
        },
    )
    max_bulk_bytes: int = field(
        default=256 * 1024 * 1024,
        metadata={
            "help": "bytes of latched messages and large calls that may wait for one connection;"
            " beyond it, it ends",
            "least": 65_536,
            "most": 2**40,
        },
    )
    max_message_bytes: int = field(
        default=limits.MAX_MESSAGE_BYTES,
        metadata={"help": "size of one message", "least": 1024, "most": limits.MAX_U32},
    )

    def __post_init__(self) -> None:
        for option in fields(self):
            value = getattr(self, option.name)
            if "least" not in option.metadata:
                continue
            least, most = option.metadata["least"], option.metadata["most"]
            if not isinstance(value, int | float) or not least <= value <= most:
                raise InvalidOptionError(f"{option.name} must be from {least} to {most}, got {value!r}")
