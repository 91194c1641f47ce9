#!/usr/bin/env bash
# ros-rclpy 9.1.2 (ROS 2 Kilted), Python 3.11 on Linux x86-64, seen on 2026-11-28.
#
# A callback is running in a MultiThreadedExecutor, and `executor.shutdown(timeout_sec=0.2, wait_for_threads=False)` is called
# meanwhile. Its documentation: it waits for callbacks to finish, for at most timeout_sec, and returns whether they have.
#
# Guess: it returns False after 0.2 s, as the callback still runs.
# Seen: it returns True at once, while the callback runs on.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check ros-rclpy==9.1.2 \
    ros-rmw-fastrtps-cpp==9.3.3 ros-rmw-implementation==3.0.4
ROS_LOG_DIR=$folder/log ROS_DOMAIN_ID=87 ROS_AUTOMATIC_DISCOVERY_RANGE=OFF "$folder/env/bin/python" - <<'PYTHON' || { echo "It is no longer so." >&2; exit 1; }
import sys
import threading
import time

import rclpy
from rclpy.executors import MultiThreadedExecutor

rclpy.init()
node = rclpy.create_node("busy")
running, end, ended = threading.Event(), threading.Event(), threading.Event()


def callback():
    running.set()
    end.wait(10.0)
    ended.set()


guard = node.create_guard_condition(callback)
executor = MultiThreadedExecutor(num_threads=2)
executor.add_node(node)
spinning = threading.Thread(target=executor.spin_once, daemon=True)
spinning.start()
guard.trigger()
assert running.wait(10.0)
begin = time.monotonic()
answer = executor.shutdown(timeout_sec=0.2, wait_for_threads=False)
seconds, over = time.monotonic() - begin, ended.is_set()
end.set()
spinning.join(10.0)
print(f"{answer} after {seconds:.3f} s, callback over: {over}")
sys.exit(not answer or seconds > 0.1 or over)
PYTHON
