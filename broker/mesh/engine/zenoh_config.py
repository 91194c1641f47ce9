"""The configuration of a broker's Zenoh session, from the broker's options."""

from __future__ import annotations

import json
import os
import re
import stat
from typing import TYPE_CHECKING, Any, Final, cast

import zenoh

from broker.errors import ConfigurationError, UnprotectedError
from broker.mesh.engine.neighbours import address_of
from proto import limits
from proto.wire.addresses import is_loopback

if TYPE_CHECKING:
    from pathlib import Path

    from broker.options import BrokerOptions

_LOCAL_PROTOCOLS: Final = {"unixsock-stream", "unixpipe"}
_ENCRYPTED_PROTOCOLS: Final = {"tls", "quic"}
MAX_BYTES: Final = limits.MAX_MESSAGE_BYTES
"""The least limit for a received message: a snapshot of 100,000 endpoints takes some 25 MB."""
SPARE_BYTES: Final = 1024 * 1024
"""For what Zenoh adds to a message, and for the header of a batch."""
_MAX_AUTH_BYTES: Final = 1024 * 1024
_UNWANTED: Final = re.compile(r" at \S+\.rs:\d+\.?|: \{\".*", re.DOTALL)
"""Places in Zenoh's code, and the whole configuration, which has passwords and keys."""


def make_config(options: BrokerOptions) -> zenoh.Config:
    """Return the configuration of a session in router mode.

    The file of `mesh_config` takes precedence over callboard's defaults, which are no scouting and no gossip,
    so that only named brokers join. The other options take precedence over the file.

    Raises:
        ConfigurationError: A file cannot be used, or an endpoint is malformed.
        UnprotectedError: Somebody who may not use the broker could join without credentials.
    """
    config = _read(options.mesh_config)
    defaults = {
        "mode": "router",
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "scouting/delay": 0,  # how long `zenoh.open` waits for what scouting finds
        "connect/retry": {"period_init_ms": 200, "period_max_ms": 2000, "period_increase_factor": 2.0},
    }
    for key, value in defaults.items():
        if _get(config, key) is None:
            _set(config, key, value)
    if _is_default(config, "transport/link/rx/max_message_size"):
        _set(
            config,
            "transport/link/rx/max_message_size",
            max(options.max_message_bytes, MAX_BYTES) + SPARE_BYTES,
        )
    # Zenoh does not give back the memory (17 MB) that it shares with a broker that has been killed.
    _set(config, "transport/shared_memory", {"enabled": False})
    if options.mesh_config is None or _is_default(config, "transport/link/tx/lease"):
        _set(config, "transport/link/tx/lease", round(1000 * options.mesh_lease_sec))
    if options.mesh_listen or _is_default(config, "listen/endpoints"):  # that is all addresses
        _set(config, "listen/endpoints", split(options.mesh_listen), "--mesh-listen")
    if options.mesh:
        _set(config, "connect/endpoints", split(options.mesh), "--mesh")
    if options.mesh_auth is not None:
        user, password = _read_auth(options.mesh_auth)
        _set(config, "transport/auth/usrpwd/user", user)
        _set(config, "transport/auth/usrpwd/password", password)
        _set(config, "transport/auth/usrpwd/dictionary_file", str(options.mesh_auth))
    if not (options.insecure or _get(config, "transport/auth/usrpwd/user") is not None):
        _check_protected(config, _protection(options))
    return config


def split(endpoints: str | None) -> list[str]:
    """Return the endpoints in an option, which are separated by commas."""
    return [each.strip() for each in endpoints.split(",")] if endpoints else []


def connect_endpoints(config: zenoh.Config) -> list[str]:
    """Return where a session connects to."""
    return _endpoints(config, "connect")


def plain_text(error: zenoh.ZError) -> str:
    """Return the text of an error of Zenoh, without lines of its Rust code, and without secrets."""
    return _UNWANTED.sub("", str(error)).rstrip(".")


def _read(path: Path | None) -> zenoh.Config:
    if path is None:
        return zenoh.Config()
    try:
        return zenoh.Config.from_file(str(path))
    except zenoh.ZError as error:
        raise ConfigurationError(f"Cannot use {path} (--mesh-config): {plain_text(error)}") from None


def _get(config: zenoh.Config, key: str) -> Any:
    return json.loads(config.get_json(key))


def _set(config: zenoh.Config, key: str, value: object, option: str = "") -> None:
    try:
        config.insert_json5(key, json.dumps(value))  # pyright: ignore[reportUnknownMemberType]
    except zenoh.ZError:
        text = f"{option} {value!r}: an endpoint is a protocol and an address, such as tcp/192.168.1.2:7447"
        raise ConfigurationError(text) from None


def _endpoints(config: zenoh.Config, key: str) -> list[str]:
    """Return where it listens, or what it connects to."""
    endpoints: Any = _get(config, f"{key}/endpoints")
    if isinstance(endpoints, dict):  # by mode
        endpoints = cast("dict[str, Any]", endpoints).get(_get(config, "mode"), [])
    return [endpoints] if isinstance(endpoints, str) else cast("list[str]", endpoints)


def _is_default(config: zenoh.Config, key: str) -> bool:
    """Return whether a value is Zenoh's default, so that no file has changed it."""
    return bool(_get(config, key) == _get(zenoh.Config(), key))


def _protection(options: BrokerOptions) -> str:
    """Return which option keeps users of this machine out of the broker; "" for none."""
    protections = {"--auth": options.auth, "--tls-client-ca": options.tls_client_ca, "--unix": options.unix}
    return next((name for name, value in protections.items() if value is not None), "")


def _check_protected(config: zenoh.Config, protection: str) -> None:
    """Check that nobody can join without a password or certificate who may not use the broker.

    Args:
        config: The configuration.
        protection: What keeps users of this machine out; "" if they may use the broker, and so the mesh, too.
    """
    certificates = bool(_get(config, "transport/link/tls/enable_mtls"))
    for endpoint in (*_endpoints(config, "listen"), *_endpoints(config, "connect")):
        protocol, host, _ = address_of(endpoint)
        if certificates and protocol in _ENCRYPTED_PROTOCOLS:
            continue
        if not (protocol in _LOCAL_PROTOCOLS or host == "localhost" or is_loopback(host)):
            raise _unprotected(endpoint, "anybody who reaches it could take part")
        if protection:
            raise _unprotected(
                endpoint, f"every user of this machine could take part, whatever {protection} says"
            )
    for kind in ("multicast", "gossip"):
        if _get(config, f"scouting/{kind}/enabled"):
            raise _unprotected(f"what {kind} scouting finds", "anybody who reaches it could take part")


def _unprotected(where: str, danger: str) -> UnprotectedError:
    return UnprotectedError(
        f"Refusing to join a mesh over {where}: {danger}. Give all brokers one --mesh-auth FILE (a line"
        " 'user:password'), or certificates (mTLS in --mesh-config), or let everybody in with --insecure."
    )


def _read_auth(path: Path) -> tuple[str, str]:
    """Return the user and password of this broker: those in the first line."""
    try:
        with path.open("rb") as file:
            mode = os.fstat(file.fileno()).st_mode
            text = file.read(_MAX_AUTH_BYTES + 1).decode()
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8"
        raise ConfigurationError(f"Cannot read {path} (--mesh-auth): {reason}") from None
    if os.name == "posix" and stat.S_ISREG(mode) and mode & 0o077:
        text = f"{path} (--mesh-auth): others may read or write it; change that with `chmod 600 {path}`"
        raise ConfigurationError(text)
    if len(text) > _MAX_AUTH_BYTES:
        raise ConfigurationError(f"{path} (--mesh-auth) is longer than {_MAX_AUTH_BYTES} bytes")
    pairs = [line.partition(":") for line in text.splitlines()]
    for number, (user, _, password) in enumerate(pairs, 1):
        if not user or not password:
            raise ConfigurationError(f"{path} (--mesh-auth): line {number} is not 'user:password'")
    if not pairs:
        raise ConfigurationError(f"{path} (--mesh-auth): it is empty; it needs a line 'user:password'")
    return pairs[0][0], pairs[0][2]
