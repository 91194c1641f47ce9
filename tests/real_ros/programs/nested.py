"""Messages in fields of messages, and those of another class that programs put there."""

from __future__ import annotations

from builtin_interfaces.msg import Duration
from geometry_msgs.msg import Point, Polygon, Pose, PoseStamped, Quaternion, Vector3
from nav_msgs.msg import Path
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Empty, Header, String

from tests.real_ros.programs.message_types import plain


def _sent(message):
    """Return what is sent, or that the message is refused."""
    try:
        data = serialize_message(message)
    except Exception:  # noqa: BLE001 - each side has errors of its own
        return "refused"
    return plain(deserialize_message(data, type(message)))


def right_classes():
    """Send messages in fields, lists and tuples."""
    pose = Pose(position=Point(x=1.0))
    stamped = [PoseStamped(pose=pose), PoseStamped()]
    return [_sent(each) for each in (pose, *stamped, Path(poses=stamped), Path(poses=tuple(stamped)))]


def other_fields():
    """Put a message with other fields, a mapping, a class or None where a message belongs."""
    others = (Point(x=1.0), Empty(), String(data="a"), PoseStamped(), {}, {"position": {}}, None, Pose, 1)
    return [_sent(PoseStamped(pose=each)) for each in others]


def other_fields_in_lists():
    """Put them into a list, also far down."""
    lists = ([Pose()], [PoseStamped(), Point()], [PoseStamped(pose=Point())], [None], [PoseStamped], [{}])
    return [_sent(Path(poses=each)) for each in lists]


def the_same_fields():
    """Put a message of another class with the same fields there."""
    return [
        _sent(Pose(position=Vector3(x=1.0))),
        _sent(Header(stamp=Duration(sec=3))),
        _sent(Polygon(points=[Point(x=1.5)])),
    ]


def too_few_fields():
    """Put a message there that lacks one of the fields."""
    return _sent(Pose(orientation=Point(x=1.0)))


def too_many_fields():
    """Put a message there that has one field more."""
    return _sent(Pose(position=Quaternion(x=1.0, w=2.0)))
