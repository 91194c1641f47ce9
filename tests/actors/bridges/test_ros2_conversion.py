"""Names of nodes in messages, across a bridge with a namespace."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from actors.bridges.ros2.conversion import converter
from actors.interfaces import cdr
from actors.interfaces.codec import codec_for
from actors.interfaces.rcl_interfaces.msg import Log, ParameterEvent

if TYPE_CHECKING:
    from actors.interfaces.message import Message


class Types:
    """The one class that both sides have."""

    def __init__(self, ours: type[Any]) -> None:
        self.ours = ours

    def to_callboard(self, data: bytes) -> bytes:
        """Convert without a change."""
        return codec_for(self.ours).encode(cdr.decode(self.ours, data))

    def to_ros(self, data: bytes) -> bytes:
        """Convert without a change."""
        return cdr.encode(codec_for(self.ours).decode(data))


@pytest.mark.parametrize(
    ("topic", "prefix", "theirs", "ours"),
    [
        ("/rosout", "/robot1", Log(name="ns.talker"), Log(name="robot1.ns.talker")),
        ("/rosout", "/a/b", Log(name="talker"), Log(name="a.b.talker")),
        ("/rosout", "", Log(name="talker"), Log(name="talker")),
        ("/lines", "/robot1", Log(name="talker"), Log(name="talker")),
        ("/parameter_events", "/a/b", ParameterEvent(node="/talker"), ParameterEvent(node="/a/b/talker")),
    ],
)
def test_nodes_are_named_as_their_side_names_them(
    topic: str, prefix: str, theirs: Message, ours: Message
) -> None:
    """With the namespace in callboard, without it in ROS 2; other topics stay as they are."""
    types: Any = Types(type(ours))
    arrived = converter(types, topic, prefix, from_ros=True)(cdr.encode(theirs))
    assert codec_for(type(ours)).decode(arrived) == ours
    assert cdr.decode(type(ours), converter(types, topic, prefix, from_ros=False)(arrived)) == theirs


def test_a_node_outside_the_namespace_keeps_its_name() -> None:
    """It has the same name in ROS 2."""
    types: Any = Types(Log)
    sent = converter(types, "/rosout", "/robot1", from_ros=False)(
        codec_for(Log).encode(Log(name="robot10.x"))
    )
    assert cdr.decode(Log, sent).name == "robot10.x"
