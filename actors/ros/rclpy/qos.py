"""QoS profiles that can be changed, as rclpy's; endpoints take a copy."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from actors.qos import profile as native
from actors.qos.compatibility import QoSCompatibility as QoSCompatibility
from actors.qos.compatibility import QoSPolicyKind as QoSPolicyKind
from actors.qos.compatibility import qos_check_compatible as _check_compatible
from actors.qos.profile import DurabilityPolicy as DurabilityPolicy
from actors.qos.profile import HistoryPolicy as HistoryPolicy
from actors.qos.profile import InvalidQoSProfileError
from actors.qos.profile import LivelinessPolicy as LivelinessPolicy
from actors.qos.profile import QoSPolicyEnum as QoSPolicyEnum
from actors.qos.profile import ReliabilityPolicy as ReliabilityPolicy
from actors.time.types import Duration

if TYPE_CHECKING:
    from collections.abc import Iterator

InvalidQoSProfileException: TypeAlias = InvalidQoSProfileError

QoSHistoryPolicy: TypeAlias = HistoryPolicy
QoSReliabilityPolicy: TypeAlias = ReliabilityPolicy
QoSDurabilityPolicy: TypeAlias = DurabilityPolicy
QoSLivelinessPolicy: TypeAlias = LivelinessPolicy

# The names of these values before ROS 2 Foxy, which programs still use; one of them was misspelt.
for _policy, _kind in (
    (HistoryPolicy, "HISTORY"),
    (ReliabilityPolicy, "RELIABILITY"),
    (DurabilityPolicy, "DURABILITY"),
    (LivelinessPolicy, "LIVELINESS"),
):
    for _member in _policy:
        setattr(_policy, f"RMW_QOS_POLICY_{_kind}_{_member.name}", _member)
setattr(LivelinessPolicy, "RMW_QOS_POLICY_DURABILITY_UNKNOWN", LivelinessPolicy.UNKNOWN)  # noqa: B010

_POLICIES: Final[dict[str, type[QoSPolicyEnum]]] = {
    "history": HistoryPolicy,
    "reliability": ReliabilityPolicy,
    "durability": DurabilityPolicy,
    "liveliness": LivelinessPolicy,
}
_FIELDS = (
    "history",
    "depth",
    "reliability",
    "durability",
    "lifespan",
    "deadline",
    "liveliness",
    "liveliness_lease_duration",
)
_SLOTS: Final = [f"_{name}" for name in (*_FIELDS, "avoid_ros_namespace_conventions")]
"""rclpy's attributes, by which programs copy profiles and print them."""


# callboard's profiles are frozen; rclpy's may be changed until an endpoint is made, and programs do so.
class QoSProfile:
    """The QoS of a publisher, subscription, client or service; fields may be assigned.

    Args:
        history: KEEP_LAST if only a depth is given.
        depth: Messages to keep; needed with KEEP_LAST.
        reliability: RELIABLE by default.
        durability: VOLATILE by default.
        lifespan: Age at which messages expire.
        deadline: Longest time between two messages.
        liveliness: SYSTEM_DEFAULT by default, which is AUTOMATIC.
        liveliness_lease_duration: Longest time without a sign of life.
        avoid_ros_namespace_conventions: Kept, without effect.

    Raises:
        InvalidQoSProfileException: Neither history nor depth is given, or KEEP_LAST without a depth.
    """

    __hash__ = None  # type: ignore[assignment]

    history: HistoryPolicy
    depth: int
    reliability: ReliabilityPolicy
    durability: DurabilityPolicy
    lifespan: Duration
    deadline: Duration
    liveliness: LivelinessPolicy
    liveliness_lease_duration: Duration

    def __init__(
        self,
        history: HistoryPolicy | int | None = None,
        depth: int | None = None,
        reliability: ReliabilityPolicy | int | None = None,
        durability: DurabilityPolicy | int | None = None,
        lifespan: Duration | None = None,
        deadline: Duration | None = None,
        liveliness: LivelinessPolicy | int | None = None,
        liveliness_lease_duration: Duration | None = None,
        avoid_ros_namespace_conventions: bool = False,
    ) -> None:
        given = {
            "history": history,
            "depth": depth,
            "reliability": reliability,
            "durability": durability,
            "lifespan": lifespan,
            "deadline": deadline,
            "liveliness": LivelinessPolicy.SYSTEM_DEFAULT if liveliness is None else liveliness,
            "liveliness_lease_duration": liveliness_lease_duration,
        }
        wanted: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
        # Made for its checks and its defaults, which then hold in both.
        profile = native.QoSProfile(**wanted)
        for name in _FIELDS:
            setattr(self, name, getattr(profile, name))
        self.avoid_ros_namespace_conventions = avoid_ros_namespace_conventions

    def __getattr__(self, name: str) -> Any:
        if name in _SLOTS:
            return getattr(self, name[1:])
        raise AttributeError(f"'QoSProfile' object has no attribute {name!r}")

    def __setattr__(self, name: str, value: Any) -> None:
        if name in _SLOTS:
            name = name[1:]
        policy = _POLICIES.get(name)
        super().__setattr__(name, value if policy is None else policy(value))  # an int becomes a policy

    @classmethod
    def from_native(cls, profile: native.QoSProfile) -> QoSProfile:
        """Return callboard's profile as rclpy's."""
        return cls(**{name: getattr(profile, name) for name in _FIELDS})

    def native(self) -> native.QoSProfile:
        """Return callboard's profile with the fields of now."""
        return native.QoSProfile(**{name: getattr(self, name) for name in _FIELDS})

    def _values(self) -> Iterator[object]:
        for name in _SLOTS:
            yield getattr(self, name)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, QoSProfile) and list(self._values()) == list(other._values())

    def __str__(self) -> str:
        fields = (f"{name[1:]}={value}" for name, value in zip(_SLOTS, self._values(), strict=True))
        return f"QoSProfile({', '.join(fields)})"

    __repr__ = __str__


setattr(QoSProfile, "__slots__", _SLOTS)  # noqa: B010 - afterwards: they are no slots


def profile_of(qos: QoSProfile | int) -> QoSProfile:
    """Return the profile of a depth, or a copy of a profile.

    Raises:
        ValueError: The depth is negative.
        TypeError: It is neither.
    """
    if isinstance(qos, QoSProfile):
        # A copy, because profiles may be changed: an endpoint keeps the values of the moment in which it
        # was made.
        return QoSProfile.from_native(qos.native())
    return QoSProfile.from_native(native.qos_from(qos))


def qos_check_compatible(
    publisher_qos: QoSProfile, subscription_qos: QoSProfile
) -> tuple[QoSCompatibility, str]:
    """Return whether a publisher and a subscription match, and what is wrong."""
    return _check_compatible(publisher_qos.native(), subscription_qos.native())


def qos_policy_name_from_kind(policy_kind: QoSPolicyKind | int) -> str:
    """Return the name of a policy, such as "DURABILITY"."""
    return QoSPolicyKind(policy_kind).name


def _preset(profile: native.QoSProfile) -> QoSProfile:
    """Return a profile as rclpy has it, which leaves the liveliness to the middleware."""
    made = QoSProfile.from_native(profile)
    if made.liveliness is LivelinessPolicy.AUTOMATIC:
        made.liveliness = LivelinessPolicy.SYSTEM_DEFAULT
    return made


qos_profile_unknown = _preset(native.qos_profile_unknown)
qos_profile_default = _preset(native.qos_profile_default)
qos_profile_system_default = _preset(native.qos_profile_system_default)
qos_profile_sensor_data = _preset(native.qos_profile_sensor_data)
qos_profile_services_default = _preset(native.qos_profile_services_default)
qos_profile_parameters = _preset(native.qos_profile_parameters)
qos_profile_parameter_events = _preset(native.qos_profile_parameter_events)
qos_profile_rosout_default = _preset(native.qos_profile_rosout_default)
qos_profile_action_status_default = _preset(native.qos_profile_action_status_default)
qos_profile_best_available = _preset(native.qos_profile_best_available)


class QoSPresetProfiles(Enum):
    """The profiles above, by name."""

    UNKNOWN = qos_profile_unknown
    DEFAULT = qos_profile_default
    SYSTEM_DEFAULT = qos_profile_system_default
    SENSOR_DATA = qos_profile_sensor_data
    SERVICES_DEFAULT = qos_profile_services_default
    PARAMETERS = qos_profile_parameters
    PARAMETER_EVENTS = qos_profile_parameter_events
    ROSOUT_DEFAULT = qos_profile_rosout_default
    ACTION_STATUS_DEFAULT = qos_profile_action_status_default
    BEST_AVAILABLE = qos_profile_best_available

    @classmethod
    def short_keys(cls) -> list[str]:
        """Return the keys that `get_from_short_key` accepts."""
        return [name.lower() for name in cls.__members__]

    @classmethod
    def get_from_short_key(cls, name: str) -> QoSProfile:
        """Return the profile of a name in any case."""
        return cls[name.upper()].value
