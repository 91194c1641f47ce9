"""The programs of upstream's collection of demos."""

from __future__ import annotations

from typing import Final

from tests.upstream.runs import OURS, Run, command, demo

PUBLISHING: Final = (r'Publishing: "Hello World: 0"', r'Publishing: "Hello World: 2"')
BRACKETS: Final = (r"I heard: \[Hello World: \d+\]",) * 2
FEEDBACK: Final = r"eedback: array\('i', \[0, 1, 1\b"
RESULT: Final = r"Result: .*0, 1, 1, 2, 3, 5, 8, 13, 21, 34, 55"
CALLED: Final = (r"Incoming request\na: \d+ b: \d+",)
QOS: Final = "quality_of_service_demo_py"

SCENARIOS: Final = (
    (
        demo("demo_nodes_py", "talker", r'Publishing: "Hello World: 2"'),
        demo("demo_nodes_py", "listener", *BRACKETS),
    ),
    (
        demo(
            "demo_nodes_py",
            "talker_qos",
            "Reliable talker",
            *PUBLISHING,
            args=("--reliable", "-n", "10"),
            ends=True,
        ),
        demo(
            "demo_nodes_py",
            "listener_qos",
            "Reliable listener",
            *BRACKETS,
            args=("--reliable", "-n", "3"),
            ends=True,
        ),
    ),
    (
        demo("demo_nodes_py", "talker", r'Publishing: "Hello World: 2"'),
        demo("demo_nodes_py", "listener_serialized", r"I heard: .b'.*Hello World: \d+"),
    ),
    (
        demo(
            "demo_nodes_py",
            "matched_event_detect",
            "First subscription is connected",
            "number of connected subscription is 1 and .* 2",
            "subscription is -1 and .* 1",
            "Last subscription is disconnected",
            "First publisher is connected",
            "number of connected publisher is 1 and .* 2",
            "publisher is -1 and .* 1",
            "Last publisher is disconnected",
            ends=True,
        ),
    ),
    (
        demo(
            "topic_monitor",
            "topic_monitor",
            "small_data: Alive",
            "small_data: -1",
            "small_data: Offline",
            codes=(0, 1, -2, 130),
            quiet=False,
        ),
        demo(
            "topic_monitor",
            "data_publisher",
            'Publishing: "5"',
            args=("small", "--end-after", "12"),
            ends=True,
        ),
    ),
    (
        demo(
            "demo_nodes_py",
            "add_two_ints_client_async",
            "not available, waiting",
            "add_two_ints: 5",
            ends=True,
        ),
        demo("demo_nodes_py", "add_two_ints_server", *CALLED, after="not available"),
        demo("demo_nodes_py", "add_two_ints_client", "add_two_ints: 5", ends=True),
    ),
    (
        demo("demo_nodes_py", "introspection", *CALLED, "Result of add_two_ints: 5"),
        command("param set /introspection_service service_configure_introspection contents"),
        command(
            "topic echo --once /add_two_ints/_service_event", r"sequence_number: \d+", "[ab]: [23]|sum: 5"
        ),
    ),
    (
        demo(
            "demo_nodes_py",
            "use_logger_service",
            "1 with INFO",
            "logger level: 0",
            "2 with DEBUG",
            "logger level: 10",
            "3 with WARN",
            "logger level: 30",
            "4 with ERROR",
            "logger level: 40",
            ends=True,
        ),
    ),
    (
        Run(OURS, "parameter_blackboard"),
        command("param list /parameter_blackboard", "use_sim_time"),
        demo(
            "demo_nodes_py",
            "async_param_client",
            "Setting",
            "successful: True",
            "Listing",
            "- int_parameter",
            "Getting",
            "int_parameter: 10",
            "Loading",
            "successful: True",
            "Deleting",
            "successful: True",
            ends=True,
        ),
    ),
    (
        demo("demo_nodes_py", "set_parameters_callback"),
        command("param set /set_parameters_callback param1 1.0"),
        command("param get /set_parameters_callback param2", r"4\.0"),
    ),
    (
        demo("action_tutorials_py", "fibonacci_action_server", "Executing goal", FEEDBACK),
        demo("action_tutorials_py", "fibonacci_action_client", "Goal accepted", FEEDBACK, RESULT, ends=True),
    ),
    (
        demo(
            QOS,
            "deadline",
            "heard",
            r"deadline missed - total 1 delta 1",
            args=("600", "--publish-for", "2000", "--pause-for", "2000"),
        ),
    ),
    *(
        (
            demo(
                QOS,
                "incompatible_qos",
                rf"incompatible qos - total 1 delta 1 .*kind: .*{kind}",
                "Publishing",
                args=(policy,),
                ends=True,
            ),
        )
        for policy, kind in (
            ("durability", "(DURABILITY|2)"),
            ("deadline", "(DEADLINE|4)"),
            ("liveliness_policy", "(LIVELINESS|8)"),
            ("liveliness_lease_duration", "(LIVELINESS|8|256)"),
            ("reliability", "(RELIABILITY|16)"),
        )
    ),
    (
        demo(
            QOS,
            "lifespan",
            "Publishing",
            r"heard: \[.*[3-9]\]",
            args=("1000", "--publish-count", "10", "--subscribe-after", "3000"),
        ),
    ),
    (
        demo(
            QOS,
            "liveliness",
            "alive_count: 1",
            "heard",
            r"not_alive_count: 1|alive_count: 0",
            args=("1000", "--kill-publisher-after", "2000"),
        ),
    ),
    (
        demo(QOS, "message_lost_listener", "I heard an Image"),
        command("topic pub --once -w 1 /message_lost_chatter sensor_msgs/msg/Image"),
    ),
    (
        demo(
            QOS,
            "qos_overrides_talker",
            *PUBLISHING,
            args=(
                "--ros-args",
                "-p",
                "qos_overrides./qos_overrides_chatter.publisher.reliability:=best_effort",
            ),
        ),
        demo(
            QOS,
            "qos_overrides_listener",
            *BRACKETS,
            args=(
                "--ros-args",
                "-p",
                "qos_overrides./qos_overrides_chatter.subscription.reliability:=best_effort",
            ),
        ),
    ),
    (
        demo(
            "lifecycle_py",
            "lifecycle_talker",
            "on_configure",
            "inactive",
            "on_activate",
            r"active. Publishing: \[",
            "on_deactivate",
            "on_cleanup",
            "on_shutdown",
        ),
        command("lifecycle set /lc_talker configure"),
        command("lifecycle set /lc_talker activate", after="is inactive"),
        command("lifecycle set /lc_talker deactivate", after="is active"),
        command("lifecycle set /lc_talker cleanup"),
        command("lifecycle set /lc_talker shutdown"),
    ),
)
