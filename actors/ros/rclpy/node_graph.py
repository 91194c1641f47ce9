"""A node's queries of the graph. The broker answers each one with the current state."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.ros.rclpy.topic_endpoint_info import TopicEndpointInfo
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from actors.ros.rclpy.node_parts import NodeParts


class NodeGraph:
    """rclpy's graph queries, one method each."""

    _callboard: NodeParts

    def get_node_names(self) -> list[str]:
        """Return the names of all nodes."""
        return self._callboard.query(self._callboard.native.get_node_names)

    def get_fully_qualified_node_names(self) -> list[str]:
        """Return the full names of all nodes."""
        return self._callboard.query(self._callboard.native.get_fully_qualified_node_names)

    def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        """Return the names and namespaces of all nodes."""
        return self._callboard.query(self._callboard.native.get_node_names_and_namespaces)

    def get_node_names_and_namespaces_with_enclaves(self) -> list[tuple[str, str, str]]:
        """Return names, namespaces and enclaves, which are all "/"."""
        # Enclaves belong to ROS 2's security (SROS 2), which callboard does not have.
        return [(name, namespace, "/") for name, namespace in self.get_node_names_and_namespaces()]

    def get_topic_names_and_types(self, no_demangle: bool = False) -> list[tuple[str, list[str]]]:
        """Return all topics with their types."""
        # DDS mangles names; callboard does not.
        del no_demangle
        return self._callboard.query(self._callboard.native.get_topic_names_and_types)

    def get_service_names_and_types(self) -> list[tuple[str, list[str]]]:
        """Return all services with their types; as in ROS 2, also those that have clients only."""
        snapshot = self._callboard.query(self._callboard.native.get_graph)
        return snapshot.names_and_types(EntryKind.SERVICE, EntryKind.CLIENT)

    def get_publisher_names_and_types_by_node(
        self,
        node_name: str,
        node_namespace: str,
        no_demangle: bool = False,
    ) -> list[tuple[str, list[str]]]:
        """Return the topics that a node publishes; raise NodeNameNonExistentError without such a node."""
        del no_demangle
        return self._callboard.query_node(
            self._callboard.native.get_publisher_names_and_types_by_node, node_name, node_namespace
        )

    def get_subscriber_names_and_types_by_node(
        self,
        node_name: str,
        node_namespace: str,
        no_demangle: bool = False,
    ) -> list[tuple[str, list[str]]]:
        """Return the topics of a node's subscriptions; raise NodeNameNonExistentError without such a node."""
        del no_demangle
        return self._callboard.query_node(
            self._callboard.native.get_subscriber_names_and_types_by_node, node_name, node_namespace
        )

    def get_service_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> list[tuple[str, list[str]]]:
        """Return the services of a node; raise NodeNameNonExistentError without such a node."""
        return self._callboard.query_node(
            self._callboard.native.get_service_names_and_types_by_node, node_name, node_namespace
        )

    def get_client_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> list[tuple[str, list[str]]]:
        """Return the services of a node's clients; raise NodeNameNonExistentError without such a node."""
        return self._callboard.query_node(
            self._callboard.native.get_client_names_and_types_by_node, node_name, node_namespace
        )

    def count_publishers(self, topic_name: str) -> int:
        """Return how many publishers a topic has."""
        return self._callboard.query(self._callboard.native.count_publishers, topic_name)

    def count_subscribers(self, topic_name: str) -> int:
        """Return how many subscriptions a topic has."""
        return self._callboard.query(self._callboard.native.count_subscribers, topic_name)

    def count_clients(self, service_name: str) -> int:
        """Return how many clients a service has."""
        return self._callboard.query(self._callboard.native.count_clients, service_name)

    def count_services(self, service_name: str) -> int:
        """Return how many servers a service has."""
        return self._callboard.query(self._callboard.native.count_services, service_name)

    def get_publishers_info_by_topic(
        self,
        topic_name: str,
        no_mangle: bool = False,
    ) -> list[TopicEndpointInfo]:
        """Return the publishers of a topic."""
        del no_mangle
        found = self._callboard.query(self._callboard.native.get_publishers_info_by_topic, topic_name)
        return [TopicEndpointInfo.from_native(each) for each in found]

    def get_subscriptions_info_by_topic(
        self,
        topic_name: str,
        no_mangle: bool = False,
    ) -> list[TopicEndpointInfo]:
        """Return the subscriptions of a topic."""
        del no_mangle
        found = self._callboard.query(self._callboard.native.get_subscriptions_info_by_topic, topic_name)
        return [TopicEndpointInfo.from_native(each) for each in found]

    def wait_for_node(self, fully_qualified_node_name: str, timeout: float) -> bool:
        """Wait for a node of that full name; return False if there is none within `timeout` seconds."""
        name = "/" + fully_qualified_node_name.lstrip("/")
        return self._callboard.query(self._callboard.native.wait_for_node, name, timeout)
