"""rclpy's graph queries, as coroutines: a part of Node."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.callbacks.must_await import must_await
from actors.graph.snapshot import actions_among
from actors.time.timeout import DEFAULT_TIMEOUT
from proto.wire.codes import EntryKind
from proto.wire.names import expand_topic_name, full_node_name, split_node_name

if TYPE_CHECKING:
    from actors.endpoints.context import NodeContext
    from actors.graph.broker_report import BrokerReport
    from actors.graph.changes import GraphWatch
    from actors.graph.snapshot import EndpointInfo, GraphSnapshot, NamesAndTypes
    from actors.graph.view import BrokerView
    from actors.time.timeout import Timeout

TOPICS = (EntryKind.PUBLISHER, EntryKind.SUBSCRIPTION)


class NodeGraph:
    """A node's queries of the graph.

    Every query asks the broker. Names of topics and services may be relative to the node; a malformed one
    raises InvalidNameError (a ValueError), another type TypeError.
    """

    _context: NodeContext
    _broker: BrokerView

    @must_await
    async def get_graph(self) -> GraphSnapshot:
        """Return the whole graph at this moment.

        Returns:
            A snapshot of the node's domain, including everything that this node has declared.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
        """
        return await self._broker.snapshot()

    @must_await
    async def get_broker_stats(self) -> BrokerReport:
        """Return the counts of the broker, in all and by topic and link.

        Returns:
            A report. Two reports give rates: `later.rates_since(earlier)`.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
        """
        return await self._broker.report()

    @must_await
    async def get_type_definition(self, type_hash: str) -> bytes | None:
        """Return the definition of a type that is in use, as its users have declared it.

        `actors.interfaces.runtime_types` makes classes of it.

        Args:
            type_hash: Its RIHS01 hash, as in the graph.

        Returns:
            The canonical definition: JSON, UTF-8. None if the broker does not know it.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
        """
        return await self._broker.describe(type_hash)

    @must_await
    async def get_node_names(self) -> list[str]:
        """Return the names of all nodes, without their namespaces.

        Returns:
            The names, sorted by full name: each as often as nodes share it or have it in other namespaces.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
        """
        return [name for name, _ in await self.get_node_names_and_namespaces()]

    @must_await
    async def get_node_names_and_namespaces(self) -> list[tuple[str, str]]:
        """Return the names and namespaces of all nodes.

        Returns:
            Pairs (name, namespace), sorted by full name; one for each node that shares its name.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
        """
        pairs = map(split_node_name, (await self._broker.snapshot()).nodes())
        return [(name, namespace) for namespace, name in pairs]

    @must_await
    async def get_fully_qualified_node_names(self) -> list[str]:
        """Return the full names of all nodes.

        Returns:
            The names, such as "/ns/talker", sorted; one for each node that shares its name.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
        """
        return (await self._broker.snapshot()).nodes()

    @must_await
    async def get_topic_names_and_types(self) -> NamesAndTypes:
        """Return all topics that have a publisher or subscription.

        Returns:
            Pairs of a name and its sorted types, sorted by name.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
        """
        return (await self._broker.snapshot()).names_and_types(*TOPICS)

    @must_await
    async def get_service_names_and_types(self) -> NamesAndTypes:
        """Return all services that have a server.

        Returns:
            Pairs of a name and its sorted types, sorted by name.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
        """
        return (await self._broker.snapshot()).names_and_types(EntryKind.SERVICE)

    @must_await
    async def get_publisher_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> NamesAndTypes:
        """Return the topics of a node's publishers.

        Args:
            node_name: The node's name, without its namespace.
            node_namespace: Its namespace, such as "/" or "/ns".

        Returns:
            Pairs of a name and its sorted types, sorted by name.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
        """
        return await self._by_node(EntryKind.PUBLISHER, node_name, node_namespace)

    @must_await
    async def get_subscriber_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> NamesAndTypes:
        """Return the topics of a node's subscriptions.

        Args:
            node_name: The node's name, without its namespace.
            node_namespace: Its namespace, such as "/" or "/ns".

        Returns:
            Pairs of a name and its sorted types, sorted by name.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
        """
        return await self._by_node(EntryKind.SUBSCRIPTION, node_name, node_namespace)

    @must_await
    async def get_service_names_and_types_by_node(self, node_name: str, node_namespace: str) -> NamesAndTypes:
        """Return the services of a node's servers.

        Args:
            node_name: The node's name, without its namespace.
            node_namespace: Its namespace, such as "/" or "/ns".

        Returns:
            Pairs of a name and its sorted types, sorted by name.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
        """
        return await self._by_node(EntryKind.SERVICE, node_name, node_namespace)

    @must_await
    async def get_client_names_and_types_by_node(self, node_name: str, node_namespace: str) -> NamesAndTypes:
        """Return the services of a node's clients.

        Args:
            node_name: The node's name, without its namespace.
            node_namespace: Its namespace, such as "/" or "/ns".

        Returns:
            Pairs of a name and its sorted types, sorted by name.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
        """
        return await self._by_node(EntryKind.CLIENT, node_name, node_namespace)

    @must_await
    async def get_action_names_and_types(self) -> NamesAndTypes:
        """Return all actions that have a server or a client.

        Returns:
            Pairs of a name and its sorted types, sorted by name.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
        """
        snapshot = await self._broker.snapshot()
        return actions_among(snapshot.names_and_types(EntryKind.SERVICE, EntryKind.CLIENT))

    @must_await
    async def get_action_server_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> NamesAndTypes:
        """Return the actions of a node's servers.

        Args:
            node_name: The node's name, without its namespace.
            node_namespace: Its namespace, such as "/" or "/ns".

        Returns:
            Pairs of a name and its sorted types, sorted by name.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
        """
        return actions_among(await self._by_node(EntryKind.SERVICE, node_name, node_namespace))

    @must_await
    async def get_action_client_names_and_types_by_node(
        self, node_name: str, node_namespace: str
    ) -> NamesAndTypes:
        """Return the actions of a node's clients.

        Args:
            node_name: The node's name, without its namespace.
            node_namespace: Its namespace, such as "/" or "/ns".

        Returns:
            Pairs of a name and its sorted types, sorted by name.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
        """
        return actions_among(await self._by_node(EntryKind.CLIENT, node_name, node_namespace))

    async def _by_node(self, kind: EntryKind, name: str, namespace: str) -> NamesAndTypes:
        node = full_node_name(namespace, name)
        return (await self._broker.snapshot()).names_and_types(kind, node=node)

    @must_await
    async def count_publishers(self, topic_name: str) -> int:
        """Return how many publishers a topic has.

        Args:
            topic_name: The topic; a relative name is expanded with the node's namespace.

        Returns:
            The number; 0 if there is no such topic.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
            InvalidNameError: The name breaks the naming rules.
        """
        return await self._count(EntryKind.PUBLISHER, topic_name)

    @must_await
    async def count_subscribers(self, topic_name: str) -> int:
        """Return how many subscriptions a topic has.

        Args:
            topic_name: The topic; a relative name is expanded with the node's namespace.

        Returns:
            The number; 0 if there is no such topic.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
            InvalidNameError: The name breaks the naming rules.
        """
        return await self._count(EntryKind.SUBSCRIPTION, topic_name)

    @must_await
    async def count_services(self, service_name: str) -> int:
        """Return how many servers a service has.

        Args:
            service_name: The service; a relative name is expanded with the node's namespace.

        Returns:
            The number; 0 if there is no such service.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
            InvalidNameError: The name breaks the naming rules.
        """
        return await self._count(EntryKind.SERVICE, service_name)

    @must_await
    async def count_clients(self, service_name: str) -> int:
        """Return how many clients a service has.

        Args:
            service_name: The service; a relative name is expanded with the node's namespace.

        Returns:
            The number; 0 if there is no such service.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
            InvalidNameError: The name breaks the naming rules.
        """
        return await self._count(EntryKind.CLIENT, service_name)

    async def _count(self, kind: EntryKind, name: str) -> int:
        full = self._expand(name, is_service=kind in {EntryKind.SERVICE, EntryKind.CLIENT})
        return (await self._broker.snapshot()).count(kind, full)

    def _expand(self, name: str, *, is_service: bool = False) -> str:
        return expand_topic_name(name, self._context.name, self._context.namespace, is_service=is_service)

    @must_await
    async def get_publishers_info_by_topic(self, topic_name: str) -> list[EndpointInfo]:
        """Return every publisher of a topic.

        Args:
            topic_name: The topic; a relative name is expanded with the node's namespace.

        Returns:
            One record for each: node, type and QoS.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
            InvalidNameError: The name breaks the naming rules.
        """
        full = self._expand(topic_name)
        return (await self._broker.snapshot()).endpoints(EntryKind.PUBLISHER, full)

    @must_await
    async def get_subscriptions_info_by_topic(self, topic_name: str) -> list[EndpointInfo]:
        """Return every subscription of a topic.

        Args:
            topic_name: The topic; a relative name is expanded with the node's namespace.

        Returns:
            One record for each: node, type and QoS.

        Raises:
            BrokerUnreachable: No broker answers within 5 s, or the session is lost.
            RuntimeError: The node does not run, or has been destroyed.
            InvalidNameError: The name breaks the naming rules.
        """
        full = self._expand(topic_name)
        return (await self._broker.snapshot()).endpoints(EntryKind.SUBSCRIPTION, full)

    def watch_graph(self) -> GraphWatch:
        """Watch the changes of the graph: `async for change in node.watch_graph()`.

        Returns:
            An iterator that begins with everything that exists, as APPEARED.

        Raises:
            NodeDestroyed: The node has been destroyed.
        """
        from actors.graph.changes import GraphWatch  # noqa: PLC0415 - seldom needed

        return GraphWatch(self._context)

    @must_await
    async def wait_for_node(
        self, fully_qualified_node_name: str, timeout_sec: Timeout = DEFAULT_TIMEOUT
    ) -> bool:
        """Wait until a node is in the graph.

        Args:
            fully_qualified_node_name: Its full name, such as "/ns/talker".
            timeout_sec: Seconds to wait at most; None for no limit.

        Returns:
            True if it is; False if it was not within `timeout_sec`.

        Raises:
            TypeError: The name is not a str.
            RuntimeError: This node does not run.
            NodeDestroyed: This node has been destroyed.
        """
        namespace, name = split_node_name(fully_qualified_node_name)
        full = full_node_name(namespace, name)
        return await self._broker.wait_for(lambda snapshot: full in snapshot.nodes(), timeout_sec)
