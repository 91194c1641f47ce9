#!/usr/bin/env bash
# ros-rclpy 9.1.2 with ros-action-msgs as it requires (ROS 2 Kilted), Python 3.11 on Linux x86-64, seen on 2026-11-28.
#
# An action server's cancel callback answers REJECT for the only goal that runs. The comments of action_msgs/srv/CancelGoal
# say that ERROR_NONE means that goals are being cancelled, and that ERROR_REJECTED means that none is.
#
# Guess: the answer's return_code is ERROR_REJECTED (1).
# Seen: it is ERROR_NONE (0), as for a goal whose cancellation is accepted; only `goals_canceling` is empty.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check ros-rclpy==9.1.2 ros-test-msgs==2.3.0 \
    ros-rmw-fastrtps-cpp==9.3.3 ros-rmw-implementation==3.0.4 ros-std-msgs==5.5.1
ROS_LOG_DIR=$folder/log ROS_DOMAIN_ID=86 ROS_AUTOMATIC_DISCOVERY_RANGE=OFF "$folder/env/bin/python" - <<'PYTHON' || { echo "It is no longer so." >&2; exit 1; }
import sys
import threading

import rclpy
from action_msgs.srv import CancelGoal
from rclpy.action import ActionClient, ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from test_msgs.action import Fibonacci


def cancel_with(verdict):
    """Return the code and the number of goals of the answer if the cancel callback answers so."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node, group, ended = Node("n", context=context), ReentrantCallbackGroup(), threading.Event()

    def execute(goal):
        ended.wait(60)
        goal.canceled() if goal.is_cancel_requested else goal.succeed()
        return Fibonacci.Result()

    ActionServer(node, Fibonacci, "fib", execute, callback_group=group, cancel_callback=lambda goal: verdict)
    client = ActionClient(node, Fibonacci, "fib", callback_group=group)
    executor = MultiThreadedExecutor(4, context=context)
    executor.add_node(node)

    def wait(future):
        executor.spin_until_future_complete(future, 30)
        return future.result()

    assert client.wait_for_server(30)
    goal = wait(client.send_goal_async(Fibonacci.Goal(order=1)))
    answer = wait(goal.cancel_goal_async())
    ended.set()
    wait(goal.get_result_async())
    executor.shutdown()
    context.shutdown()
    return answer.return_code, len(answer.goals_canceling)


accepted, rejected = cancel_with(CancelResponse.ACCEPT), cancel_with(CancelResponse.REJECT)
print(f"accepted: {accepted}, rejected: {rejected}, ERROR_REJECTED is {CancelGoal.Response.ERROR_REJECTED}")
sys.exit((accepted, rejected) != ((0, 1), (0, 0)))
PYTHON
