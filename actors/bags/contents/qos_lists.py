"""The QoS that publishers of a topic offered, in rosbag2's YAML: words since version 9, numbers before.

- history: keep_last
  depth: 10
  reliability: reliable
  durability: volatile
  deadline:
    sec: 9223372036
    nsec: 854775807
  …
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import islice
from typing import TYPE_CHECKING, Any, Final, TypeVar, cast

from actors.interfaces.yaml_reader import PlainText, YamlError, load_yaml
from actors.interfaces.yaml_writer import block_text
from actors.qos.profile import (
    UNLIMITED,
    DurabilityPolicy,
    HistoryPolicy,
    InvalidQoSProfileError,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)
from actors.time.types import INFINITE, NANOSECONDS_PER_SECOND, Duration
from proto.limits import MAX_DEPTH

if TYPE_CHECKING:
    from collections.abc import Iterable

MAX_PROFILES: Final = 1000
"""Limit for the publishers of a topic whose QoS is read or written: a publisher that comes and goes all day
must not fill the file."""
WORDS_SINCE: Final = 9
"""First version of metadata.yaml in which policies are words."""
_INFINITE: Final = divmod((1 << 63) - 1, NANOSECONDS_PER_SECOND)
_FOREVER_SEC: Final = (1 << 31) - 1
"""This many seconds or more mean "no limit": each middleware of ROS 2 Foxy wrote another number for it."""
_TIMES: Final = ("deadline", "lifespan", "liveliness_lease_duration")

_Policy = TypeVar("_Policy", HistoryPolicy, ReliabilityPolicy, DurabilityPolicy, LivelinessPolicy)


def qos_list(profiles: Iterable[QoSProfile], version: int = WORDS_SINCE) -> list[dict[str, Any]]:
    """Return profiles as rosbag2 writes them: mappings of policies to words, numbers and times.

    Args:
        profiles: The profiles; only the first `MAX_PROFILES` are used.
        version: The version of metadata.yaml.
    """
    return [_entry(profile, version) for profile in islice(profiles, MAX_PROFILES)]


def _entry(profile: QoSProfile, version: int) -> dict[str, Any]:
    entry: dict[str, Any] = {"history": profile.history, "depth": profile.depth}
    entry |= {"reliability": profile.reliability, "durability": profile.durability}
    entry |= {"deadline": profile.deadline, "lifespan": profile.lifespan, "liveliness": profile.liveliness}
    entry["liveliness_lease_duration"] = profile.liveliness_lease_duration
    for name, value in entry.items():
        if isinstance(value, Duration):
            sec, nsec = _INFINITE
            if value not in {UNLIMITED, INFINITE}:
                sec, nsec = divmod(value.nanoseconds, NANOSECONDS_PER_SECOND)
            entry[name] = {"sec": sec, "nsec": nsec}
        elif name != "depth":
            entry[name] = value.short_key if version >= WORDS_SINCE else int(value)
    return {**entry, "avoid_ros_namespace_conventions": False}


def qos_profiles(value: object) -> tuple[QoSProfile, ...]:
    """Return the profiles in a list that rosbag2 wrote, in any version.

    An unknown value of a policy becomes UNKNOWN.

    Args:
        value: The list, as a YAML document or already loaded; "" and None mean an empty list.

    Raises:
        YamlError: It is not a list of QoS profiles.
    """
    if isinstance(value, str):
        value = load_yaml(value, rules=PlainText)
    if not value:
        return ()
    if not isinstance(value, Sequence) or isinstance(value, str):
        raise YamlError("offered_qos_profiles is not a list")
    entries = cast("Sequence[object]", value)
    return tuple(_profile(each) for each in entries[:MAX_PROFILES])


def _profile(entry: object) -> QoSProfile:
    if not isinstance(entry, Mapping):
        raise YamlError("an entry of offered_qos_profiles is not a mapping")
    fields = cast("Mapping[str, Any]", entry)
    history = _policy(HistoryPolicy, fields.get("history"))
    depth = min(_integer("depth", fields.get("depth", 0)), MAX_DEPTH)
    if history is HistoryPolicy.KEEP_LAST and not depth:
        history = HistoryPolicy.SYSTEM_DEFAULT
    try:
        return QoSProfile(
            history=history,
            depth=depth,
            reliability=_policy(ReliabilityPolicy, fields.get("reliability")),
            durability=_policy(DurabilityPolicy, fields.get("durability")),
            liveliness=_policy(LivelinessPolicy, fields.get("liveliness")),
            **{name: _time(name, fields.get(name)) for name in _TIMES},
        )
    except InvalidQoSProfileError as error:
        raise YamlError(str(error)) from None


def _policy(kind: type[_Policy], value: object) -> _Policy:
    text = str(value).strip()
    try:
        return kind(int(text)) if text.isdecimal() else kind.get_from_short_key(text)
    except ValueError:
        return kind["UNKNOWN"]


def _integer(name: str, value: object) -> int:
    text = str(value).strip()
    if not text.isdecimal() or len(text) > len(str(1 << 64)):
        raise YamlError(f"{name} is not a number: {text[:40]!r}")
    return int(text)


def _time(name: str, value: object) -> Duration:
    if not isinstance(value, Mapping):
        return UNLIMITED
    fields = cast("Mapping[str, object]", value)
    sec = _integer(f"{name}.sec", fields.get("sec", 0))
    if sec >= _FOREVER_SEC:
        return UNLIMITED
    nsec = _integer(f"{name}.nsec", fields.get("nsec", 0))
    return Duration(nanoseconds=min(sec * NANOSECONDS_PER_SECOND + nsec, (1 << 63) - 1))


def qos_text(profiles: Iterable[QoSProfile], version: int = WORDS_SINCE) -> str:
    """Return profiles as a YAML document: the metadata of an MCAP channel, or a string in metadata.yaml.

    Args:
        profiles: As for `qos_list`.
        version: The version of metadata.yaml.
    """
    entries = qos_list(profiles, version)
    lines = block_text({"list": entries}).splitlines()[1:] if entries else []
    return "\n".join(lines)
