"""A participant of ROS 2: one context of rclpy with the nodes that a bridge shows there.

Nothing here spins: what has arrived at an endpoint is taken when `arrivals.py` says so.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from actors.bridges.options import LEASE_SEC
from actors.bridges.ros2.endpoints import (
    NodeContext,
    RosClient,
    RosPublisher,
    RosService,
    RosSubscription,
    ros_errors,
)
from actors.bridges.ros2.errors import RosError
from actors.bridges.ros2.qos import to_ros

if TYPE_CHECKING:
    from collections.abc import Callable

    from actors.bridges.ros2.arrivals import Arrivals
    from actors.bridges.ros2.importing import Ros
    from actors.bridges.ros2.message_taker import RosMessageInfo
    from actors.qos.profile import QoSProfile

ENCLAVE: Final = "/callboard_bridge/"
"""The beginning of bridges' enclaves, by which each bridge recognises the nodes that any bridge shows."""
CONTROL_NODE: Final = "callboard_bridge_"
"""The beginning of the name of a bridge's own node; the bridge's ID follows."""
GID_PREFIX_SIZE: Final = 12
"""Bytes of a DDS gid that identify the participant."""


class Participant:
    """What a bridge shows in ROS 2.

    Args:
        ros: ROS 2.
        bridge_id: Identifies the bridge; a token of a ROS name.
        arrivals: Waits for messages, requests and responses.
        domain_id: The domain; None for ROS_DOMAIN_ID.
        lease_sec: How long other processes show it after its process was killed, unless the user has a
            profile for Fast DDS.

    Attributes:
        domain_id: The domain.
        bridge_id: As given.
        control: The bridge's own node.

    Raises:
        RosError: ROS 2 refuses.
    """

    def __init__(
        self,
        ros: Ros,
        *,
        bridge_id: str,
        arrivals: Arrivals,
        domain_id: int | None = None,
        lease_sec: int = LEASE_SEC,
    ) -> None:
        self._ros = ros
        self._arrivals = arrivals
        self._nodes: set[RosNode] = set()
        self.bridge_id = bridge_id
        self.context: Any = ros.rclpy.context.Context()
        # Its own log goes to stderr only: a bridge has callboard's log.
        options = ["--enclave", ENCLAVE + bridge_id, "--disable-rosout-logs", "--disable-external-lib-logs"]
        with ros_errors(ros, "ROS 2 cannot start"):
            ros.rclpy.init(
                args=["--ros-args", *options],
                context=self.context,
                domain_id=domain_id,
                signal_handler_options=ros.rclpy.signals.SignalHandlerOptions.NO,
            )
        self.domain_id: int = self.context.get_domain_id()
        try:
            with ros.profile(lease_sec):  # the first node makes the participant of DDS
                self.control = self.mirror_node(f"/{CONTROL_NODE}{bridge_id}")
            self._gid_prefix = self._find_gid_prefix()
        except RosError:
            self.close()
            raise

    def is_own(self, gid: bytes) -> bool:
        """Return whether an endpoint belongs to this participant."""
        return gid.startswith(self._gid_prefix)

    def mirror_node(self, name: str) -> RosNode:
        """Show a node, with a publisher of /parameter_events and nothing else.

        Args:
            name: Its full name.

        Raises:
            RosError: ROS 2 refuses the name.
        """
        node = RosNode(self._ros, self._arrivals, self.context, name, self._nodes)
        self._nodes.add(node)
        return node

    def close(self) -> None:
        """Destroy all nodes with their endpoints, and the context."""
        for node in list(self._nodes):
            node.destroy()
        self.context.try_shutdown()

    def _find_gid_prefix(self) -> bytes:
        """Return what the gids of this participant begin with, from an endpoint that each node has."""
        name = self.control.rclpy_node.get_name()
        for info in self.control.rclpy_node.get_publishers_info_by_topic("/parameter_events"):
            if info.node_name == name:
                return bytes(info.endpoint_gid)[:GID_PREFIX_SIZE]
        raise RosError("ROS 2 does not list the bridge's own node")


class RosNode:
    """A node that a bridge shows in ROS 2; `Participant.mirror_node` makes it.

    Attributes:
        name: Its full name.
        rclpy_node: rclpy's node.
    """

    def __init__(self, ros: Ros, arrivals: Arrivals, context: Any, name: str, siblings: set[RosNode]) -> None:
        self._ros = ros
        self._siblings = siblings
        self.name = name
        namespace, _, base = name.rpartition("/")
        no_service = ros.rclpy.parameter.Parameter("start_type_description_service", value=False)
        with ros_errors(ros, f"ROS 2 refuses the node '{name}'"):
            self.rclpy_node: Any = ros.rclpy.create_node(
                base,
                namespace=namespace or "/",
                context=context,
                use_global_arguments=False,
                enable_rosout=False,
                start_parameter_services=False,
                parameter_overrides=[no_service],
            )
        self._context = NodeContext(ros=ros, arrivals=arrivals, node=self.rclpy_node)

    def create_publisher(self, message_class: type[Any], topic: str, qos: QoSProfile) -> RosPublisher:
        """Show a publisher.

        Args:
            message_class: rclpy's class.
            topic: The full name of the topic.
            qos: Its QoS.

        Raises:
            RosError: ROS 2 refuses it.
        """
        with ros_errors(self._ros, f"ROS 2 refuses a publisher of '{topic}'"):
            endpoint = self.rclpy_node.create_publisher(
                message_class,
                topic,
                to_ros(self._ros, qos),
                event_callbacks=self._ros.rclpy.event_handler.PublisherEventCallbacks(
                    use_default_callbacks=False
                ),
            )
        return RosPublisher(self._context, endpoint)

    def create_subscription(
        self,
        message_class: type[Any],
        topic: str,
        qos: QoSProfile,
        callback: Callable[[bytes, RosMessageInfo], None] | None = None,
    ) -> RosSubscription:
        """Show a subscription.

        Args:
            message_class: rclpy's class.
            topic: The full name of the topic.
            qos: Its QoS.
            callback: Called in the loop with each message in CDR, and what ROS 2 says about it; None: the
                subscription is only shown.

        Raises:
            RosError: ROS 2 refuses it.
        """
        with ros_errors(self._ros, f"ROS 2 refuses a subscription to '{topic}'"):
            endpoint = self.rclpy_node.create_subscription(
                message_class,
                topic,
                _never,
                to_ros(self._ros, qos),
                event_callbacks=self._ros.rclpy.event_handler.SubscriptionEventCallbacks(
                    use_default_callbacks=False
                ),
                callback_group=self._group(),
                raw=True,
            )
        return RosSubscription(self._context, endpoint, callback)

    def create_client(
        self,
        service_class: type[Any],
        name: str,
        callback: Callable[[int, Any], None] | None = None,
        *,
        qos: QoSProfile | None = None,
    ) -> RosClient:
        """Show a client.

        Args:
            service_class: rclpy's class of the service, or one of an action's, such as
                `Fibonacci.Impl.SendGoalService`.
            name: The full name of the service.
            callback: Called in the loop with the sequence number of the request and the response; None: the
                client is only shown.
            qos: Its QoS; by default that of services.

        Raises:
            RosError: ROS 2 refuses it.
        """
        with ros_errors(self._ros, f"ROS 2 refuses a client of '{name}'"):
            endpoint = self.rclpy_node.create_client(
                service_class, name, qos_profile=self._service_qos(qos), callback_group=self._group()
            )
        return RosClient(self._context, endpoint, callback, service_class)

    def create_service(
        self,
        service_class: type[Any],
        name: str,
        callback: Callable[[Any, Any], None] | None = None,
        *,
        qos: QoSProfile | None = None,
    ) -> RosService:
        """Show a service.

        Args:
            service_class: As for `create_client`.
            name: The full name of the service.
            callback: Called in the loop with the request and its header, which `RosService.respond` needs;
                None: the service is only shown.
            qos: Its QoS; by default that of services.

        Raises:
            RosError: ROS 2 refuses it.
        """
        with ros_errors(self._ros, f"ROS 2 refuses a service '{name}'"):
            endpoint = self.rclpy_node.create_service(
                service_class,
                name,
                _never,
                qos_profile=self._service_qos(qos),
                callback_group=self._group(),
            )
        return RosService(self._context, endpoint, callback, service_class)

    def servers(self, name: str) -> frozenset[bytes]:
        """Return the gids of the servers of a service; dead ones are among them until their lease ends.

        Args:
            name: Its full name.
        """
        infos = self.rclpy_node.get_subscriptions_info_by_topic(request_topic(name), no_mangle=True)
        return frozenset(bytes(each.endpoint_gid) for each in infos)

    def destroy(self) -> None:
        """Destroy the node and its endpoints. A second call does nothing."""
        if self not in self._siblings:
            return
        for endpoint in list(self._context.endpoints):
            endpoint.destroy()
        self.rclpy_node.destroy_node()
        self._siblings.discard(self)

    def _service_qos(self, qos: QoSProfile | None) -> Any:
        if qos is None:
            return self._ros.rclpy.qos.qos_profile_services_default
        return to_ros(self._ros, qos)

    def _group(self) -> Any:
        """Return a callback group for one endpoint: a node's own never forgets an endpoint."""
        return self._ros.rclpy.callback_groups.MutuallyExclusiveCallbackGroup()


def _never(*_: object) -> None:
    """Stand in for callbacks of rclpy: no executor calls them."""


def request_topic(service: str) -> str:
    """Return DDS's name of the topic of a service's requests.

    Args:
        service: The full name of the service.
    """
    return f"rq{service}Request"
