"""The parts of a node, in an object of their own.

Programs derive classes from `Node` and give them attributes and methods of their own, such as `_thread`.
Therefore a node has a single attribute that rclpy's does not have, `_callboard`, which holds these parts; its
class has `_callboard_classes`, the classes of entities that subclasses make instead of others.
"""

from __future__ import annotations

import threading
import weakref
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING, Any, Final, TypeVar

from actors.errors import BrokerUnreachable
from actors.graph.view import QUERY_TIMEOUT_SEC
from actors.node.node import Node as NativeNode
from actors.node.options import NodeOptions
from actors.parameters.store import ParameterStore
from actors.ros.rclpy._rclpy_pybind11 import NodeNameNonExistentError as NodeNameNonExistentError
from actors.ros.rclpy.clock import ROSClock
from actors.ros.rclpy.context import parsed_arguments
from actors.ros.rclpy.exceptions import InvalidHandle
from actors.ros.rclpy.queued_calls import QueuedCalls, RecentCalls
from actors.ros.rclpy.thread_node import ThreadNode, settle
from actors.ros.rclpy.type_description_service import START_TYPE_DESCRIPTION_SERVICE_PARAM
from actors.threads.errors import ThreadStopped

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable, Coroutine, Iterator, Mapping, Sequence

    from actors.parameters.types import Parameter
    from actors.ros.rclpy.callback_groups import CallbackGroup
    from actors.ros.rclpy.context import Context
    from actors.ros.rclpy.entity import Entity, EntityExecutor, EntityNode
    from actors.ros.rclpy.publisher import Publisher
    from actors.threads.node_thread import NodeThread

T = TypeVar("T")

JUMP_DEPTH: Final = 10
"""Calls of jump callbacks that wait for the executor; then the oldest are dropped."""
_NATIVE_OVERRIDES: Final = {START_TYPE_DESCRIPTION_SERVICE_PARAM}
"""Parameters whose overrides callboard's node gets, too: it reads them when it is made."""


class Lifeline:
    """Held by a node and its publishers and clients: without these it leaves the graph, as in rclpy."""


def _abandon(thread: NodeThread, native: NativeNode) -> None:
    """Take a node out of service that nobody has any more; in any thread."""
    with suppress(ThreadStopped):
        thread.leave_soon(native)


class NodeParts:
    """callboard's node and the endpoints of one of ROS 2's nodes.

    Args:
        node: The node of ROS 2.
        context: Its context.
        group: The callback group of the clock's jump callbacks.
        overrides: Values for parameters.
        allow_undeclared: Whether reading and setting undeclared parameters is no error.
        options: Further arguments of callboard's node.

    Attributes:
        context: The context.
        thread: The thread in which callboard's node lives.
        lifeline: Keeps callboard's node in service.
        clock: The clock.
        jumps: Makes the calls of its jump callbacks; the node adds it to its entities.
        allow_undeclared: Whether reading and setting undeclared parameters is no error.
        store: The parameters.
        parameters_lock: Held while they change.
        executor: Was the last to get the node; None without one.
        active_executor: Runs the callbacks; None without one.
        publishers: The publishers.
        entities: The entities by their classes.
        destroyed: Whether the node is out of service.
    """

    def __init__(
        self,
        node: EntityNode,
        context: Context,
        group: CallbackGroup,
        *,
        overrides: Sequence[Parameter],
        allow_undeclared: bool,
        options: dict[str, Any],
    ) -> None:
        # Weak, since the node has these parts: a circle would keep a node that was dropped until the
        # garbage collector runs.
        self._node = weakref.ref(node)
        made: Any = node
        self._classes: Mapping[type[Any], type[Any]] = made._callboard_classes  # noqa: SLF001 - as in `parts_of`
        self.context = context
        self.thread = context.thread
        self.allow_undeclared = allow_undeclared
        self.executor: weakref.ref[EntityExecutor] | None = None
        self.active_executor: weakref.ref[EntityExecutor] | None = None
        self.publishers: list[Publisher[Any]] = []
        self.entities: dict[type[Entity], list[Any]] = {}
        self.destroyed = False
        parsed_arguments(options["cli_args"])  # for rclpy's errors
        values = {each.name: each.value for each in overrides}
        self._native: NativeNode = self.thread.call(
            lambda: ThreadNode(
                parameter_overrides={name: values[name] for name in values.keys() & _NATIVE_OVERRIDES},
                start_parameter_services=False,
                options=NodeOptions(
                    domain=context.domain_id,
                    process_arguments=context.arguments,
                    # As in ROS 2, where several nodes may have one name, and incompatible QoS does not
                    # match.
                    shared_name=True,
                    strict_qos=True,
                    # The program's callbacks do not run in the loop.
                    slow_callback_sec=None,
                ),
                **options,
            )
        )
        self.jumps = QueuedCalls(self.thread, group)
        jump_calls = RecentCalls(self.jumps, JUMP_DEPTH)
        self.clock = self.thread.call(lambda: self.class_for(ROSClock)(self.native.get_clock(), jump_calls))
        self.lifeline = Lifeline()
        # Not at exit: the context ends then.
        weakref.finalize(self.lifeline, _abandon, self.thread, self._native).atexit = False
        # Entered with a weak reference: the thread holds it as long as the node runs, and must not hold the
        # parts.
        self.thread.enter(_entered(self.native, weakref.ref(self)))
        # Reentrant: a callback of a parameter may read and declare others.
        self.parameters_lock = threading.RLock()
        # A store of its own, and not that of callboard's node: callbacks run in the thread that sets, as in
        # rclpy, and not in the loop.
        self.store = ParameterStore(
            overrides=values,
            argument_overrides=self.native.argument_overrides,
            allow_undeclared=allow_undeclared,
        )

    @property
    def native(self) -> NativeNode:
        """The node of callboard; raise InvalidHandle if this one has been destroyed."""
        if self.destroyed:
            raise InvalidHandle(f"The node {self._native.get_fully_qualified_name()} has been destroyed")
        return self._native

    def track(self) -> None:
        """Let the end of the context wait for the end of callboard's node, if there is no other node."""
        self.context.track_native(self._native)

    def leave(self) -> None:
        """Take callboard's node out of service."""
        with suppress(ThreadStopped, LookupError):  # the thread has failed, and left all nodes
            self.thread.leave(self._native)

    # Endpoints

    def class_for(self, kind: type[T]) -> type[T]:
        """Return the class to make for a class of entities: that, or the node's own."""
        return self._classes.get(kind, kind)

    def add(self, entity: Entity) -> None:
        """Make something an entity of the node."""
        node = self._node()
        assert node is not None  # it makes this call
        self.of(type(entity)).append(entity)
        entity.attach(node)

    def of(self, kind: type[Entity]) -> list[Any]:
        """Return the entities of a class; they may change."""
        return self.entities.setdefault(self.class_for(kind), [])

    def all_entities(self) -> Iterator[Entity]:
        """Yield the entities of all classes."""
        for each in tuple(self.entities.values()):
            yield from tuple(each)

    def give_up_calls(self) -> None:
        """End the waits of callboard's callbacks for an executor; in the loop."""
        for each in self.all_entities():
            if isinstance(each, QueuedCalls):
                each.give_up()

    def detach(self, entity: Entity) -> None:
        """Run the callbacks of an entity no more, if it is this node's."""
        with suppress(KeyError, ValueError):  # it has been removed, perhaps with the node
            self.entities[type(entity)].remove(entity)
        entity.detach()

    def destroy(self, entities: list[Any], entity: Any) -> bool:
        """Take an endpoint out of service; return False if it is not among these."""
        if entity not in entities:
            return False
        entities.remove(entity)
        entity.destroy()
        for events in getattr(entity, "event_handlers", ()):
            self.detach(events)
        return True

    # The graph

    def query(self, query: Callable[..., Coroutine[Any, Any, T]], *args: Any) -> T:
        """Return the answer of callboard's node to a query.

        A node of ROS 2 answers from what it knows; a restart of the broker must not end a program that asks.
        """

        async def ask() -> T:
            try:
                return await query(*args)
            except BrokerUnreachable:
                own = self.native.get_fully_qualified_name()
                if not await self.native.wait_for_node(own, QUERY_TIMEOUT_SEC):
                    raise
                return await query(*args)

        settle(self.thread)
        return self.thread.call(ask)

    def query_node(
        self, query: Callable[[str, str], Coroutine[Any, Any, T]], node_name: str, node_namespace: str
    ) -> T:
        """Return the answer to a query about a node; raise NodeNameNonExistentError without such a node."""
        namespace = node_namespace or "/"
        # Asked first, as an unknown node and one without endpoints have the same answer.
        if (node_name, namespace) not in self.query(self.native.get_node_names_and_namespaces):
            raise NodeNameNonExistentError(f"Cannot find node '{node_name}' in namespace '{namespace}'")
        return self.query(query, node_name, namespace)


@asynccontextmanager
async def _entered(native: NativeNode, parts: weakref.ref[NodeParts]) -> AsyncGenerator[NativeNode]:
    """Enter callboard's node; end its callbacks that wait for an executor before it is left."""
    async with native:
        try:
            yield native
        finally:
            entered = parts()
            if entered is not None:
                entered.give_up_calls()


def parts_of(node: Any) -> NodeParts:
    """Return the parts of a node."""
    parts: NodeParts = node._callboard  # noqa: SLF001 - the one name that is callboard's
    return parts
