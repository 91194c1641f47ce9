"""A stand-in for ROS 2 in this process: rclpy's objects as far as the edge of a bridge uses them.

tests/ros2 shows the same with real ROS 2; this one needs no other interpreter, and its graph is what a test
says.
"""

from __future__ import annotations

import itertools
import os
from collections import deque
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

from actors.bridges.ros2.importing import ARRIVAL_FUNCTIONS, Ros
from actors.bridges.ros2.message_taker import RosMessageInfo
from actors.qos import profile as qos
from actors.time.types import Duration
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import Self

OWN = b"\x01" * 12
"""What gids of the bridge begin with."""
OTHER = b"\x02" * 12
"""Those of other participants."""
QOS = qos.QoSProfile(history=qos.HistoryPolicy.UNKNOWN, depth=0)


class InvalidHandle(Exception):  # noqa: N818 - rclpy's name
    """An object has been destroyed."""


class NodeNameNonExistentError(RuntimeError):
    """The graph does not have a node."""


class NameValidationException(Exception):  # noqa: N818 - rclpy's name
    """A name is not valid."""


class ServiceClass:
    """rclpy's class of a service."""

    Request = "request"
    Response = "response"

    def __str__(self) -> str:
        return "std_srvs/srv/SetBool"


SERVICE_CLASS: Any = ServiceClass()


@dataclass(eq=False)
class Shown:
    """An endpoint in the graph; a service is the topic of its requests there."""

    kind: EntryKind
    name: str
    type_name: str
    node: str
    gid: bytes
    qos: Any = QOS
    type_hash: str = "RIHS01_1"

    @property
    def topic_kind(self) -> EntryKind:
        """What it is on its topic."""
        return {EntryKind.SERVICE: EntryKind.SUBSCRIPTION, EntryKind.CLIENT: EntryKind.PUBLISHER}.get(
            self.kind, self.kind
        )

    @property
    def topic(self) -> str:
        """The name of its topic, as ROS 2 and DDS have it."""
        return f"rq{self.name}Request" if self.topic_kind != self.kind else self.name

    @property
    def topic_type(self) -> str:
        """The type of its topic."""
        if self.topic_kind is self.kind:
            return self.type_name
        package, kind, name = self.type_name.split("/")
        return f"{package}::{kind}::dds_::{name}_Request_"


@dataclass
class Network:
    """All that there is in ROS 2.

    Attributes:
        nodes: Full name and enclave of each.
        endpoints: Those of all nodes.
        has_changed: Whether the guard condition is set.
        queues: What has arrived at endpoints, by their pointers.
        published: Messages, requests and responses that the bridge has sent.
        reads: How often the graph was asked for something.
        refuses: What creating an endpoint raises.
        refusing_node: The node where it does; "" for all.
        pointers: Of the bridge's latest endpoints, by kind and name.
        is_silent: Whether it says nothing of what has arrived before a callback is set.
    """

    nodes: list[tuple[str, str]] = field(default_factory=list[tuple[str, str]])
    endpoints: list[Shown] = field(default_factory=list[Shown])
    has_changed: bool = False
    queues: dict[int, deque[Any]] = field(default_factory=dict[int, Any])
    published: list[Any] = field(default_factory=list[Any])
    reads: int = 0
    refuses: Exception | None = None
    refusing_node: str = ""
    pointers: dict[tuple[EntryKind, str], int] = field(default_factory=dict[tuple[EntryKind, str], int])
    is_silent: bool = False
    eventfds: dict[int, int] = field(default_factory=dict[int, int])
    numbers: Iterator[int] = field(default_factory=lambda: itertools.count(1))

    def show(self, node: str, *endpoints: tuple[EntryKind, str, str], prefix: bytes = OTHER) -> list[Shown]:
        """Show a native node with endpoints, by kind, name and type."""
        if (node, "/") not in self.nodes:
            self.nodes.append((node, "/"))
        made = [Shown(*each, node, prefix + next(self.numbers).to_bytes(4)) for each in endpoints]
        self.endpoints += made
        self.has_changed = True
        return made

    def leave(self, node: str) -> None:
        """Let a native node go, with its endpoints."""
        self.nodes.remove((node, "/"))
        self.endpoints = [each for each in self.endpoints if each.node != node]
        self.has_changed = True

    def arrive(self, pointer: int, item: Any) -> None:
        """Let something arrive at an endpoint."""
        self.queues[pointer].append(item)
        self.wake(pointer)

    def wake(self, pointer: int) -> None:
        """Write to the eventfd of an endpoint where something has arrived."""
        if self.queues[pointer] and pointer in self.eventfds:
            os.eventfd_write(self.eventfds[pointer], len(self.queues[pointer]))

    def take(self, pointer: int) -> Any:
        """Take what has arrived; None if nothing has."""
        queue = self.queues[pointer]
        if queue and isinstance(queue[0], Exception):
            raise queue.popleft()
        return queue.popleft() if queue else None

    def set_arrival(self, pointer: int, function: int | None, fd: int | None) -> int:
        """Be librcl's functions for arrivals."""
        if function is None or fd is None:
            self.eventfds.pop(pointer, None)
        else:
            self.eventfds[pointer] = fd
            if not self.is_silent:
                self.wake(pointer)
        return 0


class Handle:
    """rclpy's handle of an endpoint."""

    def __init__(self, network: Network) -> None:
        self.network = network
        self.pointer = next(network.numbers)
        self.is_destroyed = False
        network.queues[self.pointer] = deque()

    def __enter__(self) -> Self:
        if self.is_destroyed:
            raise InvalidHandle("it has been destroyed")
        return self

    def __exit__(self, *_: object) -> None: ...

    def publish_raw(self, cdr: bytes) -> None:
        self.network.published.append(cdr)

    def get_publisher_count(self) -> int:
        return 1

    def service_server_is_available(self) -> bool:
        return True

    def send_request(self, request: Any) -> int:
        if isinstance(request, Exception):
            raise request
        self.network.published.append(request)
        return len(self.network.published)

    def service_send_response(self, response: Any, request_id: Any) -> None:
        self.network.published.append((response, request_id))

    def take_response(self, cls: Any) -> tuple[Any, Any]:
        return self.network.take(self.pointer) or (None, cls)

    def service_take_request(self, cls: Any) -> tuple[Any, Any]:
        return self.network.take(self.pointer) or (cls, None)


class FakeNode:
    """rclpy's node."""

    def __init__(self, network: Network, name: str, namespace: str, enclave: str) -> None:
        if not name.isidentifier():
            raise NameValidationException(f"Invalid node name:\n  {name}\n  ^")
        self.full_name = f"{namespace.rstrip('/')}/{name}"
        self.handle = Handle(network)
        self._network = network
        self._enclave = enclave
        network.nodes.append((self.full_name, enclave))
        self._show(EntryKind.PUBLISHER, "/parameter_events", "rcl_interfaces/msg/ParameterEvent", QOS)

    def _show(self, kind: EntryKind, name: str, cls: Any, profile: Any) -> Any:
        network = self._network
        if network.refuses and network.refusing_node in {"", self.full_name}:
            raise network.refuses
        shown = Shown(kind, name, str(cls), self.full_name, OWN + next(network.numbers).to_bytes(4), profile)
        network.endpoints.append(shown)
        network.has_changed = True
        handle = Handle(network)
        network.pointers[kind, name] = handle.pointer
        return SimpleNamespace(handle=handle, shown=shown, get_subscription_count=lambda: 2)

    def create_publisher(self, cls: Any, topic: str, profile: Any, **_: Any) -> Any:
        return self._show(EntryKind.PUBLISHER, topic, cls, profile)

    def create_subscription(self, cls: Any, topic: str, callback: Any, profile: Any, **_: Any) -> Any:
        callback()
        return self._show(EntryKind.SUBSCRIPTION, topic, cls, profile)

    def create_client(self, cls: Any, name: str, *, qos_profile: Any, **_: Any) -> Any:
        return self._show(EntryKind.CLIENT, name, cls, qos_profile)

    def create_service(self, cls: Any, name: str, callback: Any, *, qos_profile: Any, **_: Any) -> Any:
        callback()
        return self._show(EntryKind.SERVICE, name, cls, qos_profile)

    def _destroy(self, endpoint: Any) -> None:
        endpoint.handle.is_destroyed = True
        self._network.endpoints.remove(endpoint.shown)
        self._network.has_changed = True

    destroy_publisher = destroy_subscription = destroy_client = destroy_service = _destroy

    def destroy_node(self) -> None:
        self._network.nodes.remove((self.full_name, self._enclave))
        self.handle.is_destroyed = True
        self._network.has_changed = True

    def get_name(self) -> str:
        return self.full_name.rpartition("/")[2]

    def get_node_names_and_namespaces_with_enclaves(self) -> list[tuple[str, str, str]]:
        self._network.reads += 1
        return [(*_split(name), enclave) for name, enclave in self._network.nodes]

    def _by_node(self, kind: EntryKind, name: str, namespace: str) -> list[tuple[str, list[str]]]:
        full = f"{namespace.rstrip('/')}/{name}"
        if full not in [each for each, _ in self._network.nodes]:
            raise NodeNameNonExistentError(full)
        found: dict[str, list[str]] = {}
        for each in self._network.endpoints:
            if each.node == full and each.kind is kind:
                found.setdefault(each.name, []).append(each.type_name)
        return list(found.items())

    def get_publisher_names_and_types_by_node(self, name: str, namespace: str) -> Any:
        return self._by_node(EntryKind.PUBLISHER, name, namespace)

    def get_subscriber_names_and_types_by_node(self, name: str, namespace: str) -> Any:
        return self._by_node(EntryKind.SUBSCRIPTION, name, namespace)

    def get_service_names_and_types_by_node(self, name: str, namespace: str) -> Any:
        return self._by_node(EntryKind.SERVICE, name, namespace)

    def get_client_names_and_types_by_node(self, name: str, namespace: str) -> Any:
        return self._by_node(EntryKind.CLIENT, name, namespace)

    def _infos(self, kind: EntryKind, topic: str) -> list[Any]:
        self._network.reads += 1
        return [
            SimpleNamespace(
                node_name=_split(each.node)[0],
                node_namespace=_split(each.node)[1],
                topic_type=each.topic_type,
                topic_type_hash=each.type_hash,
                endpoint_gid=[*each.gid],
                qos_profile=each.qos,
            )
            for each in self._network.endpoints
            if each.topic_kind is kind and each.topic == topic
        ]

    def get_publishers_info_by_topic(self, topic: str, *, no_mangle: bool = False) -> list[Any]:
        del no_mangle
        return self._infos(EntryKind.PUBLISHER, topic)

    def get_subscriptions_info_by_topic(self, topic: str, *, no_mangle: bool = False) -> list[Any]:
        del no_mangle
        return self._infos(EntryKind.SUBSCRIPTION, topic)

    def get_topic_names_and_types(self) -> list[tuple[str, list[str]]]:
        found = {each.name for each in self._network.endpoints if each.topic_kind is each.kind}
        return [(name, []) for name in sorted(found)]

    def get_service_names_and_types(self) -> list[tuple[str, list[str]]]:
        found = {each.name for each in self._network.endpoints if each.topic_kind is not each.kind}
        return [(name, []) for name in sorted(found)]

    def count_services(self, name: str) -> int:
        """Count the servers."""
        return sum(each.kind is EntryKind.SERVICE and each.name == name for each in self._network.endpoints)


def _split(full_name: str) -> tuple[str, str]:
    namespace, _, name = full_name.rpartition("/")
    return name, namespace or "/"


class Context:
    """rclpy's context."""

    def __init__(self) -> None:
        self.handle = Handle(Network())
        self.domain_id = 0
        self.enclave = ""

    def get_domain_id(self) -> int:
        return self.domain_id

    def try_shutdown(self) -> None: ...


class WaitSet(Handle):
    """A wait set whose guard condition is the network's."""

    def clear_entities(self) -> None: ...

    def wait(self, timeout: int) -> None:
        assert timeout == 0

    def is_ready(self, kind: str, index: int) -> bool:
        assert (kind, index) == ("guard_condition", 0)
        found, self.network.has_changed = self.network.has_changed, False
        return found


def make_ros(network: Network, *, has_own_profile: bool = False) -> Ros:
    """Return ROS 2 with this network."""

    def init(*, args: list[str], context: Context, domain_id: int | None, **_: Any) -> None:
        if domain_id is not None and domain_id < 0:
            raise RuntimeError("the domain is negative")
        context.domain_id = domain_id or 0
        context.enclave = args[args.index("--enclave") + 1]

    def create_node(name: str, *, namespace: str, context: Context, **_: Any) -> FakeNode:
        return FakeNode(network, name, namespace, context.enclave)

    def ignore(*_: Any, **__: Any) -> None: ...

    names = ("QoSProfile", "HistoryPolicy", "ReliabilityPolicy", "DurabilityPolicy", "LivelinessPolicy")
    rclpy = SimpleNamespace(
        init=init,
        create_node=create_node,
        context=SimpleNamespace(Context=Context),
        signals=SimpleNamespace(SignalHandlerOptions=SimpleNamespace(NO=0)),
        parameter=SimpleNamespace(Parameter=ignore),
        event_handler=SimpleNamespace(PublisherEventCallbacks=ignore, SubscriptionEventCallbacks=ignore),
        callback_groups=SimpleNamespace(MutuallyExclusiveCallbackGroup=ignore),
        exceptions=SimpleNamespace(NameValidationException=NameValidationException),
        duration=SimpleNamespace(Duration=Duration),
        qos=SimpleNamespace(
            **{name: getattr(qos, name) for name in names},
            qos_profile_services_default=qos.QoSProfile(depth=10),
        ),
    )
    implementation = SimpleNamespace(
        InvalidHandle=InvalidHandle,
        NodeNameNonExistentError=NodeNameNonExistentError,
        WaitSet=lambda *_: WaitSet(network),
    )
    rcl = SimpleNamespace(
        **dict.fromkeys(ARRIVAL_FUNCTIONS, network.set_arrival),
        rcl_node_get_graph_guard_condition=lambda _: 1,
        rcl_wait_set_add_guard_condition=lambda *_: 0,
    )
    return Ros(
        rclpy=rclpy,
        implementation=implementation,
        rcl=rcl,
        taker=network,  # type: ignore[arg-type] # all that is used of it is `take`
        eventfd_write=1,
        distribution="wheels",
        rmw="rmw_fastrtps_cpp",
        has_own_profile=has_own_profile,
    )


def message(number: int) -> tuple[bytes, RosMessageInfo]:
    """Return a message and what ROS 2 says about it."""
    return b"%d" % number, RosMessageInfo(OTHER + bytes(4), number, number, number)
