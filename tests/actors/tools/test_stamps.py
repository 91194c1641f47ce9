"""Times that are filled in when a message is sent."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.convert import message_from_fields
from actors.interfaces.geometry_msgs.msg import PoseArray
from actors.interfaces.nav_msgs.msg import Path
from actors.interfaces.sensor_msgs.msg import Imu
from actors.interfaces.std_msgs.msg import Header, String
from actors.tools.stamps import Stamps

if TYPE_CHECKING:
    from actors.interfaces.message import Message

NOW_NS = 1_700_000_000_000_000_042
NOW = Time(sec=1_700_000_000, nanosec=42)


def stamped(msg_type: type[Message], values: dict[str, Any]) -> Any:
    """Return a message with these values, sent at NOW_NS."""
    plain, stamps = Stamps.taken_from(msg_type, values)
    message = message_from_fields(msg_type, plain)
    stamps.set(message, NOW_NS)
    return message


def test_an_auto_header_has_the_time() -> None:
    """And no frame."""
    assert stamped(Imu, {"header": "auto"}).header == Header(stamp=NOW)


def test_now_is_the_time() -> None:
    """In a header with a frame, say."""
    made = stamped(Imu, {"header": {"stamp": "now", "frame_id": "map"}})
    assert made.header == Header(stamp=NOW, frame_id="map")
    assert stamped(Header, {"stamp": "now"}).stamp == NOW


def test_times_in_lists_are_filled_in() -> None:
    """Each where it is asked for."""
    made = stamped(Path, {"header": "auto", "poses": [{"header": "auto"}, {}, {"header": {"stamp": "now"}}]})
    assert [pose.header.stamp for pose in made.poses] == [NOW, Time(), NOW]
    assert made.header.stamp == NOW


def test_times_are_filled_in_again() -> None:
    """The same message may be sent more than once."""
    plain, stamps = Stamps.taken_from(Imu, {"header": "auto"})
    message = message_from_fields(Imu, plain)
    for second in (1, 2):
        stamps.set(message, second * 10**9)
        assert message.header.stamp == Time(sec=second)


def test_the_words_mean_nothing_elsewhere() -> None:
    """A string may be `now`; what does not fit is left for whoever fills in the message."""
    assert stamped(String, {"data": "now"}) == String(data="now")
    for values in ({"header": "now"}, {"header": {"stamp": "auto"}}, {"nothing": "now"}, {"poses": "auto"}):
        plain, stamps = Stamps.taken_from(PoseArray, values)
        assert (plain, stamps.paths) == (values, [])
        with pytest.raises((AttributeError, TypeError, ValueError)):
            message_from_fields(PoseArray, plain)
