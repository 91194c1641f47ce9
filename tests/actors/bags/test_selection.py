"""The selection of topics to record or play."""

from __future__ import annotations

from typing import Any, Final

import pytest

from actors.bags.errors import InvalidBagOptionError
from actors.bags.selection import Selection, TopicState

STRING = "std_msgs/msg/String"
IMU = "sensor_msgs/msg/Imu"
GRAPH = {
    "/chatter": STRING,
    "/imu": IMU,
    "/left/imu": IMU,
    "/_hidden": STRING,
    "/left/_hidden/x": STRING,
    "/add/_service_event": "example_interfaces/srv/AddTwoInts_Event",
    "/left/add/_service_event": "example_interfaces/srv/AddTwoInts_Event",
    "/dock/_action/feedback": "dock_msgs/action/Dock_FeedbackMessage",
    "/dock/_action/status": "action_msgs/msg/GoalStatusArray",
    "/dock/_action/send_goal/_service_event": "dock_msgs/action/Dock_SendGoal_Event",
    "/dock/_action/cancel_goal/_service_event": "action_msgs/srv/CancelGoal_Event",
    "/dock/_action/get_result/_service_event": "dock_msgs/action/Dock_GetResult_Event",
}
EVENTS = {name for name in GRAPH if name.endswith("add/_service_event")}
DOCK = {name for name in GRAPH if name.startswith("/dock/")}
PLAIN = {"/chatter", "/imu", "/left/imu"}
HIDDEN = {"/_hidden", "/left/_hidden/x"}


NOTHING: Final = set[str]()


@pytest.mark.parametrize(
    ("options", "selected"),
    [
        ({"all_topics": True}, PLAIN),
        ({"all_topics": True, "include_hidden_topics": True}, PLAIN | HIDDEN),
        ({"all_services": True}, EVENTS),
        ({"all_actions": True}, DOCK),
        ({"all_topics": True, "all_services": True, "all_actions": True}, PLAIN | EVENTS | DOCK),
        ({"topics": ["/imu", "/absent"]}, {"/imu"}),
        ({"topics": ["/_hidden"]}, NOTHING),
        ({"topics": ["/_hidden"], "include_hidden_topics": True}, {"/_hidden"}),
        ({"topics": ["/add/_service_event"]}, NOTHING),
        ({"services": ["/add"]}, {"/add/_service_event"}),
        ({"actions": ["/dock"]}, DOCK),
        ({"services": ["/dock/_action/send_goal"]}, NOTHING),
        ({"topic_types": [IMU]}, {"/imu", "/left/imu"}),
        ({"topic_types": [IMU], "topics": ["/chatter"]}, PLAIN),
        ({"regex": "imu"}, {"/imu", "/left/imu"}),
        ({"regex": "^/left"}, {"/left/imu", "/left/add/_service_event"}),
        ({"regex": "doc"}, DOCK),
        ({"regex": "_service_event"}, NOTHING),
        ({"regex": "/imu", "topics": ["/chatter"]}, PLAIN),
        ({"all_topics": True, "regex": "chatter"}, PLAIN | {"/chatter"}),
        ({"all_topics": True, "exclude_regex": "^/left"}, {"/chatter", "/imu"}),
        ({"all_topics": True, "exclude_topics": ["/imu"]}, {"/chatter", "/left/imu"}),
        ({"all_topics": True, "exclude_topic_types": [IMU]}, {"/chatter"}),
        ({"topics": ["/imu"], "exclude_regex": "imu"}, NOTHING),
        ({"all_services": True, "exclude_services": ["/add"]}, {"/left/add/_service_event"}),
        ({"all_services": True, "exclude_regex": "left"}, {"/add/_service_event"}),
        ({"all_services": True, "exclude_regex": "_service_event"}, EVENTS),
        ({"all_actions": True, "exclude_actions": ["/dock"]}, NOTHING),
        ({"all_actions": True, "exclude_regex": "^/dock$"}, NOTHING),
    ],
)
def test_names_types_and_expressions(options: dict[str, Any], selected: set[str]) -> None:
    """Each option selects as in ROS 2's recorder; services and actions match by their own names."""
    selection = Selection(**options)
    assert {name for name, type_name in GRAPH.items() if selection.selects_name(name, type_name)} == selected


def state(
    publishers: int = 1, subscriptions: int = 1, types: frozenset[str] = frozenset({STRING})
) -> TopicState:
    """Return the state of a topic."""
    return TopicState("/chatter", types, publishers, subscriptions)


def test_topics_without_publishers_or_subscriptions() -> None:
    """An option includes topics without publishers, and another one excludes topics without subscriptions."""
    selection = Selection(all_topics=True)
    assert selection.selects(state())
    assert selection.selects(state(subscriptions=0))
    assert not selection.selects(state(publishers=0))
    assert Selection(all_topics=True, include_unpublished_topics=True).selects(state(publishers=0))
    assert not Selection(all_topics=True, ignore_leaf_topics=True).selects(state(subscriptions=0))


@pytest.mark.parametrize("types", [frozenset[str](), frozenset({STRING, IMU})])
def test_topics_of_no_or_several_types_are_not_recorded(types: frozenset[str]) -> None:
    """A bag's topic has one type."""
    assert not Selection(all_topics=True).selects(state(types=types))


def test_topics_that_are_awaited() -> None:
    """Named topics are awaited, unless an option may exclude them."""
    selection = Selection(topics=["/a", "/b", "/_c", "/x/_action/status"], exclude_topics=["/b"], regex="d")
    assert selection.awaited_topics == {"/a"}
    assert not Selection(topics=["/a"], exclude_topic_types=[IMU]).awaited_topics


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({}, "Nothing is selected"),
        ({"exclude_regex": "x"}, "Nothing is selected"),
        ({"regex": "("}, "not a valid regular expression"),
        ({"all_topics": True, "exclude_regex": "["}, "not a valid regular expression"),
    ],
)
def test_what_cannot_be_a_selection(options: dict[str, Any], text: str) -> None:
    """The error says what is wrong with it."""
    with pytest.raises(InvalidBagOptionError, match=text):
        Selection(**options)
