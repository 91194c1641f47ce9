"""The QoS of the recorder's subscriptions. Pure.

It requests what all publishers of a topic offer, as ROS 2's recorder does, so that messages of each of them
arrive, and latched ones if all of them have some.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final, cast

from actors.bags.recorder.errors import InvalidRecordingError
from actors.interfaces.yaml_reader import load_yaml
from actors.qos.compatibility import QoSCompatibility, qos_check_compatible
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
    from collections.abc import Iterable, Mapping

DEPTH: Final = 10_000
"""Messages of a topic that may wait in the node, which takes them in each turn of its loop, and of each of
its publishers in the broker, which limits their bytes. ROS 2's recorder has 10, and loses what a busy moment
brings."""

_ENUMS: Final[Mapping[str, type[QoSPolicyEnum]]] = {
    "history": HistoryPolicy,
    "reliability": ReliabilityPolicy,
    "durability": DurabilityPolicy,
    "liveliness": LivelinessPolicy,
}
_DURATIONS: Final = ("deadline", "lifespan", "liveliness_lease_duration")
_IGNORED: Final = "avoid_ros_namespace_conventions"
_POLICIES: Final = (*_ENUMS, "depth", *_DURATIONS, _IGNORED)


def recording_qos(
    offers: Iterable[tuple[QoSProfile, bool]], *, lossless: bool = False, depth: int = DEPTH
) -> QoSProfile:
    """Return the profile that receives from all publishers of a topic.

    Args:
        offers: The QoS of each publisher, and whether it is strict; none if there are no publishers yet.
        lossless: Let publishers wait for the recorder (KEEP_ALL) rather than lose messages.
        depth: Messages that may wait otherwise.

    Returns:
        The profile. Without publishers it is BEST_EFFORT and VOLATILE, which matches all of them.
    """
    found = list(offers)
    best_effort = ReliabilityPolicy.BEST_EFFORT
    reliable = bool(found) and all(qos.reliability is not best_effort for qos, _ in found)
    # Only a strict publisher insists on being best effort, and KEEP_ALL needs reliability.
    if lossless and not any(strict and qos.reliability is best_effort for qos, strict in found):
        reliable = True
    latched = bool(found) and all(qos.durability is DurabilityPolicy.TRANSIENT_LOCAL for qos, _ in found)
    return QoSProfile(
        history=HistoryPolicy.KEEP_ALL if lossless else HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else best_effort,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def unheard(offers: Iterable[tuple[QoSProfile, bool]], requested: QoSProfile) -> str:
    """Return why a strict publisher does not match a subscription; "" if all match.

    Args:
        offers: As for `recording_qos`.
        requested: The QoS of the subscription.
    """
    for offered, strict in offers:
        verdict, text = qos_check_compatible(offered, requested)
        if strict and verdict is QoSCompatibility.ERROR:
            return text.removeprefix("ERROR: ").rstrip(";")
    return ""


def read_overrides(source: bytes) -> dict[str, QoSProfile]:
    """Return the profiles in a file of QoS overrides, by topic.

    Args:
        source: YAML: by topic, a mapping of policies as `history: keep_all`, `depth: 10` or
            `deadline: {sec: 1, nsec: 0}`.

    Raises:
        YamlError: It is no YAML, or too large.
        InvalidRecordingError: It has something else; the text says where and what.
    """
    mapping: Any = load_yaml(source)
    if not isinstance(mapping, dict):
        raise InvalidRecordingError("Expected a mapping of topics to QoS policies")
    mapping = cast("dict[str, Any]", mapping)
    return {_topic(name): _profile(str(name), policies) for name, policies in mapping.items()}


def _topic(name: object) -> str:
    if not isinstance(name, str) or not name.startswith("/"):
        raise InvalidRecordingError(f"Expected the full name of a topic, such as /imu, got {_shown(name)}")
    return name


def _profile(topic: str, policies: Any) -> QoSProfile:
    if not isinstance(policies, dict):
        raise InvalidRecordingError(f"{topic}: expected a mapping of QoS policies, got {_shown(policies)}")
    mapping = cast("dict[str, Any]", policies)
    chosen: dict[str, Any] = {}
    for name, value in mapping.items():
        if name not in _POLICIES:
            hint = did_you_mean(str(name), _POLICIES)
            raise InvalidRecordingError(f"{topic}: there is no policy {_shown(name)}{hint}")
        if name != _IGNORED:  # callboard's topics have no such names
            chosen[name] = _policy(f"{topic}: {name}", name, value)
    try:
        return QoSProfile(**chosen)
    except (ValueError, TypeError) as error:
        raise InvalidRecordingError(f"{topic}: {error}") from None


def _policy(where: str, name: str, value: Any) -> Any:
    """Return the value of a policy."""
    if name in _ENUMS:
        try:
            return _ENUMS[name].get_from_short_key(value)
        except (ValueError, AttributeError):
            keys = ", ".join(_ENUMS[name].short_keys())
            raise InvalidRecordingError(f"{where}: expected one of {keys}, got {_shown(value)}") from None
    if name == "depth":
        return value
    try:
        seconds, nanoseconds = value["sec"], value["nsec"]
        if type(seconds) is int and type(nanoseconds) is int and seconds >= 0 and nanoseconds >= 0:
            return Duration(seconds=seconds, nanoseconds=nanoseconds)
    except (TypeError, LookupError, ValueError, OverflowError):
        pass
    raise InvalidRecordingError(f"{where}: expected {{sec: 1, nsec: 0}}, got {_shown(value)}")


def _shown(value: object) -> str:
    return escape(repr(value)[:60])
