"""The programs of upstream's collection of examples."""

from __future__ import annotations

from typing import Final

from tests.upstream.runs import command, example

PUBLISHING: Final = (r'Publishing: "Hello World: 0"', r'Publishing: "Hello World: 2"')
HEARD: Final = (r'I heard: "Hello World: \d+"',) * 2
FEEDBACK: Final = r"eedback: array\('i', \[0, 1, 1\b"
RESULT: Final = r"0, 1, 1, 2, 3, 5, 8, 13, 21, 34, 55"
CALLED: Final = (r"Incoming request\na: \d+ b: \d+",)
SERVER, CLIENT = "minimal_action_server", "minimal_action_client"

SCENARIOS: Final = (
    (
        example("minimal_publisher", "publisher_member_function", *PUBLISHING),
        example("minimal_subscriber", "subscriber_member_function", *HEARD),
    ),
    (
        example("minimal_publisher", "publisher_local_function", *PUBLISHING),
        example("minimal_subscriber", "subscriber_lambda", *HEARD),
    ),
    (
        example("minimal_publisher", "publisher_old_school", *PUBLISHING),
        example("minimal_subscriber", "subscriber_old_school", *HEARD),
    ),
    (
        example("pointcloud_publisher", "pointcloud_publisher"),
        command("topic echo --once --no-arr /test_cloud", r"height: 1\b", r"point_step: 16"),
    ),
    (
        example("minimal_service", "service", r"Incoming request\s+a: 41 b: 1"),
        example("minimal_client", "client", "41 .* 1 = 42", ends=True),
    ),
    (
        example("minimal_service", "service_member_function", *CALLED),
        example(
            "minimal_client", "client_async_member_function", "41 .* 1 = 42", args=("41", "1"), ends=True
        ),
    ),
    (
        example("minimal_service", "service", r"Incoming request\s+a: 41 b: 1"),
        example("minimal_client", "client_async", "41 .* 1 = 42", ends=True),
        example("minimal_client", "client_async_callback", "41 .* 1 = 42", ends=True),
    ),
    (
        example(SERVER, "server", "Executing goal", FEEDBACK, RESULT),
        example(CLIENT, "client", "Goal accepted", FEEDBACK, f"succeeded.*{RESULT}", ends=True),
    ),
    (
        example(SERVER, "server_not_composable", "Executing goal", FEEDBACK, RESULT),
        example(
            CLIENT, "client_not_composable", "Goal accepted", FEEDBACK, f"succeeded.*{RESULT}", ends=True
        ),
    ),
    (
        example(SERVER, "server", "Executing goal", "Goal canceled"),
        example(
            CLIENT,
            "client_cancel",
            "Goal accepted",
            FEEDBACK,
            "Canceling",
            "successfully canceled",
            ends=True,
        ),
    ),
    (
        example(SERVER, "server", *("Returning result",) * 4),
        example(CLIENT, "client_asyncio", *("Goal accepted",) * 2, FEEDBACK, *("succeeded",) * 2, ends=True),
    ),
    (
        example(SERVER, "server_defer", "Deferring", "Executing goal", FEEDBACK, RESULT),
        example(CLIENT, "client", "Goal accepted", FEEDBACK, f"succeeded.*{RESULT}", ends=True),
    ),
    (
        example(
            SERVER,
            "server_queue_goals",
            "Executing goal",
            "put in the queue",
            "Next goal",
            "Executing goal",
            RESULT,
        ),
        example(CLIENT, "client", f"succeeded.*{RESULT}", ends=True),
        example(CLIENT, "client_not_composable", f"succeeded.*{RESULT}", ends=True, after="Executing goal"),
    ),
    (
        example(SERVER, "server_single_goal", "Executing goal", "Aborting previous", "Goal aborted", RESULT),
        example(CLIENT, "client", "failed with status: 6", ends=True),
        example(CLIENT, "client_not_composable", f"succeeded.*{RESULT}", ends=True, after="Executing goal"),
    ),
    (
        example("executors", "talker", *PUBLISHING),
        example("executors", "listener", *HEARD),
    ),
    (example("executors", "callback_group", *PUBLISHING, *HEARD),),
    (example("executors", "composed", *PUBLISHING, *HEARD),),
    (
        example("executors", "custom_executor", r"Publishing|I heard", *HEARD),
        command("topic pub --once -w 1 /estop std_msgs/msg/String '{data: stop}'"),
    ),
    (example("executors", "custom_callback_group", *PUBLISHING),),
    (
        example(
            "guard_conditions",
            "trigger_guard_condition",
            "waiting",
            "triggered guard",
            "finished",
            "waiting",
            "guard callback",
            "finished",
            ends=True,
        ),
    ),
)
