#!/usr/bin/env bash
# ros-rclpy 9.1.2 with ros-rmw-fastrtps-cpp 9.3.3 (ROS 2 Kilted, Fast DDS 3.2.3), Python 3.11 on Linux x86-64, seen on
# 2026-11-28.
#
# A client's participant has a lease of 3 s and announces itself each second; all else is the default. The process of
# the server is suspended (SIGSTOP) for 4.3 s, and goes on. Then the client calls. So it goes several times, each time
# with a new client in the same process, which calls once before the pause, and is destroyed afterwards.
#
# Guess: the server drops the client's participant when it goes on, as nothing has come for longer than the lease, and
#        finds it again with the next announcement: each call is answered, after a second or two at most.
# Seen: after the first pause it is so. After the second one, mostly, or a later one, the call is never answered: the
#       server no longer has the client's request writer in its graph, or not its response reader, and does not get
#       them back. For the client all is as before, service_is_ready() included, and each request is lost.
#       With Fast DDS's own lease of 20 s for both, such a pause changes nothing.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3.11 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet --disable-pip-version-check ros-rclpy==9.1.2 ros-std-srvs==5.5.1 \
    ros-rmw-fastrtps-cpp==9.3.3 ros-rmw-implementation==3.0.4
cat > "$folder/server.py" <<'PYTHON'
import threading

import rclpy
from std_srvs.srv import Trigger

rclpy.init()
node = rclpy.create_node("server")
node.create_service(Trigger, "/ask", lambda request, response: response)
threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
while True:
    input()
    writers = node.get_publishers_info_by_topic("rq/askRequest", no_mangle=True)
    readers = node.get_subscriptions_info_by_topic("rr/askReply", no_mangle=True)
    print(len(writers), len(readers), flush=True)
PYTHON
cat > "$folder/client.py" <<'PYTHON'
import os
import signal
import subprocess
import sys
import time

folder = sys.argv[1]
server = subprocess.Popen(
    [sys.executable, f"{folder}/server.py"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
)
with open(f"{folder}/profile.xml", "w") as file:
    file.write(
        '<profiles><participant profile_name="short" is_default_profile="true"><rtps>'
        "<builtin><discovery_config><leaseDuration><sec>3</sec></leaseDuration><leaseAnnouncement><sec>1</sec>"
        "</leaseAnnouncement></discovery_config></builtin></rtps></participant></profiles>"
    )
os.environ["FASTDDS_DEFAULT_PROFILES_FILE"] = file.name
import rclpy
from std_srvs.srv import Trigger

rclpy.init()
node = rclpy.create_node("client")


def is_answered(client):
    future = client.call_async(Trigger.Request())
    rclpy.spin_until_future_complete(node, future, timeout_sec=10)
    return future.done()


def seen_by_server():
    server.stdin.write("\n")
    server.stdin.flush()
    return server.stdout.readline().strip()


for number in range(1, 13):
    client = node.create_client(Trigger, "/ask")
    assert client.wait_for_service(30) and is_answered(client)
    print(f"round {number}: the server sees {seen_by_server()} (request writers, response readers)")
    server.send_signal(signal.SIGSTOP)
    time.sleep(4.3)
    server.send_signal(signal.SIGCONT)
    if not is_answered(client):
        print(f"no answer within 10 s; ready: {client.service_is_ready()}; the server sees {seen_by_server()}")
        break
    node.destroy_client(client)
else:
    sys.exit("each call was answered")
server.kill()
PYTHON
ROS_LOG_DIR=$folder/log ROS_DOMAIN_ID=87 ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST \
    "$folder/env/bin/python" "$folder/client.py" "$folder" 2> "$folder/errors" ||
    { cat "$folder/errors" >&2; echo "It is no longer so." >&2; exit 1; }
