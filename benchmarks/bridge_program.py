"""What `benchmarks/bridge.py` runs on ROS 2: sources, sinks, a relay, and nodes that only are there.

    build/ros2/bin/python benchmarks/bridge_program.py ROLE

Each line of stdin is a command with its arguments, as JSON, and gets an answer; a role ends with its input.
Payloads begin with the time in nanoseconds at which they were published.
"""

from __future__ import annotations

import json
import statistics
import struct
import sys
import threading
import time
from contextlib import suppress

import rclpy
from rclpy._rclpy_pybind11 import RCLError
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.serialization import serialize_message
from std_msgs.msg import UInt8MultiArray
from std_srvs.srv import SetBool

DEPTH = 10
HEAD = struct.Struct("<q")
HEAD_AT = 16
"""Where the data begins: behind the encapsulation, no dimensions, the offset and the length."""
POLL_SEC = 0.002
NODES = 50
TOPICS_PER_NODE = 3


class Source:
    """Publishes at a pace, and calls one after the other."""

    def __init__(self, node):
        self._node = node
        topics = ("to_relay", "to_callboard")
        self._publishers = {name: node.create_publisher(UInt8MultiArray, name, DEPTH) for name in topics}
        self._clients = {
            name: node.create_client(SetBool, name) for name in ("ros_answer", "callboard_answer")
        }
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)

    def load(self, topic, size, rate, seconds):
        """Publish so many messages a second; return how many."""
        publisher = self._publishers[topic]
        data = bytearray(serialize_message(UInt8MultiArray(data=bytes(size))))
        count, start = int(rate * seconds), time.perf_counter()
        for number in range(count):
            ahead = start + number / rate - time.perf_counter()
            if ahead > 0:
                time.sleep(ahead)
            HEAD.pack_into(data, HEAD_AT, time.monotonic_ns())
            publisher.publish(bytes(data))
        return {"sent": count, "seconds": time.perf_counter() - start}

    def calls(self, service, seconds):
        """Call, and spin until the response is there; return the median."""
        client = self._clients[service]
        client.wait_for_service(60)
        times, end = [], time.perf_counter() + seconds
        while (began := time.perf_counter()) < end:
            future = client.call_async(SetBool.Request(data=True))
            self._executor.spin_until_future_complete(future, 5)
            assert future.result().success
            times.append(time.perf_counter() - began)
        return {"calls": len(times), "p50_us": 1e6 * statistics.median(times)}

    def begin(self, name):
        """Start a node; return when."""
        now = time.monotonic()
        self._born = rclpy.create_node(name, start_parameter_services=False, enable_rosout=False)
        return now

    def end(self):
        """End the node; return when."""
        now = time.monotonic()
        self._born.destroy_node()
        return now


class Sink:
    """Receives, answers calls, and sees nodes."""

    def __init__(self, node):
        self._node = node
        self._delays = {}
        self._first = {}
        self._last = {}
        for name in ("relayed", "from_callboard"):
            node.create_subscription(UInt8MultiArray, name, self._receiver(name), DEPTH, raw=True)
        node.create_service(SetBool, "ros_answer", self._answer)
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        threading.Thread(target=self._spin, args=(executor,), daemon=True).start()

    @staticmethod
    def _spin(executor):
        with suppress(ExternalShutdownException):
            executor.spin()

    def _receiver(self, name):
        delays = self._delays[name] = []

        def receive(data):
            now = time.monotonic_ns()
            if not delays:
                self._first[name] = now
            self._last[name] = now
            delays.append(now - HEAD.unpack_from(data, HEAD_AT)[0])

        return receive

    @staticmethod
    def _answer(request, response):
        response.success = request.data
        return response

    def see(self, name, is_there):
        """Wait until a node is there, or is not; return when."""
        while (name in self._node.get_node_names()) != is_there:
            time.sleep(POLL_SEC)
        return time.monotonic()

    def forget(self, topic):
        """Forget what was received."""
        self._delays[topic].clear()

    def count(self, topic):
        """Return how many messages were received."""
        return len(self._delays[topic])

    def figures(self, topic):
        """Return how many messages were received, how fast, and the median of their times."""
        found = self._delays[topic]
        if len(found) < 2:
            return {"received": len(found), "rate": 0.0, "p50_us": 0.0}
        rate = 1e9 * (len(found) - 1) / (self._last[topic] - self._first[topic])
        return {"received": len(found), "rate": rate, "p50_us": statistics.median(found) / 1e3}


def relay(node):
    """Give bytes on, as short as a program for rclpy can be."""
    publisher = node.create_publisher(UInt8MultiArray, "relayed", DEPTH)

    def give_on(data):
        with suppress(RCLError):  # its reader is too slow, and it waits for 100 ms only
            publisher.publish(data)

    node.create_subscription(UInt8MultiArray, "to_relay", give_on, DEPTH, raw=True)
    rclpy.spin(node)


class Crowd:
    """Nodes whose endpoints do nothing."""

    def __init__(self, _):
        self._nodes = []
        for number in range(NODES):
            made = rclpy.create_node(f"idle_{number}", start_parameter_services=False, enable_rosout=False)
            for topic in range(TOPICS_PER_NODE):
                made.create_publisher(UInt8MultiArray, f"idle/p{number}/t{topic}", DEPTH)
                made.create_subscription(UInt8MultiArray, f"idle/s{number}/t{topic}", lambda _: None, DEPTH)
            self._nodes.append(made)

    def endpoints(self):
        """Return how many endpoints the nodes have, without what each has anyway."""
        return NODES * TOPICS_PER_NODE * 2


def main(role):
    """Run a role until the input ends."""
    with suppress(ExternalShutdownException), rclpy.init():
        node = rclpy.create_node(f"bench_{role}")
        if role == "relay":
            threading.Thread(target=lambda: (sys.stdin.read(), rclpy.try_shutdown()), daemon=True).start()
            relay(node)
            return
        made = {"source": Source, "sink": Sink, "crowd": Crowd}[role](node)
        for line in sys.stdin:
            command, *arguments = json.loads(line)
            print(json.dumps(getattr(made, command)(*arguments)), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
