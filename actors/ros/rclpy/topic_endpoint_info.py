"""The publishers and subscriptions of a topic, as the graph has them."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Final

from actors.qos.profile import UNLIMITED
from actors.ros.rclpy.qos import HistoryPolicy, QoSProfile, qos_profile_unknown
from actors.ros.rclpy.type_hash import TypeHash
from actors.time.types import INFINITE
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from actors.graph.snapshot import EndpointInfo

_GID_SIZE: Final = 16


class TopicEndpointTypeEnum(IntEnum):
    """Kinds of endpoints."""

    INVALID = 0
    PUBLISHER = 1
    SUBSCRIPTION = 2


_KINDS: Final = {
    EntryKind.PUBLISHER: TopicEndpointTypeEnum.PUBLISHER,
    EntryKind.SUBSCRIPTION: TopicEndpointTypeEnum.SUBSCRIPTION,
}


@dataclass(slots=True)
class TopicEndpointInfo:
    """A publisher or subscription; `str` returns ROS 2's 14 lines."""

    node_name: str = ""
    node_namespace: str = ""
    topic_type: str = ""
    topic_type_hash: TypeHash = field(default_factory=TypeHash)
    endpoint_type: TopicEndpointTypeEnum = TopicEndpointTypeEnum.INVALID
    endpoint_gid: list[int] = field(default_factory=list[int])
    """The broker's number for the endpoint, in 16 bytes."""
    qos_profile: QoSProfile = field(
        default_factory=lambda: QoSProfile.from_native(qos_profile_unknown.native())
    )

    __hash__ = None  # type: ignore[assignment]

    @classmethod
    def from_native(cls, info: EndpointInfo) -> TopicEndpointInfo:
        """Return callboard's information as rclpy's, with infinite times where there is no limit."""
        profile = QoSProfile.from_native(info.qos_profile)
        for name in ("lifespan", "deadline", "liveliness_lease_duration"):
            # ROS 2 shows "Infinite" where callboard has zero for no limit.
            if getattr(profile, name) == UNLIMITED:
                setattr(profile, name, INFINITE)
        return cls(
            info.node_name,
            info.node_namespace,
            info.topic_type,
            TypeHash.from_text(info.topic_type_hash),
            _KINDS.get(info.endpoint_type, TopicEndpointTypeEnum.INVALID),
            list(info.endpoint_id.to_bytes(_GID_SIZE, "big")),
            profile,
        )

    def __str__(self) -> str:
        qos = self.qos_profile
        depth = f" ({qos.depth})" if qos.history is HistoryPolicy.KEEP_LAST else ""
        lines = {
            "Node name": self.node_name,
            "Node namespace": self.node_namespace,
            "Topic type": self.topic_type,
            "Topic type hash": self.topic_type_hash,
            "Endpoint type": self.endpoint_type.name,
            "GID": ".".join(f"{each:02x}" for each in self.endpoint_gid),
            "QoS profile": "",
            "  Reliability": qos.reliability.name,
            "  History (Depth)": qos.history.name + depth,
            "  Durability": qos.durability.name,
            "  Lifespan": qos.lifespan,
            "  Deadline": qos.deadline,
            "  Liveliness": qos.liveliness.name,
            "  Liveliness lease duration": qos.liveliness_lease_duration,
        }
        return "\n".join(
            f"{name}: {value}" if name != "QoS profile" else "QoS profile:" for name, value in lines.items()
        )
