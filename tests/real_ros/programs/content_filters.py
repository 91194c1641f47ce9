"""Subscriptions that filter messages by their content."""

from __future__ import annotations

from geometry_msgs.msg import PoseStamped
from rclpy.qos import QoSProfile
from rclpy.subscription_content_filter_options import ContentFilterOptions
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Byte, Float32, Float64, Int32, String, UInt64

from tests.real_ros.programs.errors import outcome
from tests.real_ros.programs.running import running_node, spin_until


def _passing(message_type, messages, filters, number_of=lambda message: message.data):
    """Return what passes each filter: an expression, or one with its parameters.

    The subscription of all messages is made last, and spinning takes from subscriptions in their order: when
    it has all, the others have theirs.
    """
    with running_node() as node:
        publisher = node.create_publisher(message_type, "t", QoSProfile(depth=100))
        results, made = [], 0
        for each in filters:
            expression, parameters = (each, []) if isinstance(each, str) else each
            got = []

            def create(expression=expression, parameters=parameters, got=got):
                node.create_subscription(
                    message_type,
                    "t",
                    lambda message: got.append(number_of(message)),
                    QoSProfile(depth=100),
                    content_filter_options=ContentFilterOptions(expression, parameters),
                )
                return got

            results.append([expression, outcome(create)])
            made += results[-1][1] is got
        everything = []
        node.create_subscription(message_type, "t", everything.append, QoSProfile(depth=100))
        spin_until(node, lambda: publisher.get_subscription_count() == made + 1)
        for message in messages:
            publisher.publish(message)
        spin_until(node, lambda: len(everything) == len(messages))
        return results


def integers():
    """Compare integers."""
    filters = [
        "data > 1 AND NOT data = 3 OR data = 1",
        "data = 1 OR data = 2 AND data = 3",
        "data = 1 OR NOT data = 2 AND data = 3 OR data = 5",
        "NOT (data = 1 OR data = 2) AND data > 3 OR data = 2",
        "NOT NOT data = 1 AND data > 0",
        "NOT NOT data = 1 OR data = 2",
        "((data > 1 and data < 5) or not data < 8)",
        "data != 1",
        "data <> 1",
        "data<>1",
        "data >=3",
        "data>= 3",
        "data BETWEEN 1 AND 3",
        "data between 3 and 1",
        "data NOT BETWEEN 1 AND 3",
        "NOT data BETWEEN 1 AND 3 OR data = 2",
        "1 < data",
        "data = data",
        "1 = 1",
        "data = 0x14",
        "data = 010",
        "data > 1.5",
        "data = 16777216.0",
        "data = TRUE",
        "data = True",
        "data = '1'",
        "Data = 1",
        " data = 1",
        "data = 1 ",
        "( data = 1 )",
        "data = 1AND data=1",
        "data > 1 And data < 3",
        "data = 9223372036854775808",
        "data = 18446744073709551616",
        "data[0] = 1",
        "data LIKE '1'",
        "data >",
        "(data > 1",
        "nope = 1",
        ("data > %0 AND data < %1", ["1", "5"]),
        ("%0 = data", ["4.0"]),
        ("data = %1", ["4"]),
        ("data = 4", ["unused"]),
        ("data = %0", ["'4'"]),
        ("data = %0", [" 4"]),
        ("data = %0", ["1"] * 101),
    ]
    numbers = (-2, 0, 1, 2, 3, 4, 5, 8, 10, 20, 16777216, 16777217)
    return _passing(Int32, [Int32(data=each) for each in numbers], filters)


def strings():
    """Compare strings."""
    texts = ("", "a", "A", "abc", "aXc", "a%c", "ab\nc", "it's", "abcd", "zabc", "1", "x y")
    filters = [
        "data = 'a'",
        "data = `a'",
        'data = "a"',
        "data = a",
        "data = ''",
        "data > 'a'",
        "data BETWEEN 'a' AND 'b'",
        "data LIKE 'a%'",
        "data like '%b%'",
        "data LIKE 'a_c'",
        "data LIKE 'a?c'",
        "data LIKE 'a*'",
        "data LIKE 'a.c'",
        "data LIKE '%'",
        "data LIKE '%b%c%'",
        "data NOT LIKE 'a%'",
        "NOT data LIKE 'a%'",
        "data = 'it''s'",
        "data = 1",
        f"data = '{'a' * 256}'",
        ("data LIKE %0", ["'a%'"]),
        ("data = %0", ["a"]),
        ("data = '%0'", ["'a'"]),
    ]
    return _passing(String, [String(data=each) for each in texts], filters)


def other_numbers():
    """Compare numbers that are no int32."""
    nan = float("nan")
    floats = ["data = 0.1", "data > 0.1", "data <= 1", "NOT data > 1", "data <> data", "data BETWEEN 0 AND 1"]
    return [
        [
            [expression, [f"{each:.1f}" for each in got]]
            for message_type in (Float32, Float64)
            for expression, got in _passing(
                message_type, [message_type(data=each) for each in (0.1, 2.0, nan)], floats
            )
        ],
        _passing(
            Bool,
            [Bool(data=True), Bool(data=False)],
            ["data = TRUE", "data = 0", "data > -1", "data = 1.0", "data", "data = 'true'"],
        ),
        _passing(
            UInt64,
            [UInt64(data=1), UInt64(data=2**64 - 1)],
            ["data = 18446744073709551615", "data > -1", "data < 0"],
        ),
        _passing(
            Byte,
            [Byte(data=b"\x01"), Byte(data=b"\xc8")],
            ["data = 200", "data > -1", "data = 'a'"],
            lambda message: message.data[0],
        ),
    ]


def nested_fields():
    """Compare fields of nested messages, and elements."""
    poses = []
    for x, frame in ((0.0, "map"), (1.5, "odom"), (3.0, "map")):
        pose = PoseStamped()
        pose.pose.position.x, pose.header.frame_id = x, frame
        poses.append(pose)
    joints = [
        JointState(),
        JointState(name=["a"], position=[1.0]),
        JointState(name=["b", "c"], position=[2.0, 3.0]),
    ]
    return [
        _passing(
            PoseStamped,
            poses,
            [
                "pose.position.x > 1 AND header.frame_id = 'map'",
                "header.frame_id LIKE 'o%'",
                "pose.position.x > pose.position.y",
                "pose.position = 1",
                "pose.position.nope = 1",
                "pose .position.x > 1",
                "header.frame_id = pose.position.x",
                "pose.position.x = TRUE",
            ],
            lambda message: message.pose.position.x,
        ),
        _passing(
            JointState,
            joints,
            [
                "name[0] = 'b'",
                "NOT position[1] > 5",
                "name = 'a'",
                "position[0 ] > 1",
                "position[01] > 1",
                "header.frame_id[0] = 'a'",
            ],
            lambda message: len(message.name),
        ),
    ]


def changed():
    """Set, change and end a content filter."""
    with running_node() as node:
        received = []
        subscription = node.create_subscription(
            Int32, "t", lambda message: received.append(message.data), QoSProfile(depth=100)
        )

        def state():
            return [subscription.is_cft_enabled, outcome(lambda: [*subscription.get_content_filter()])]

        answers = [state()]
        for expression, parameters in (
            ("", []),
            ("data > %0", ["3"]),
            ("nope = 1", []),
            ("data > %1", ["3"]),
            ("data > %0", ["2", "unused"]),
            ("data > 1", "1"),
            ("data > 1", ("1",)),
            ("", []),
            ("data < 2", []),
        ):
            answers.append(outcome(subscription.set_content_filter, expression, parameters))
            answers.append(state())
        everything = []
        publisher = node.create_publisher(Int32, "t", QoSProfile(depth=100))
        node.create_subscription(Int32, "t", everything.append, QoSProfile(depth=100))
        spin_until(node, lambda: publisher.get_subscription_count() == 2)
        for number in range(5):
            publisher.publish(Int32(data=number))
        spin_until(node, lambda: len(everything) == 5)
        subscription.destroy()
        return [answers, received, outcome(subscription.set_content_filter, "data = 1", [])]


def raw():
    """Filter messages that are given as bytes; a filter without an expression is one, too."""
    with running_node() as node:
        options = ContentFilterOptions("data < 2", [])
        numbers, everything = [], []
        node.create_subscription(
            Int32, "t", numbers.append, QoSProfile(depth=100), raw=True, content_filter_options=options
        )
        node.create_subscription(Int32, "t", everything.append, QoSProfile(depth=100))
        empty = node.create_subscription(
            Int32, "u", print, 1, content_filter_options=ContentFilterOptions("", [])
        )
        publisher = node.create_publisher(Int32, "t", QoSProfile(depth=100))
        spin_until(node, lambda: publisher.get_subscription_count() == 2)
        for number in range(5):
            publisher.publish(Int32(data=number))
        spin_until(node, lambda: len(everything) == 5)
        return [len(numbers), empty.is_cft_enabled, [*empty.get_content_filter()]]


def _refused_here(text, *filters):
    return _passing(String, [String(data=text)], filters)


def regular_expressions():
    """Filter by MATCH, and by LIKE with a regular expression in it."""
    return _refused_here("abc", "data MATCH 'a.c'", "data LIKE 'a[b]c'")


def patterns_in_messages():
    """Take a field as the pattern of LIKE."""
    return _refused_here("abc", "'abc' LIKE data")


def characters_that_are_no_ascii():
    """Filter a character of two bytes by a pattern for one."""
    return _refused_here("ü", "data LIKE '_'")


def octal_numbers():
    """Compare with a number that begins with 0 and is not octal."""
    return _passing(Int32, [Int32(data=0)], ["data = 08"])


def elements_that_are_missing():
    """Name an element that some messages lack, beside a condition that holds."""
    return _passing(
        JointState,
        [JointState(), JointState(position=[1.0, 3.0])],
        ["header.frame_id = '' OR position[1] = 3"],
        lambda message: len(message.position),
    )
