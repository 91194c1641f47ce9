"""rclpy's graph queries, as coroutines: a part of Node."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.callbacks.must_await import must_await
from actors.graph.changes import GraphWatch
from proto.codes import EntryKind
from proto.names import expand_topic_name, full_node_name, split_node_name

if TYPE_CHECKING:
    from actors.endpoints.context import NodeContext
    from actors.graph.broker_report import BrokerReport
    from actors.graph.snapshot import EndpointInfo, GraphSnapshot, NamesAndTypes
    from actors.graph.view import BrokerView

TOPICS = (EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION)


class NodeGraph:
    """What a node can ask about the graph.

    Every query asks the broker and raises BrokerUnreachable if none answers within 5 s. Names may be
    relative to the node; a malformed one raises InvalidNameError (a ValueError), another type TypeError.
    """

    _context: NodeContext
    _broker: BrokerView

    @must_await
    async def get_graph(self) -> GraphSnapshot:
        """Return the whole graph at this moment."""
        return await self._broker.snapshot()

    @must_await
    async def get_broker_stats(self) -> BrokerReport:
        """Return what the broker has done and holds, in all and by topic and link. Two give rates."""
        return await self._broker.report()

    @must_await
    async def get_node_names(self) -> list[str]:
        """Return the names of all nodes, without their namespaces."""
        return [name for name, _ in await self.get_node_names_and_namespaces()]

    @must_await
    async def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        """Return (name, namespace) of every node, sorted by full name."""
        pairs = map(split_node_name, (await self._broker.snapshot()).nodes())
        return [(name, namespace) for namespace, name in pairs]

    @must_await
    async def get_fully_qualified_node_names(self) -> list[str]:
        """Return the full names of all nodes, sorted."""
        return (await self._broker.snapshot()).nodes()

    @must_await
    async def get_topic_names_and_types(self) -> NamesAndTypes:
        """Return (topic, types) of every topic that has a publisher or subscription."""
        return (await self._broker.snapshot()).names_and_types(*TOPICS)

    @must_await
    async def get_service_names_and_types(self) -> NamesAndTypes:
        """Return (service, types) of every service that has a server."""
        return (await self._broker.snapshot()).names_and_types(EntryKind.SERVICE)

    @must_await
    async def get_publisher_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> NamesAndTypes:
        """Return (topic, types) of a node's publishers."""
        return await self._by_node(EntryKind.PUBLISHER, node_name, node_namespace)

    @must_await
    async def get_subscriber_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> NamesAndTypes:
        """Return (topic, types) of a node's subscriptions."""
        return await self._by_node(EntryKind.SUBSCRIPTION, node_name, node_namespace)

    @must_await
    async def get_service_names_and_types_by_node(self, node_name: str, node_namespace: str) -> NamesAndTypes:
        """Return (service, types) of a node's servers."""
        return await self._by_node(EntryKind.SERVICE, node_name, node_namespace)

    @must_await
    async def get_client_names_and_types_by_node(self, node_name: str, node_namespace: str) -> NamesAndTypes:
        """Return (service, types) of a node's clients."""
        return await self._by_node(EntryKind.CLIENT, node_name, node_namespace)

    async def _by_node(self, kind: EntryKind, name: str, namespace: str) -> NamesAndTypes:
        node = full_node_name(namespace, name)
        return (await self._broker.snapshot()).names_and_types(kind, node=node)

    @must_await
    async def count_publishers(self, topic_name: str) -> int:
        """Return how many publishers a topic has."""
        return await self._count(EntryKind.PUBLISHER, topic_name)

    @must_await
    async def count_subscribers(self, topic_name: str) -> int:
        """Return how many subscriptions a topic has."""
        return await self._count(EntryKind.SUBSCRIPTION, topic_name)

    @must_await
    async def count_services(self, service_name: str) -> int:
        """Return how many servers a service has."""
        return await self._count(EntryKind.SERVICE, service_name)

    @must_await
    async def count_clients(self, service_name: str) -> int:
        """Return how many clients a service has."""
        return await self._count(EntryKind.CLIENT, service_name)

    async def _count(self, kind: EntryKind, name: str) -> int:
        full = self._expand(name, is_service=kind in {EntryKind.SERVICE, EntryKind.CLIENT})
        return (await self._broker.snapshot()).count(kind, full)

    def _expand(self, name: str, *, is_service: bool = False) -> str:
        return expand_topic_name(name, self._context.name, self._context.namespace, is_service=is_service)

    @must_await
    async def get_publishers_info_by_topic(self, topic_name: str) -> list[EndpointInfo]:
        """Return every publisher of a topic, with node, type and QoS."""
        full = self._expand(topic_name)
        return (await self._broker.snapshot()).endpoints(EntryKind.PUBLISHER, full)

    @must_await
    async def get_subscriptions_info_by_topic(self, topic_name: str) -> list[EndpointInfo]:
        """Return every subscription of a topic, with node, type and QoS."""
        full = self._expand(topic_name)
        return (await self._broker.snapshot()).endpoints(EntryKind.SUBSCRIPTION, full)

    def watch_graph(self) -> GraphWatch:
        """Return the graph's changes, to be iterated over: `async for change in node.watch_graph()`.

        Raises:
            NodeDestroyed: The node has been destroyed.
        """
        return GraphWatch(self._context)

    @must_await
    async def wait_for_node(self, fully_qualified_node_name: str, timeout_sec: float | None = None) -> bool:
        """Wait until a node is there.

        Returns:
            True when it is; False when `timeout_sec` (None: no limit) has passed without.
        """
        namespace, name = split_node_name(fully_qualified_node_name)
        full = full_node_name(namespace, name)
        return await self._broker.wait_for(lambda snapshot: full in snapshot.nodes(), timeout_sec)
