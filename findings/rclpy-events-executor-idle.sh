#!/usr/bin/env bash
# ros-rclpy 9.1.2 (ROS 2 Kilted), Python 3.11 on Linux x86-64, seen on 2026-11-28.
#
# A process has one node without timers, subscriptions or services of its own, and spins it in its main thread, once by
# `rclpy.experimental.EventsExecutor.spin()` and once by its `spin_once(timeout_sec=1.0)` in a loop, for 2 s each.
#
# Guess: it waits in both cases, and uses hardly any processor time.
# Seen: `spin_once` does; `spin` uses all of a core that it gets.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check ros-rclpy==9.1.2 \
    ros-rmw-fastrtps-cpp==9.3.3 ros-rmw-implementation==3.0.4 ros-std-msgs==5.5.1
ROS_LOG_DIR=$folder/log ROS_DOMAIN_ID=86 ROS_AUTOMATIC_DISCOVERY_RANGE=OFF "$folder/env/bin/python" - <<'PYTHON' || { echo "It is no longer so." >&2; exit 1; }
import subprocess
import sys

SPIN = """
import os, sys, threading, time
import rclpy
from rclpy.experimental import EventsExecutor

def end():
    time.sleep(2)
    print(time.process_time() - start, flush=True)
    os._exit(0)

rclpy.init()
executor = EventsExecutor()
executor.add_node(rclpy.create_node("idle"))
start = time.process_time()
threading.Thread(target=end).start()
if sys.argv[1] == "spin":
    executor.spin()
while True:
    executor.spin_once(timeout_sec=1.0)
"""
used = {}
for name in ("spin_once", "spin"):
    done = subprocess.run([sys.executable, "-c", SPIN, name], capture_output=True, text=True, timeout=60)
    used[name] = float(done.stdout)
print(", ".join(f"{name}: {each:.2f} s of 2 s" for name, each in used.items()))
sys.exit(used["spin"] < 0.2 or used["spin_once"] > 0.1)
PYTHON
