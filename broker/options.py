"""The options of a broker. The daemon's command line flags derive from them."""

from __future__ import annotations

import re
from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any, Final

from broker.errors import InvalidOptionError
from proto import limits
from proto.wire.url import DEFAULT_HOST, DEFAULT_PORT

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

_MIB: Final = 1024 * 1024

BROKER_NAME: Final = r"[A-Za-z0-9][A-Za-z0-9._-]{0,62}"
"""The pattern of a broker's name in a mesh."""

LEVELS: Final = ("debug", "info", "warning", "error")
"""Levels of the daemon's log."""


def _option(
    default: object,
    text: str,
    least: float | None = None,
    most: float | None = None,
    *,
    reloads: bool = False,
    choices: tuple[str, ...] = (),
) -> Any:
    """Return a dataclass field with its help, its values, and whether a running broker can change it."""
    span = {} if least is None else {"least": least, "most": most}
    metadata = {"help": text, "reloads": reloads, "choices": choices, **span}
    return field(default=default, metadata=metadata)


@dataclass(frozen=True, kw_only=True, slots=True)
class BrokerOptions:
    """Where a broker listens and what it allows.

    The metadata of each field has its meaning, unit and range; the command line shows the same.

    Raises:
        InvalidOptionError: A value is out of range.
    """

    host: str = _option(DEFAULT_HOST, "address or name to listen on")
    port: int = _option(DEFAULT_PORT, "TCP port; 0 takes a free one", 0, 65_535)
    unix: Path | None = _option(None, "listen on a unix socket at this path instead of TCP")
    mesh_listen: str | None = _option(
        None, "let other brokers join this one's mesh there: a Zenoh endpoint such as tcp/0.0.0.0:7447"
    )
    mesh: str | None = _option(
        None,
        "join the mesh of the broker that listens there: a Zenoh endpoint such as tcp/robot:7447, or several,"
        " separated by commas",
    )
    mesh_auth: Path | None = _option(
        None,
        "file with lines user:password: the first is what this broker joins others with, all of them may"
        " join it",
    )
    mesh_config: Path | None = _option(
        None, "join an existing Zenoh network: a configuration of Zenoh (JSON5), with TLS, scouting and so on"
    )
    mesh_lease_sec: float = _option(
        3.0, "seconds of silence after which another broker of the mesh counts as gone", 0.1, 3600
    )
    mesh_name: str | None = _option(
        None,
        "this broker's name in listings of the mesh: up to 63 letters, digits and -_."
        " (default: the host's name)",
    )
    auth: Path | None = _option(
        None,
        "TOML file of users and access rules; every connection must then be a user's"
        " (docs/reference/access.md)",
    )
    insecure: bool = _option(
        False, "without --auth: accept every connection; with it: accept tokens over plain TCP"
    )
    tls_cert: Path | None = _option(
        None, "PEM file with the broker's certificate and its chain; connections then use TLS"
    )
    tls_key: Path | None = _option(None, "PEM file with the private key of --tls-cert, without a passphrase")
    tls_client_ca: Path | None = _option(
        None,
        "PEM file with authorities: every client must then have a certificate of theirs; without --auth all"
        " of them may do everything",
    )
    keepalive_sec: float = _option(
        limits.DEFAULT_KEEPALIVE_SEC, "seconds of silence after which a peer counts as frozen", 0.1, 3600
    )
    idle_keepalive_sec: float = _option(
        limits.IDLE_KEEPALIVE_SEC,
        "the same for a link without matched endpoints",
        0.1,
        86_400,
        reloads=True,
    )
    handshake_timeout_sec: float = _option(
        limits.HANDSHAKE_TIMEOUT_SEC, "seconds a new connection has for its handshake", 0.1, 3600
    )
    suspend_close_sec: float = _option(
        30.0, "seconds after which a frozen peer's link is closed", 0.1, 86_400, reloads=True
    )
    name_grace_sec: float = _option(
        5.0, "seconds after which another node may take a frozen node's name", 0, 86_400, reloads=True
    )
    keep_all_stall_sec: float = _option(
        60.0, "seconds that a KEEP_ALL subscription may hold back publishers and take nothing", 0.1, 86_400
    )
    keep_all_stall_max_sec: float = _option(
        600.0, "the longest such time that a subscription may ask for", 0.1, 86_400
    )
    drain_timeout_sec: float = _option(
        5.0, "seconds a stopping broker waits for answers and unsent messages", 0, 3600, reloads=True
    )
    max_connections: int = _option(
        20_000, "connections at the same time, as far as the limit of open files allows", 1, 1_000_000
    )
    max_connections_per_address: int = _option(
        1000,
        "the same for one address (IPv6: one /64 network); loopback and unix sockets are not limited",
        1,
        1_000_000,
    )
    max_endpoints: int = _option(
        20_000, "nodes, publishers, subscriptions, services and clients of one connection", 1, 10_000_000
    )
    max_mesh_endpoints: int = _option(
        100_000,
        "nodes, publishers, subscriptions, services and clients of another broker of the mesh, in one domain",
        1,
        10_000_000,
    )
    max_matches: int = _option(
        200_000,
        "counterparts of all endpoints of one connection together: a subscription counts once for each of its"
        " publishers, a publisher once for each of its subscriptions",
        1,
        100_000_000,
    )
    max_mesh_matches: int = _option(
        2_000_000,
        "counterparts of all endpoints of another broker of the mesh together, in one domain",
        1,
        100_000_000,
    )
    max_watches: int = _option(1000, "watches of the graph that all connections keep together", 0, 1_000_000)
    max_pending_calls: int = _option(200_000, "unanswered calls of one connection", 1, 100_000_000)
    max_definitions: int = _option(2000, "types that one connection may define", 0, 1_000_000)
    max_definition_bytes: int = _option(4 * _MIB, "bytes of type definitions of one connection", 0, 64 * _MIB)
    max_queue_bytes: int = _option(
        64 * _MIB, "bytes of small replies and control frames that may wait for one connection", 65_536, 2**40
    )
    max_link_bytes: int = _option(
        256 * _MIB,
        "bytes of messages that may wait for one connection; beyond it the oldest of the fullest KEEP_LAST"
        " queues are dropped, and if that is not enough, the connection is closed",
        65_536,
        2**40,
        reloads=True,
    )
    max_bulk_bytes: int = _option(
        256 * _MIB,
        "bytes of large replies that may wait for one connection; beyond it, it is closed. Also of calls that"
        " may wait for it; beyond it they fail as OVERLOADED",
        65_536,
        2**40,
    )
    max_reassembly_bytes: int = _option(
        128 * _MIB,
        "bytes of incomplete messages that one connection may have sent; at least max_message_bytes",
        65_536,
        2**40,
    )
    max_total_reassembly_bytes: int = _option(
        1024 * _MIB,
        "bytes of incomplete messages of all connections; beyond it the one with most of them is closed",
        65_536,
        2**40,
    )
    reassembly_timeout_sec: float = _option(
        30.0,
        "seconds without a further part after which an incomplete message ends its connection",
        0.1,
        3600,
        reloads=True,
    )
    max_queued_call_bytes: int = _option(
        8 * _MIB,
        "bytes of one connection's calls that may wait for one server's connection; beyond it calls fail as"
        " OVERLOADED, except a larger one if no other waits",
        1024,
        2**40,
    )
    max_broker_bytes: int = _option(
        0,
        "bytes of all messages and calls that wait, are latched or incomplete, and of buffers for received"
        " bytes and TLS; beyond it some are refused or dropped; 0 is half of the memory of the machine or its"
        " container",
        0,
        2**50,
    )
    local_socket: bool = _option(
        True,
        "beside a port of the loopback device, listen on a unix socket, too: nodes of this user use it by"
        " themselves (Linux)",
    )
    shared_memory: bool = _option(
        True, "let nodes of this user on this host exchange large messages in shared memory (Linux)"
    )
    max_message_bytes: int = _option(limits.MAX_MESSAGE_BYTES, "size of one message", 1024, limits.MAX_U32)

    def __post_init__(self) -> None:
        _check_ranges(self)
        if self.mesh_name is not None and not re.fullmatch(BROKER_NAME, self.mesh_name):
            text = "mesh_name must have 1 to 63 letters, digits and -_. and begin with a letter or digit"
            raise InvalidOptionError(f"{text}, got {self.mesh_name!r}")
        if self.mesh_auth is not None and not self.joins_mesh:
            raise InvalidOptionError("mesh_auth needs mesh_listen, mesh or mesh_config")
        if (self.tls_cert is None) != (self.tls_key is None):
            raise InvalidOptionError("tls_cert and tls_key belong together: give both")
        if self.tls_client_ca is not None and self.tls_cert is None:
            raise InvalidOptionError("tls_client_ca needs tls_cert and tls_key")
        if self.unix is not None and self.tls_cert is not None:
            raise InvalidOptionError("a unix socket has no TLS: leave out tls_cert or unix")

    @property
    def joins_mesh(self) -> bool:
        """Whether the broker is one of a mesh."""
        return any((self.mesh_listen, self.mesh, self.mesh_config))


_BESIDE: Final[Mapping[str, tuple[str, str]]] = {
    "http": ("the address of the page", "page"),
    "bridge": ("the network to bridge", "bridge"),
}
"""Options that start a process beside the broker; those that begin with the name are about it."""


@dataclass(frozen=True, kw_only=True, slots=True)
class DaemonOptions:
    """The options that only the daemon has: its log, the file with its URL, its end, and what runs beside it.

    The page and the bridge need what only `callboard broker` has; `python -m broker` refuses their options.

    Raises:
        InvalidOptionError: A value is out of range, or options contradict each other.
    """

    url_file: Path | None = _option(None, "write the URL it listens on to this file")
    log_level: str = _option("info", "what is logged", reloads=True, choices=LEVELS)
    json_logs: bool = _option(False, "log one JSON object per line")
    exit_when_idle: float | None = _option(
        None,
        "end with 0 when no client has been connected for so many seconds, also at the start; other brokers"
        " of the mesh are no clients, and the page of --http or the bridge would always be one",
        0.1,
        86_400,
    )
    http: str | None = _option(
        None,
        "also serve the page, the API and metrics at this HOST:PORT; with --auth its users sign in there, and"
        " with --tls-cert it is HTTPS",
    )
    http_url: str | None = _option(
        None,
        "the broker's URL for the page's process, such as callboards://robot.local:7411, if the broker's"
        " certificate is not for the address that it listens on",
    )
    http_token: Path | None = _option(
        None,
        "a file with the page's token, such as for Prometheus; without it a random one, which is printed",
    )
    http_allow_control: bool = _option(
        False, "allow the page calls, goals, parameters and transitions, with the token"
    )
    http_read_without_token: bool = _option(
        False,
        "let everybody on this machine read the page without a token, also if the broker has rules",
    )
    bridge: str | None = _option(
        None,
        "also show the nodes of another network, as `callboard bridge` does; with --auth the bridge is a user"
        " like others",
        choices=("ros2",),
    )
    bridge_config: Path | None = _option(
        None, "TOML file of the bridge's options: what may cross, domain_id, namespace and so on"
    )
    bridge_url: str | None = _option(
        None, "the broker's URL for the bridge's process, as --http-url is for the page's"
    )
    bridge_token: Path | None = _option(
        None, "a file with the bridge's token; without it the one of CALLBOARD_TOKEN_FILE"
    )

    def __post_init__(self) -> None:
        _check_ranges(self)
        for name, (needed, process) in _BESIDE.items():
            further = [each.name for each in fields(self) if each.name.startswith(f"{name}_")]
            useless = [each for each in further if getattr(self, each)]
            if useless and getattr(self, name) is None:
                raise InvalidOptionError(f"{useless[0]} needs {name}, {needed}")
            if getattr(self, name) is not None and self.exit_when_idle is not None:
                raise InvalidOptionError(
                    f"exit_when_idle cannot be used with {name}: the {process} stays connected"
                )

    @property
    def beside(self) -> Mapping[str, str]:
        """What runs beside the broker, "page" and "bridge", by the options that say so."""
        return {name: process for name, (_, process) in _BESIDE.items() if getattr(self, name) is not None}


def _check_ranges(options: BrokerOptions | DaemonOptions) -> None:
    """Raise InvalidOptionError if a value is out of its range. One that need not be set may be None."""
    for option in fields(options):
        value = getattr(options, option.name)
        if "least" not in option.metadata or (value is None and option.default is None):
            continue
        least, most = option.metadata["least"], option.metadata["most"]
        if not isinstance(value, int | float) or not least <= value <= most:
            raise InvalidOptionError(f"{option.name} must be from {least} to {most}, got {value!r}")
