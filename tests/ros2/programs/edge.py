"""The edge of a bridge in this process: what tests let it show, and what has arrived there.

Entities have numbers, and messages are CDR as hexadecimal digits. The loop runs only while a function waits,
so that what arrives between two questions is taken by the next one.
"""

from __future__ import annotations

import asyncio
import itertools
import resource
import time
from pathlib import Path

from rclpy.serialization import deserialize_message, serialize_message

from actors.bridges.ros2.arrivals import Arrivals
from actors.bridges.ros2.importing import import_ros
from actors.bridges.ros2.observer import Observer
from actors.bridges.ros2.participant import Participant
from actors.bridges.ros2.services import SERVICE_QOS
from actors.qos.profile import QoSProfile
from tests.real_ros.programs.serialization import find_class

POLL_SEC = 0.02
_made = {}
_numbers = itertools.count(1)
_errors = []
_edge = None


class _Edge:
    """One participant and its loop."""

    def __init__(self, bridge_id):
        self.ros = import_ros()
        self.loop = asyncio.new_event_loop()
        self.participant = Participant(
            self.ros, bridge_id=bridge_id, arrivals=Arrivals(self.ros, self.loop, _errors.append)
        )
        self.observer = Observer(self.ros, self.participant)

    def until(self, condition, seconds):
        """Run the loop until a condition holds."""
        self.loop.run_until_complete(self._until(condition, seconds))

    async def _until(self, condition, seconds):
        end = time.monotonic() + seconds
        while not condition() and time.monotonic() < end:
            await asyncio.sleep(POLL_SEC)


def start(bridge_id):
    """Start; return what it found."""
    global _edge  # noqa: PLW0603 - the process has one
    _edge = _Edge(bridge_id)
    ros = _edge.ros
    return {"distribution": ros.distribution, "rmw": ros.rmw, "has_own_profile": ros.has_own_profile}


def _keep(entity):
    number = next(_numbers)
    _made[number] = entity
    return number


def _class(type_name):
    """Return rclpy's class; "pkg/action/Fibonacci.SendGoalService" is one of an action's."""
    name, _, part = type_name.partition(".")
    found = find_class(name)
    return getattr(found.Impl, part) if part else found


def _profile(qos):
    return QoSProfile.from_wire(qos)


def _until(condition, seconds):
    _edge.until(condition, seconds)
    return condition()


def mirror(name):
    """Show a node; return its number."""
    return _keep(_edge.participant.mirror_node(name))


def publisher(node, topic, type_name, qos):
    """Show a publisher; return its number."""
    return _keep(_made[node].create_publisher(_class(type_name), topic, _profile(qos)))


def publish(number, messages):
    """Publish messages."""
    for each in messages:
        _made[number].publish(bytes.fromhex(each))


class _Subscription:
    def __init__(self, node, topic, cls, qos, is_listening):
        self.received = []
        self.turns = []
        self._turn = 0
        callback = self._arrived if is_listening else None
        self.entity = node.create_subscription(cls, topic, qos, callback)

    def listen(self):
        self.entity.listen(self._arrived)

    def _arrived(self, cdr, info):
        if not self.turns or self.turns[-1][0] != self._turn:
            self.turns.append([self._turn, 0])
            _edge.loop.call_soon(self._next_turn)
        self.turns[-1][1] += 1
        self.received.append([cdr.hex(), info.gid.hex(), info.sequence, info.source_ns])
        if cdr.find(b"raise") >= 0:
            raise ValueError("as the test wanted")

    def _next_turn(self):
        self._turn += 1


def subscription(node, topic, type_name, qos, is_listening=True):
    """Show a subscription; return its number."""
    return _keep(_Subscription(_made[node], topic, _class(type_name), _profile(qos), is_listening))


def listen(number):
    """Let a subscription take messages."""
    _made[number].listen()


def received(number, count, seconds):
    """Wait for so many messages; return all: CDR, gid, sequence number, source stamp."""
    _until(lambda: len(_made[number].received) >= count, seconds)
    return _made[number].received


def turns(number):
    """Return how many messages a subscription has taken in each turn of the loop."""
    return [count for _, count in _made[number].turns]


def matched(number, count, seconds):
    """Wait until a publisher or subscription has so many others; return how many it has."""
    entity = _made[number]
    is_subscription = isinstance(entity, _Subscription)
    ask = entity.entity.publisher_count if is_subscription else entity.subscription_count
    _until(lambda: ask() == count, seconds)
    return ask()


class _Service:
    """Keeps requests until the test answers them."""

    def __init__(self, node, name, cls):
        self.cls = cls
        self.waiting = []
        self.entity = node.create_service(
            cls, name, lambda *asked: self.waiting.append(asked), qos=SERVICE_QOS
        )


def service(node, name, type_name):
    """Show a service; return its number."""
    return _keep(_Service(_made[node], name, _class(type_name)))


def memory_of_services(node, count):
    """Show many services; return how much memory each has taken, in KiB."""
    numbers = [service(node, f"/memory/s{number}", "std_srvs/srv/Trigger") for number in range(count)]
    before = _memory_kib()
    numbers += [service(node, f"/memory/t{number}", "std_srvs/srv/Trigger") for number in range(count)]
    used = _memory_kib() - before
    for number in numbers:
        destroy(number)
    return used / count


def _memory_kib():
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() / 1024


def requests(number, count, seconds):
    """Wait for so many requests; return them."""
    waiting = _made[number].waiting
    _until(lambda: len(waiting) >= count, seconds)
    return [_bytes_of(request) for request, _ in waiting]


def respond(number, place, response):
    """Answer a request with a response."""
    found = _made[number]
    found.entity.respond(_message(found.cls.Response, response), found.waiting[place][1])


class _Client:
    def __init__(self, node, name, cls):
        self.cls = cls
        self.responses = {}
        self.entity = node.create_client(cls, name, self.responses.__setitem__)


def client(node, name, type_name):
    """Show a client; return its number."""
    return _keep(_Client(_made[node], name, _class(type_name)))


def call(number, request, seconds):
    """Wait for a server, send a request and return the response."""
    found = _made[number]
    if not _until(found.entity.is_ready, seconds):
        return "no server"
    sequence = found.entity.send(_message(found.cls.Request, request))
    _until(lambda: sequence in found.responses, seconds)
    return _bytes_of(found.responses[sequence])


def _bytes_of(message):
    return bytes(serialize_message(message)).hex()


def _message(cls, data):
    return deserialize_message(bytes.fromhex(data), cls)


def errors(count, seconds):
    """Wait for so many exceptions of callbacks; return their texts, and forget them."""
    _until(lambda: len(_errors) >= count, seconds)
    texts = [str(each) for each in _errors]
    _errors.clear()
    return texts


def use_up_files():
    """Lower the limit of open files to what is open; return the former one."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(
        resource.RLIMIT_NOFILE, (max(int(each.name) for each in Path("/proc/self/fd").iterdir()), hard)
    )
    return soft


def allow_files(limit):
    """Raise the limit of open files."""
    resource.setrlimit(resource.RLIMIT_NOFILE, (limit, resource.getrlimit(resource.RLIMIT_NOFILE)[1]))


def destroy(number):
    """End a node or an endpoint."""
    entity = _made.pop(number)
    getattr(entity, "entity", entity).destroy()


def _poll():
    return _edge.observer.poll(time.monotonic())


def graph(nodes, endpoints, absent, seconds):
    """Wait until ROS's graph has nodes and endpoints, and not others; return it.

    Args:
        nodes: Pairs of name and origin.
        endpoints: Lists of node, kind and name.
        absent: Such lists, or lists of a node's name alone.
        seconds: The longest wait.
    """

    def found():
        graph = _poll()
        return [[*each[:2]] for each in graph.nodes], [
            [each.node, each.kind.name.lower(), each.name] for each in graph.endpoints
        ]

    def fits():
        names, there = found()
        has = all(each in names for each in nodes) and all(each in there for each in endpoints)
        return has and not any(each in there or each in [[name] for name, _ in names] for each in absent)

    _until(fits, seconds)
    return found()


def infos(topic, count, seconds):
    """Wait for so many endpoints of a topic or service; return node, type, hash and QoS of each."""

    def found():
        return sorted(
            [each.node, each.type_name, each.type_hash, dict(each.qos.to_wire()) if each.qos else None]
            for each in _poll().endpoints
            if each.name == topic
        )

    _until(lambda: len(found()) == count, seconds)
    return found()


def durability(topic, wanted, seconds):
    """Wait until the one publisher of a topic has a durability; return that it has."""
    return _until(
        lambda: [each.qos.durability.name for each in _poll().endpoints if each.name == topic] == [wanted],
        seconds,
    )


def is_same_graph():
    """Return whether the graph is the same object as long as nothing happens."""
    return _until(lambda: all(_poll() is _poll() for _ in range(3)), 1.0)


def node_of(topic, gid):
    """Return the node that has a publisher."""
    return _edge.observer.node_of(topic, bytes.fromhex(gid))


def request_hash(name):
    """Return the hash of a service's requests."""
    return _edge.observer.request_hash(name)


def destroy_all():
    """End all that is shown."""
    for node in [each for each in _made.values() if hasattr(each, "rclpy_node")]:
        node.destroy()
    _made.clear()
    _errors.clear()
