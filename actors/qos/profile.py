"""QoS profiles: policies, presets and their form on the wire.

Names, numbers and presets are rclpy's. Profiles are immutable; `dataclasses.replace` changes one. The broker
applies history, depth and durability; nodes check deadline, lifespan and lease (docs/protocol.md §5.3.2).
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from enum import Enum, IntEnum, unique
from functools import lru_cache
from typing import TYPE_CHECKING, Final, TypeVar

from actors.time.types import INFINITE, Duration
from proto.errors import CallboardError
from proto.limits import MAX_DEPTH
from proto.wire import qos as wire
from proto.wire.qos import DEFAULT_DEPTH

if TYPE_CHECKING:
    from collections.abc import Mapping
    from typing import Self


class InvalidQoSProfileError(CallboardError, ValueError):
    """Settings of a QoS profile are missing, out of range or contradictory; `reason` names them."""

    def __init__(self, reason: str) -> None:
        super().__init__(f"Invalid QoSProfile: {reason}")
        self.reason = reason


class QoSPolicyEnum(IntEnum):
    """Base of the policies; a short key is a policy's name in lower case, as on a command line."""

    @classmethod
    def short_keys(cls) -> list[str]:
        """Return the keys that `get_from_short_key` accepts, in the order of their numbers."""
        return [name.lower() for name in cls.__members__]

    @classmethod
    def get_from_short_key(cls, name: str) -> Self:
        """Return the policy with a short key.

        Args:
            name: The key, in any case.

        Raises:
            ValueError: It is unknown; the text lists the known keys.
        """
        try:
            return cls[name.upper()]
        except KeyError:
            raise ValueError(f"{name!r} is not one of {', '.join(cls.short_keys())}") from None

    @property
    def short_key(self) -> str:
        """The policy's name in lower case."""
        return self.name.lower()


@unique
class HistoryPolicy(QoSPolicyEnum):
    """What happens when a queue is full: KEEP_LAST drops the oldest, KEEP_ALL holds the publisher back."""

    SYSTEM_DEFAULT = 0
    KEEP_LAST = wire.KEEP_LAST
    KEEP_ALL = wire.KEEP_ALL
    UNKNOWN = 3


@unique
class ReliabilityPolicy(QoSPolicyEnum):
    """Whether messages may be lost on the way."""

    SYSTEM_DEFAULT = 0
    RELIABLE = wire.RELIABLE
    BEST_EFFORT = wire.BEST_EFFORT
    UNKNOWN = 3
    BEST_AVAILABLE = 4


@unique
class DurabilityPolicy(QoSPolicyEnum):
    """Whether a late subscription still gets the last messages (TRANSIENT_LOCAL) or not."""

    SYSTEM_DEFAULT = 0
    TRANSIENT_LOCAL = wire.TRANSIENT_LOCAL
    VOLATILE = wire.VOLATILE
    UNKNOWN = 3
    BEST_AVAILABLE = 4


@unique
class LivelinessPolicy(QoSPolicyEnum):
    """How a publisher shows that it is alive: by running (AUTOMATIC) or publishing (MANUAL_BY_TOPIC)."""

    SYSTEM_DEFAULT = 0
    AUTOMATIC = wire.AUTOMATIC
    MANUAL_BY_TOPIC = wire.MANUAL_BY_TOPIC
    UNKNOWN = 4
    BEST_AVAILABLE = 5


QoSHistoryPolicy = HistoryPolicy
QoSReliabilityPolicy = ReliabilityPolicy
QoSDurabilityPolicy = DurabilityPolicy
QoSLivelinessPolicy = LivelinessPolicy

_Policy = TypeVar("_Policy", HistoryPolicy, ReliabilityPolicy, DurabilityPolicy, LivelinessPolicy)

UNLIMITED: Final = Duration()
"""No limit; rclpy's default."""


@dataclass(frozen=True, kw_only=True, slots=True, init=False)
class QoSProfile:
    """The QoS of one publisher, subscription, client or service.

    Args:
        history: KEEP_LAST if only a depth is given. KEEP_LAST needs a depth.
        depth: Messages to keep, 0 to `MAX_DEPTH`. Zero with KEEP_LAST warns and is used as `DEFAULT_DEPTH`.
        reliability: RELIABLE by default.
        durability: VOLATILE by default.
        deadline: Longest time between two messages that a publisher offers or a subscription accepts.
        lifespan: Age at which a publisher's messages expire; subscriptions do not get expired ones. The
            clocks of the hosts must agree to well below it.
        liveliness: AUTOMATIC by default.
        liveliness_lease_duration: Longest time in which a MANUAL_BY_TOPIC publisher publishes or calls
            `assert_liveliness`. An AUTOMATIC publisher is dead at the broker's keepalive limit.

    Times are a Duration or seconds; zero and infinity mean no limit.

    Raises:
        InvalidQoSProfileError: Neither history nor depth is given, KEEP_LAST has no depth, or a number is out
            of range.
        TypeError: A value is of another type, or an option is unknown.
    """

    history: HistoryPolicy
    depth: int
    reliability: ReliabilityPolicy
    durability: DurabilityPolicy
    deadline: Duration
    lifespan: Duration
    liveliness: LivelinessPolicy
    liveliness_lease_duration: Duration

    def __init__(
        self,
        *,
        history: HistoryPolicy | int | None = None,
        depth: int | None = None,
        reliability: ReliabilityPolicy | int = ReliabilityPolicy.RELIABLE,
        durability: DurabilityPolicy | int = DurabilityPolicy.VOLATILE,
        deadline: Duration | float = UNLIMITED,
        lifespan: Duration | float = UNLIMITED,
        liveliness: LivelinessPolicy | int = LivelinessPolicy.AUTOMATIC,
        liveliness_lease_duration: Duration | float = UNLIMITED,
    ) -> None:
        if history is None:
            if depth is None:
                raise InvalidQoSProfileError("History and/or depth settings are required.")
            history = HistoryPolicy.KEEP_LAST
        kept = _policy(HistoryPolicy, "history", history)
        if depth is None:
            if kept is HistoryPolicy.KEEP_LAST:
                raise InvalidQoSProfileError("History set to KEEP_LAST without a depth setting.")
            depth = DEFAULT_DEPTH
        _check_depth(depth)
        if depth == 0 and kept is HistoryPolicy.KEEP_LAST:
            text = f"a QoS depth of 0 with KEEP_LAST can keep no message; {DEFAULT_DEPTH} is used instead"
            warnings.warn(text, UserWarning, stacklevel=2)
        object.__setattr__(self, "history", kept)
        object.__setattr__(self, "depth", depth)
        object.__setattr__(self, "reliability", _policy(ReliabilityPolicy, "reliability", reliability))
        object.__setattr__(self, "durability", _policy(DurabilityPolicy, "durability", durability))
        object.__setattr__(self, "deadline", _time("deadline", deadline))
        object.__setattr__(self, "lifespan", _time("lifespan", lifespan))
        object.__setattr__(self, "liveliness", _policy(LivelinessPolicy, "liveliness", liveliness))
        lease = _time("liveliness_lease_duration", liveliness_lease_duration)
        object.__setattr__(self, "liveliness_lease_duration", lease)

    @lru_cache(maxsize=64)  # noqa: B019 - each endpoint asks twice, and programs have few profiles
    def resolved(self) -> QoSProfile:
        """Return the effective profile, without open policies.

        SYSTEM_DEFAULT, UNKNOWN and BEST_AVAILABLE become KEEP_LAST, RELIABLE, VOLATILE and AUTOMATIC; with an
        open history, or a KEEP_LAST depth of 0, the depth becomes `DEFAULT_DEPTH`; infinite times become
        zero.
        """
        keep_all = self.history is HistoryPolicy.KEEP_ALL
        best_effort = self.reliability is ReliabilityPolicy.BEST_EFFORT
        transient = self.durability is DurabilityPolicy.TRANSIENT_LOCAL
        manual = self.liveliness is LivelinessPolicy.MANUAL_BY_TOPIC
        has_history = self.history in {HistoryPolicy.KEEP_LAST, HistoryPolicy.KEEP_ALL}
        return QoSProfile(
            history=HistoryPolicy.KEEP_ALL if keep_all else HistoryPolicy.KEEP_LAST,
            depth=self.depth if has_history and self.depth else DEFAULT_DEPTH,
            reliability=ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if transient else DurabilityPolicy.VOLATILE,
            deadline=_limited(self.deadline),
            lifespan=_limited(self.lifespan),
            liveliness=LivelinessPolicy.MANUAL_BY_TOPIC if manual else LivelinessPolicy.AUTOMATIC,
            liveliness_lease_duration=_limited(self.liveliness_lease_duration),
        )

    @lru_cache(maxsize=64)  # noqa: B019 - as for `resolved`
    def to_wire(self, *, strict: bool = False) -> Mapping[str, int]:
        """Return the resolved profile as plain ints by name, for a declaration frame.

        Times are in nanoseconds. Values at their default are omitted, except for the first four keys.

        Args:
            strict: The endpoint matches none with which this profile is incompatible.
        """
        profile = self.resolved()
        fields = {
            "history": int(profile.history),
            "depth": profile.depth,
            "reliability": int(profile.reliability),
            "durability": int(profile.durability),
        }
        if profile.liveliness is not LivelinessPolicy.AUTOMATIC:
            fields["liveliness"] = int(profile.liveliness)
        fields |= {key: ns for key, name in _TIMES.items() if (ns := getattr(profile, name).nanoseconds)}
        return fields | {"strict": True} if strict else fields

    @classmethod
    def from_wire(cls, fields: Mapping[str, object]) -> QoSProfile:
        """Return the resolved profile of a declaration frame.

        Args:
            fields: Result of `to_wire`, of this or a later version. Unknown keys are ignored, and missing
                ones have their defaults.

        Raises:
            InvalidQoSProfileError: A value is not an int, or out of range.
        """
        numbers: dict[str, int] = {}
        for key in ("history", "depth", "reliability", "durability", "liveliness", *_TIMES):
            value = fields.get(key)
            if value is None:
                continue
            if not isinstance(value, int) or isinstance(value, bool):
                raise InvalidQoSProfileError(f"{key} must be an int, not {type(value).__name__}")
            numbers[key] = value
        depth = numbers.get("depth", DEFAULT_DEPTH)
        history = numbers.get("history", HistoryPolicy.KEEP_LAST)
        if depth == 0 and history == HistoryPolicy.KEEP_LAST:
            raise InvalidQoSProfileError("history depth must be at least 1 with KEEP_LAST")
        profile = cls(
            history=history,
            depth=depth,
            reliability=numbers.get("reliability", ReliabilityPolicy.RELIABLE),
            durability=numbers.get("durability", DurabilityPolicy.VOLATILE),
            liveliness=numbers.get("liveliness", LivelinessPolicy.AUTOMATIC),
            **{name: _nanoseconds(key, numbers.get(key, 0)) for key, name in _TIMES.items()},
        )
        return profile.resolved()


_TIMES: Final = {
    "deadline_ns": "deadline",
    "lifespan_ns": "lifespan",
    "lease_ns": "liveliness_lease_duration",
}
"""The times of a profile by their keys on the wire."""


def qos_from(value: QoSProfile | int) -> QoSProfile:
    """Return the profile of an API's `qos` argument.

    Args:
        value: A profile, or a depth for KEEP_LAST.

    Raises:
        ValueError: The depth is negative or over `MAX_DEPTH`.
        TypeError: It is neither a profile nor an int.
    """
    if isinstance(value, QoSProfile):
        return value
    _require_int(value)
    return QoSProfile(depth=value)


def _policy(kind: type[_Policy], name: str, value: object) -> _Policy:
    if not isinstance(value, int) or isinstance(value, bool):
        raise TypeError(f"{name} must be a {kind.__name__} or its number, not {type(value).__name__}")
    if isinstance(value, QoSPolicyEnum) and not isinstance(value, kind):
        raise TypeError(f"{name} must be a {kind.__name__}, not a {type(value).__name__}")
    try:
        return kind(value)
    except ValueError:
        raise InvalidQoSProfileError(f"{value} is not the number of a {kind.__name__}") from None


def _time(name: str, value: object) -> Duration:
    if isinstance(value, int | float) and not isinstance(value, bool):
        try:
            value = INFINITE if value == float("inf") else Duration(seconds=value)
        except (OverflowError, ValueError) as error:
            raise InvalidQoSProfileError(f"{name}: {error}") from None
    if not isinstance(value, Duration):
        raise TypeError(f"{name} must be a Duration or seconds, not {type(value).__name__}")
    if value < UNLIMITED:
        raise InvalidQoSProfileError(f"{name} must be greater than or equal to zero")
    return value


def _limited(duration: Duration) -> Duration:
    return UNLIMITED if duration == INFINITE else duration


def _nanoseconds(key: str, number: int) -> Duration:
    try:
        return Duration(nanoseconds=number)
    except OverflowError as error:
        raise InvalidQoSProfileError(f"{key}: {error}") from None


def _check_depth(depth: object) -> None:
    if not isinstance(depth, int) or isinstance(depth, bool):
        raise TypeError(f"depth must be an int, not {type(depth).__name__}")
    if depth < 0:
        raise InvalidQoSProfileError("history depth must be greater than or equal to zero")
    if depth > MAX_DEPTH:
        raise InvalidQoSProfileError(f"history depth must be at most {MAX_DEPTH}")


def _require_int(value: object) -> None:
    if not isinstance(value, int) or isinstance(value, bool):
        raise TypeError(f"Expected QoSProfile or int, but received {type(value)!r}")


qos_profile_default: Final = QoSProfile(depth=DEFAULT_DEPTH)
qos_profile_unknown: Final = QoSProfile(
    history=HistoryPolicy.UNKNOWN,
    depth=0,
    reliability=ReliabilityPolicy.UNKNOWN,
    durability=DurabilityPolicy.UNKNOWN,
    liveliness=LivelinessPolicy.UNKNOWN,
)
qos_profile_system_default: Final = QoSProfile(
    history=HistoryPolicy.SYSTEM_DEFAULT,
    depth=0,
    reliability=ReliabilityPolicy.SYSTEM_DEFAULT,
    durability=DurabilityPolicy.SYSTEM_DEFAULT,
    liveliness=LivelinessPolicy.SYSTEM_DEFAULT,
)
qos_profile_sensor_data: Final = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
qos_profile_services_default: Final = QoSProfile(depth=DEFAULT_DEPTH)
qos_profile_parameters: Final = QoSProfile(depth=1000)
qos_profile_parameter_events: Final = QoSProfile(depth=1000)
qos_profile_rosout_default: Final = QoSProfile(
    depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL, lifespan=10.0
)
qos_profile_action_status_default: Final = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
qos_profile_best_available: Final = QoSProfile(
    depth=DEFAULT_DEPTH,
    reliability=ReliabilityPolicy.BEST_AVAILABLE,
    durability=DurabilityPolicy.BEST_AVAILABLE,
    liveliness=LivelinessPolicy.BEST_AVAILABLE,
)


class QoSPresetProfiles(Enum):
    """The presets by name; `.value` is the profile. Equal profiles are aliases of one member."""

    UNKNOWN = qos_profile_unknown
    DEFAULT = qos_profile_default
    SYSTEM_DEFAULT = qos_profile_system_default
    SENSOR_DATA = qos_profile_sensor_data
    SERVICES_DEFAULT = qos_profile_services_default
    PARAMETERS = qos_profile_parameters
    PARAMETER_EVENTS = qos_profile_parameter_events
    ACTION_STATUS_DEFAULT = qos_profile_action_status_default
    BEST_AVAILABLE = qos_profile_best_available
    ROSOUT_DEFAULT = qos_profile_rosout_default

    @classmethod
    def short_keys(cls) -> list[str]:
        """Return the lower-case names that `get_from_short_key` accepts."""
        return [name.lower() for name in cls.__members__]

    @classmethod
    def get_from_short_key(cls, name: str) -> QoSProfile:
        """Return the profile with a short key.

        Args:
            name: The key, in any case.

        Raises:
            ValueError: It is unknown; the text lists the known keys.
        """
        try:
            return cls[name.upper()].value
        except KeyError:
            raise ValueError(f"{name!r} is not one of {', '.join(cls.short_keys())}") from None


def renamed_qos(qos: QoSProfile | int) -> QoSProfile | int:
    """Return what a caller of the caller gave as `qos=`, the former name of `qos_profile=`; warn of it."""
    warnings.warn("`qos=` is called `qos_profile=`, as in rclpy", DeprecationWarning, stacklevel=3)
    return qos
