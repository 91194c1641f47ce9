"""Files of QoS overrides: the QoS of single topics, instead of what was offered or recorded. Pure.

    /imu:
      reliability: best_effort
      history: keep_last
      depth: 10
      deadline: {sec: 1, nsec: 0}

The format is the one of `ros2 bag record` and `play --qos-profile-overrides-path`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, cast

from actors.bags.errors import InvalidBagOptionError
from actors.interfaces.yaml_reader import load_yaml
from actors.qos.profile import (
    DurabilityPolicy,
    HistoryPolicy,
    LivelinessPolicy,
    QoSPolicyEnum,
    QoSProfile,
    ReliabilityPolicy,
)
from actors.time.types import Duration
from actors.tools.suggestions import did_you_mean
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Mapping

_ENUMS: Final[Mapping[str, type[QoSPolicyEnum]]] = {
    "history": HistoryPolicy,
    "reliability": ReliabilityPolicy,
    "durability": DurabilityPolicy,
    "liveliness": LivelinessPolicy,
}
_DURATIONS: Final = ("deadline", "lifespan", "liveliness_lease_duration")
_IGNORED: Final = "avoid_ros_namespace_conventions"
"""Accepted, since files for ROS 2 have it; names of callboard's topics get no prefix that it could avoid."""
_POLICIES: Final = (*_ENUMS, "depth", *_DURATIONS, _IGNORED)


def read_overrides(source: bytes) -> dict[str, QoSProfile]:
    """Return the profiles in a file of QoS overrides, by topic.

    Args:
        source: The file's content. A policy that it leaves out has the default of `QoSProfile`.

    Raises:
        YamlError: The content is not YAML, or too large.
        InvalidBagOptionError: A name, a policy or a value is wrong; the text says where and how.
    """
    mapping: Any = load_yaml(source)
    if not isinstance(mapping, dict):
        raise InvalidBagOptionError("Expected a mapping of topics to QoS policies")
    mapping = cast("dict[str, Any]", mapping)
    return {_topic(name): _profile(str(name), policies) for name, policies in mapping.items()}


def _topic(name: object) -> str:
    if not isinstance(name, str) or not name.startswith("/"):
        raise InvalidBagOptionError(f"Expected the full name of a topic, such as /imu, got {_shown(name)}")
    return name


def _profile(topic: str, policies: Any) -> QoSProfile:
    if not isinstance(policies, dict):
        raise InvalidBagOptionError(f"{topic}: expected a mapping of QoS policies, got {_shown(policies)}")
    mapping = cast("dict[str, Any]", policies)
    chosen: dict[str, Any] = {}
    for name, value in mapping.items():
        if name not in _POLICIES:
            hint = did_you_mean(str(name), _POLICIES)
            raise InvalidBagOptionError(f"{topic}: there is no policy {_shown(name)}{hint}")
        if name != _IGNORED:
            chosen[name] = _policy(f"{topic}: {name}", name, value)
    try:
        return QoSProfile(**chosen)
    except (ValueError, TypeError) as error:
        raise InvalidBagOptionError(f"{topic}: {error}") from None


def _policy(where: str, name: str, value: Any) -> Any:
    """Return the value of a policy."""
    if name in _ENUMS:
        try:
            return _ENUMS[name].get_from_short_key(value)
        except (ValueError, AttributeError):
            keys = ", ".join(_ENUMS[name].short_keys())
            raise InvalidBagOptionError(f"{where}: expected one of {keys}, got {_shown(value)}") from None
    if name == "depth":
        return value
    try:
        seconds, nanoseconds = value["sec"], value["nsec"]
        if type(seconds) is int and type(nanoseconds) is int and seconds >= 0 and nanoseconds >= 0:
            return Duration(seconds=seconds, nanoseconds=nanoseconds)
    except (TypeError, LookupError, ValueError, OverflowError):
        pass
    raise InvalidBagOptionError(f"{where}: expected {{sec: 1, nsec: 0}}, got {_shown(value)}")


def _shown(value: object) -> str:
    return escape(repr(value)[:60])
