"""The options of a bridge: from a TOML file and the command line.

    options = load_options({"allow": ("/camera/**",)}, Path("bridge.toml"))
    options.rules      # what may cross

A file has the same options: lists `allow` and `deny`, `namespace`, `domain_id`, a table `depths` with a depth
for each pattern, `max_nodes`, `max_endpoints` and `lease_sec`. The command line takes precedence.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Final, cast

from actors.bridges.errors import InvalidBridgeOptionError
from actors.bridges.rules import MAX_ENDPOINTS, MAX_NODES, Rules, require_number
from proto.aio.toml_files import read_toml, unknown_option
from proto.limits import MAX_DOMAIN

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

LEASE_SEC: Final = 3
"""How long ROS 2 shows the bridge after it was killed. Fast DDS's own lease is 20 s."""
_MAX_LEASE_SEC: Final = 300


@dataclass(frozen=True, kw_only=True)
class BridgeOptions:
    """The options of a bridge.

    Args:
        allow: Patterns of the topics, services and actions that cross; empty for all (default).
        deny: Patterns of those that do not cross, also if `allow` has them; none by default.
        namespace: The namespace in callboard of what the other network has; "/" for none (default).
        depths: Patterns of topics with the depth of their mirrors, in messages; none by default.
        domain_id: The domain of the other network; None for ROS_DOMAIN_ID (default).
        max_nodes: Nodes shown on each side; 1,000 by default.
        max_endpoints: Endpoints shown on each side; 5,000 by default.
        lease_sec: Seconds for which ROS 2 shows the bridge after it was killed, 3 to 300; 3 by default. A
            process of ROS 2 that does not run for so long drops the bridge, and Fast DDS may not connect them
            again.

    Raises:
        InvalidBridgeOptionError: One of them is invalid; the text names it.
    """

    allow: tuple[str, ...] = ()
    deny: tuple[str, ...] = ()
    namespace: str = "/"
    depths: tuple[tuple[str, int], ...] = ()
    domain_id: int | None = None
    max_nodes: int = MAX_NODES
    max_endpoints: int = MAX_ENDPOINTS
    lease_sec: int = LEASE_SEC

    def __post_init__(self) -> None:
        if self.domain_id is not None:
            require_number("domain_id", self.domain_id, 0, MAX_DOMAIN)
        require_number("lease_sec", self.lease_sec, LEASE_SEC, _MAX_LEASE_SEC)
        _ = self.rules

    @property
    def rules(self) -> Rules:
        """What may cross, by these options."""
        return Rules(
            allow=self.allow,
            deny=self.deny,
            namespace=self.namespace,
            depths=self.depths,
            max_nodes=self.max_nodes,
            max_endpoints=self.max_endpoints,
        )


_KEYS: Final = tuple(each.name for each in fields(BridgeOptions))


def load_options(given: Mapping[str, Any], path: Path | None = None) -> BridgeOptions:
    """Return the options: values of the command line first, then of the file, then the defaults.

    Args:
        given: Values from the command line, by the names of their options.
        path: The file; None for none.

    Raises:
        InvalidBridgeOptionError: The file cannot be read, or an option is invalid.
    """
    values: dict[str, Any] = {} if path is None else read_toml(path, _read, InvalidBridgeOptionError)
    return BridgeOptions(**{**values, **given})


def _read(table: dict[str, Any]) -> dict[str, Any]:
    """Return the values in a file's table, after a check of all."""
    values: dict[str, Any] = {key: _value(key, value) for key, value in table.items()}
    BridgeOptions(**values)
    return values


def _value(key: str, value: object) -> object:
    """Return a value of a file as an option has it.

    The daemon's options are plain values, which their fields describe; here are lists and a table.
    """
    if key not in _KEYS:
        raise InvalidBridgeOptionError(unknown_option(key, _KEYS, f"the options are {', '.join(_KEYS)}"))
    if key in {"allow", "deny"}:
        items = cast("list[object]", value) if isinstance(value, list) else [None]
        if not all(isinstance(each, str) for each in items):
            raise InvalidBridgeOptionError(f"{key} must be a list of patterns, such as ['/camera/**']")
        return tuple(items)
    if key == "depths":
        if not isinstance(value, dict):
            raise InvalidBridgeOptionError("depths must be a table, such as {'/camera/**' = 1}")
        return tuple(cast("dict[str, object]", value).items())
    if key == "namespace" and not isinstance(value, str):
        raise InvalidBridgeOptionError("namespace must be a string, such as '/robot1'")
    return value
