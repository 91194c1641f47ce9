"""What a node can ask about the graph. The answers are the broker's, of now."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

from actors.ros.rclpy.topic_endpoint_info import TopicEndpointInfo

if TYPE_CHECKING:
    from collections.abc import Callable, Coroutine

    from actors.node.node import Node as NativeNode
    from actors.threads.node_thread import NodeThread

T = TypeVar("T")


class NodeNameNonExistentError(RuntimeError):
    """There is no node of that name."""


class NodeGraph:
    """rclpy's graph queries, one method each."""

    native: NativeNode
    _thread: NodeThread

    def ask(self, query: Callable[..., Coroutine[Any, Any, T]], *args: Any) -> T:
        """Return the answer of callboard's node to a query."""
        return self._thread.call(lambda: query(*args))

    def get_node_names(self) -> list[str]:
        """Return the names of all nodes."""
        return self.ask(self.native.get_node_names)

    def get_fully_qualified_node_names(self) -> list[str]:
        """Return the full names of all nodes."""
        return self.ask(self.native.get_fully_qualified_node_names)

    def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        """Return the names and namespaces of all nodes."""
        return self.ask(self.native.get_node_names_and_namespaces)

    def get_node_names_and_namespaces_with_enclaves(self) -> list[tuple[str, str, str]]:
        """Return names, namespaces and enclaves, which are all "/"."""
        return [(name, namespace, "/") for name, namespace in self.get_node_names_and_namespaces()]

    def get_topic_names_and_types(self, no_demangle: bool = False) -> list[tuple[str, list[str]]]:
        """Return all topics with their types."""
        del no_demangle
        return self.ask(self.native.get_topic_names_and_types)

    def get_service_names_and_types(self) -> list[tuple[str, list[str]]]:
        """Return all services with their types."""
        return self.ask(self.native.get_service_names_and_types)

    def ask_of_node(
        self, query: Callable[[str, str], Coroutine[Any, Any, T]], node_name: str, node_namespace: str
    ) -> T:
        """Return the answer to a query about a node; raise NodeNameNonExistentError without such a node."""
        if (node_name, node_namespace) not in self.get_node_names_and_namespaces():
            raise NodeNameNonExistentError(f"Cannot find node '{node_name}' in namespace '{node_namespace}'")
        return self.ask(query, node_name, node_namespace)

    def get_publisher_names_and_types_by_node(
        self,
        node_name: str,
        node_namespace: str,
        no_demangle: bool = False,
    ) -> list[tuple[str, list[str]]]:
        """Return the topics that a node publishes; raise NodeNameNonExistentError without such a node."""
        del no_demangle
        return self.ask_of_node(self.native.get_publisher_names_and_types_by_node, node_name, node_namespace)

    def get_subscriber_names_and_types_by_node(
        self,
        node_name: str,
        node_namespace: str,
        no_demangle: bool = False,
    ) -> list[tuple[str, list[str]]]:
        """Return the topics of a node's subscriptions; raise NodeNameNonExistentError without such a node."""
        del no_demangle
        return self.ask_of_node(self.native.get_subscriber_names_and_types_by_node, node_name, node_namespace)

    def get_service_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> list[tuple[str, list[str]]]:
        """Return the services of a node; raise NodeNameNonExistentError without such a node."""
        return self.ask_of_node(self.native.get_service_names_and_types_by_node, node_name, node_namespace)

    def get_client_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> list[tuple[str, list[str]]]:
        """Return the services of a node's clients; raise NodeNameNonExistentError without such a node."""
        return self.ask_of_node(self.native.get_client_names_and_types_by_node, node_name, node_namespace)

    def count_publishers(self, topic_name: str) -> int:
        """Return how many publishers a topic has."""
        return self.ask(self.native.count_publishers, topic_name)

    def count_subscribers(self, topic_name: str) -> int:
        """Return how many subscriptions a topic has."""
        return self.ask(self.native.count_subscribers, topic_name)

    def count_clients(self, service_name: str) -> int:
        """Return how many clients a service has."""
        return self.ask(self.native.count_clients, service_name)

    def count_services(self, service_name: str) -> int:
        """Return how many servers a service has."""
        return self.ask(self.native.count_services, service_name)

    def get_publishers_info_by_topic(
        self,
        topic_name: str,
        no_mangle: bool = False,
    ) -> list[TopicEndpointInfo]:
        """Return the publishers of a topic."""
        del no_mangle
        found = self.ask(self.native.get_publishers_info_by_topic, topic_name)
        return [TopicEndpointInfo.from_native(each) for each in found]

    def get_subscriptions_info_by_topic(
        self,
        topic_name: str,
        no_mangle: bool = False,
    ) -> list[TopicEndpointInfo]:
        """Return the subscriptions of a topic."""
        del no_mangle
        found = self.ask(self.native.get_subscriptions_info_by_topic, topic_name)
        return [TopicEndpointInfo.from_native(each) for each in found]

    def wait_for_node(self, fully_qualified_node_name: str, timeout: float) -> bool:
        """Wait for a node of that full name; return False if there is none within `timeout` seconds."""
        name = "/" + fully_qualified_node_name.lstrip("/")
        return self.ask(self.native.wait_for_node, name, timeout)
