#!/usr/bin/env bash
# ros-rclpy 9.1.2 with ros-rmw-fastrtps-cpp 9.3.3 and ros-rmw-dds-common (ROS 2 Kilted), Python 3.11 on Linux x86-64, seen
# on 2026-11-28.
#
# A process has two nodes of one name, which ROS 2 allows with a warning; each has a publisher. One node is destroyed.
#
# Guess: the other node and its publisher stay as they were; if endpoints of equal names are mixed up at all, then only
#        those of the node that was made first.
# Seen: whichever of the two is destroyed, the graph of other processes still shows one node of the name, but no longer
#       whose publisher the other one is: its node's name becomes _NODE_NAME_UNKNOWN_ and stays so. A publisher that the
#       node makes afterwards is shown as its own again.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check ros-rclpy==9.1.2 \
    ros-rmw-fastrtps-cpp==9.3.3 ros-rmw-implementation==3.0.4 ros-std-msgs==5.5.1
cat > "$folder/twins.py" <<'PYTHON'
import sys

import rclpy
from std_msgs.msg import String

rclpy.init()
nodes = [rclpy.create_node("twin") for _ in range(2)]
kept = [node.create_publisher(String, f"/topic_{i}", 10) for i, node in enumerate(nodes)]
gone = int(sys.argv[1])
sys.stdin.readline()
nodes[gone].destroy_node()
sys.stdin.readline()
nodes[1 - gone].create_publisher(String, "/topic_2", 10)
sys.stdin.readline()
PYTHON
cat > "$folder/watch.py" <<'PYTHON'
import subprocess
import sys
import time

import rclpy

UNKNOWN = "_NODE_NAME_UNKNOWN_"


def owners():
    """Return the names of nodes, and to which node the publisher of each topic belongs."""
    names = sorted(name for name in watcher.get_node_names() if name != "watcher")
    topics = [watcher.get_publishers_info_by_topic(f"/topic_{i}") for i in range(3)]
    return names, [[info.node_name for info in infos] for infos in topics]


def is_soon(*expected):
    """Wait until the graph is as expected, and a second longer."""
    until = time.monotonic() + 20
    while owners() != expected and time.monotonic() < until:
        time.sleep(0.05)
    time.sleep(1)
    print(owners())
    return owners() == expected


rclpy.init()
watcher = rclpy.create_node("watcher")
is_as_seen = True
for gone in (0, 1):
    twins = subprocess.Popen([sys.executable, sys.argv[1], str(gone)], stdin=subprocess.PIPE, text=True)
    others = [[], [UNKNOWN]] if gone == 0 else [[UNKNOWN], []]
    for expected in (
        (["twin", "twin"], [["twin"], ["twin"], []]),
        (["twin"], [*others, []]),
        (["twin"], [*others, ["twin"]]),
    ):
        is_as_seen &= is_soon(*expected)
        twins.stdin.write("\n")
        twins.stdin.flush()
    twins.wait()
    is_soon([], [[], [], []])
sys.exit(not is_as_seen)
PYTHON
ROS_LOG_DIR=$folder/log ROS_DOMAIN_ID=88 ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST \
    "$folder/env/bin/python" "$folder/watch.py" "$folder/twins.py" 2> "$folder/errors" ||
    { cat "$folder/errors" >&2; echo "It is no longer so." >&2; exit 1; }
