"""The verbs of upstream's command `ros2`: topics, nodes, services, parameters, actions, states, interfaces.

`ros2 interface show` reads texts with `rosidl_adapter`, which a checkout of rosidl has.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

from tests.upstream.runs import OURS, Run

PACKAGE: Final = "ros2cli"
PARTS: Final = frozenset(
    {
        *("ros2action", "ros2interface", "ros2lifecycle", "ros2node", "ros2param", "ros2pkg", "ros2service"),
        *("ros2topic",),
    }
)
"""Packages with the verbs, beside the command's own."""
REQUIREMENTS: Final = ("argcomplete", "psutil")
"""What ros2cli imports that ROS 2 does not have; pip downloads it."""
ENDED: Final = (0, 2, 130, -2)
"""Exit codes of commands that SIGINT ends."""
ADD: Final = "example_interfaces/srv/AddTwoInts"
FIBONACCI: Final = "example_interfaces/action/Fibonacci"
PARAMETERS: Final = Path(__file__).with_name("robot.yaml")
GOAL: Final = "{order: 2}"


def verb(words: str, *shows: str, args: tuple[str, ...] = (), endless: bool = False) -> Run:
    """Return a run of a verb, once the robot is there.

    Args:
        words: The verb and its arguments, such as "topic type /points".
        *shows: Patterns.
        args: Arguments with spaces.
        endless: Whether it runs until SIGINT.
    """
    return Run(
        PACKAGE,
        "ros2",
        args=(*words.split(), *args),
        shows=shows,
        after="ready",
        ends=not endless,
        codes=ENDED if endless else (0,),
        words=2,
    )


def query(words: str, *shows: str) -> Run:
    """Return a run of a verb that would ask ros2cli's daemon, which would stay and know another broker."""
    return verb(f"{words} --no-daemon", *shows)


_ROBOT: Final = Run(OURS, "robot")
SCENARIOS: Final = (
    (
        _ROBOT,
        query("topic list -t", r"/points \[geometry_msgs/msg/PointStamped\]"),
        query("topic type /points", "^geometry_msgs/msg/PointStamped"),
        query("topic info -v /points", "Publisher count: 1", "Node name: robot", "Reliability: RELIABLE"),
        query("topic find geometry_msgs/msg/PointStamped", "/points"),
        query("topic echo --once /points", "header:", "point:", "x: 0.0"),
        verb("topic pub --once /words std_msgs/msg/String", "publishing #1", args=("{data: hi}",)),
        verb("topic hz -w 2 /points", r"average rate: \d", endless=True),
        verb("topic bw /points", r"\d B/s from", endless=True),
        verb("topic delay -w 2 /points", r"average delay: -?\d", endless=True),
    ),
    (
        _ROBOT,
        query("node list", "/robot"),
        query(
            "node info /robot",
            "Publishers:",
            "/points: geometry_msgs/msg/PointStamped",
            f"/fibonacci: {FIBONACCI}",
        ),
        query("service list -t", rf"/add_two_ints \[{ADD}\]"),
        verb("service type /add_two_ints", f"^{ADD}"),
        query("service info /add_two_ints", "Services count: 1"),
        verb(f"service find {ADD}", "/add_two_ints"),
        verb(f"service call /add_two_ints {ADD}", "response:", "sum=5", args=("{a: 2, b: 3}",)),
        verb(f"service echo /add_two_ints {ADD}", "event_type: REQUEST_RECEIVED", "- a: 2", endless=True),
    ),
    (
        _ROBOT,
        query("param list /robot", "speed"),
        query("param get /robot speed", r"Double value is: 0\.5"),
        query("param set /robot use_sim_time false", "Set parameter successful"),
        query("param describe /robot speed", "Parameter name: speed", "Type: double"),
        query("param dump /robot", "/robot:", r"speed: 0\.5"),
        query(f"param load /robot {PARAMETERS}", "Set parameter speed successful"),
        query("param delete /robot nothing", "Deleting parameter failed"),
    ),
    (
        _ROBOT,
        verb("action list -t", rf"/fibonacci \[{FIBONACCI}\]"),
        verb("action info /fibonacci", "Action servers: 1"),
        verb("action type /fibonacci", f"^{FIBONACCI}"),
        verb(f"action find {FIBONACCI}", "/fibonacci"),
        verb(f"action send_goal -f /fibonacci {FIBONACCI}", "Feedback", "Result", "SUCCEEDED", args=(GOAL,)),
    ),
    (
        _ROBOT,
        query("lifecycle nodes", "/robot"),
        query("lifecycle get /robot", "unconfigured|inactive"),
        query("lifecycle list /robot", r"- (configure|activate) \["),
        query("lifecycle set /robot configure", "Transitioning successful"),
    ),
    (
        _ROBOT,
        verb("interface list -m", "std_msgs/msg/String"),
        verb("interface packages", "std_msgs"),
        verb("interface package std_srvs", "std_srvs/srv/SetBool"),
        verb("interface proto geometry_msgs/msg/Twist", "linear:", r"x: 0\.0"),
        verb("interface show std_srvs/srv/SetBool", "bool data", "---", "string message"),
    ),
)
