"""Watches a node while a browser shows it: its diagnostics, lifecycle state and parameters.

Changes of state and of parameters are pushed by the node; only its diagnostics are asked for again and again.
"""

from __future__ import annotations

import asyncio
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actors.interfaces.callboard_interfaces.srv import GetDiagnostics
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.lifecycle_msgs.srv import GetAvailableTransitions, GetState
from actors.interfaces.message import type_name
from actors.interfaces.rcl_interfaces.srv import DescribeParameters
from actors.node.parameter_services import EVENTS_TOPIC
from actors.parameter_client.client import ParameterClient
from actors.tools import node_documents
from actors.web.javascript_values import to_javascript
from actors.web.observer import CHANGE_PERIOD_SEC
from actors.web.subscription_answer import SubscriptionRefusedError
from actors.web.topic_feed import TooManyTopicsError
from proto.aio.tasks import keep_running
from proto.errors import CallboardError
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Iterable, Sequence

    from actors.node.node import Node
    from actors.parameters.types import Parameter, ParameterDescriptor
    from actors.web.observer import Observer
    from actors.web.topic_feed import Received, TopicFeeds, TopicReader

POLL_PERIOD_SEC: Final = 2.0
"""Seconds between two requests for diagnostics."""

NODE_ANSWER_SEC: Final = 2.0
"""Time for the answer to each request."""

MAX_NODES: Final = 64
"""Nodes that are shown at the same time."""

MAX_PARAMETERS: Final = 1000
"""Parameters of a node that are shown."""

MAX_WAITING_EVENTS: Final = 100
"""Messages of `/parameter_events` that wait for the watch; if more come, the parameters are read again."""

DIAGNOSTICS: Final = "diagnostics"
LIFECYCLE: Final = "lifecycle"
PARAMETERS: Final = "parameters"

_SERVICES: Final = {
    DIAGNOSTICS: ("get_diagnostics", GetDiagnostics),
    LIFECYCLE: ("get_state", GetState),
    PARAMETERS: ("describe_parameters", DescribeParameters),
}
"""The service of a node that shows that it has a part: its name and its type."""


class TooManyNodesError(CallboardError):
    """The server shows `MAX_NODES` nodes already. Close one."""


async def lifecycle_of(node: Node, name: str, timeout_sec: float) -> dict[str, Any]:
    """Return the state of a node, and the transitions from it.

    Args:
        node: The node that asks.
        name: The full name of the node with states.
        timeout_sec: Time limit of each request.

    Returns:
        `state`: label, id; `transitions`: a list of id, label, start_state, goal_state.

    Raises:
        CallFailed: There is no reply.
    """
    state = node.create_client(GetState, f"{name}/get_state")
    transitions = node.create_client(GetAvailableTransitions, f"{name}/get_available_transitions")
    try:
        current = (await state.call(GetState.Request(), timeout_sec)).current_state
        found = await transitions.call(GetAvailableTransitions.Request(), timeout_sec)
    finally:
        state.destroy()
        transitions.destroy()
    return {
        "state": {"label": current.label, "id": current.id},
        "transitions": [node_documents.transition(each) for each in found.available_transitions],
    }


async def parameters_of(
    observer: Observer, name: str, timeout_sec: float
) -> tuple[list[dict[str, Any]], int]:
    """Return the parameters of a node for JavaScript, `MAX_PARAMETERS` at most, and how many more it has.

    Args:
        observer: Has the node that asks.
        name: The full name of the other node.
        timeout_sec: Time limit of each request.

    Raises:
        CallFailed: There is no reply.
    """
    client = ParameterClient(observer.node, name)
    try:
        every = sorted((await client.list_parameters((), 0, timeout_sec)).names)
        names = every[:MAX_PARAMETERS]
        descriptors = await client.describe_parameters(names, timeout_sec)
        values = await client.get_parameters(names, timeout_sec)
    finally:
        client.destroy()
    found = await observer.work.run(_parameter_documents, descriptors, values)
    return found, len(every) - len(names)


def _parameter_documents(
    descriptors: Sequence[ParameterDescriptor], values: Sequence[Parameter]
) -> list[dict[str, Any]]:
    return [
        to_javascript({**node_documents.descriptor(descriptor), **node_documents.parameter(value)})
        for descriptor, value in zip(descriptors, values, strict=True)
    ]


class NodeWatch:
    """The answers of one node about itself.

    Args:
        observer: Has the node that asks, and the graph.
        feeds: Read topics.
        name: The full name of the node; it need not exist.
        unused: Called when the last listener has gone.

    Attributes:
        parts: The parts that are known: `diagnostics`, `lifecycle`, `parameters` by name; `errors` by part.
    """

    def __init__(self, observer: Observer, feeds: TopicFeeds, name: str, unused: Callable[[], None]) -> None:
        self.parts: dict[str, Any] = {}
        self._observer = observer
        self._name = name
        self._unused = unused
        self._listeners: set[Callable[[], None]] = set()
        self._served: frozenset[str] = frozenset()
        self._entries: frozenset[int] = frozenset()
        """The node's keys in the graph. They differ after a restart, and then all parts are asked for
        again."""
        self._stale: set[str] = set()
        """Parts that the next round asks for."""
        self._news = asyncio.Event()
        self._feeds = feeds
        self._events = feeds.read(EVENTS_TOPIC, MAX_WAITING_EVENTS, self._news.set)
        self._transitions: TopicReader | None = None
        self._end_watch = observer.on_graph(self._update_services)
        self._update_services()
        self._task = asyncio.get_running_loop().create_task(keep_running(f"The watch of {name}", self._run))

    def listen(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call a function when `parts` has changed.

        Args:
            listener: Takes nothing, does not block.

        Returns:
            Ends it; the last end ends the watch.
        """
        self._listeners.add(listener)

        def end() -> None:
            self._listeners.discard(listener)
            if not self._listeners:
                self._close()

        return end

    def _close(self) -> None:
        self._task.cancel()
        self._end_watch()
        self._events.close()
        if self._transitions is not None:
            self._transitions.close()
        self._unused()

    def _update_services(self) -> None:
        """Update which parts the node serves; all of them are stale if that has changed."""
        snapshot = self._observer.around(self._name)
        nodes = snapshot.of_kind(EntryKind.NODE)
        entries = frozenset(each.key for each in nodes if each.node == self._name)
        services = dict(snapshot.names_and_types(EntryKind.SERVICE, node=self._name))
        served = frozenset(
            part
            for part, (service, kind) in _SERVICES.items()
            if type_name(kind) in services.get(f"{self._name}/{service}", ())
        )
        if served != self._served or entries != self._entries:
            self._served, self._entries = served, entries
            self._stale |= _SERVICES.keys()
            self._news.set()

    async def _run(self) -> None:
        asks: dict[str, Callable[[], Awaitable[Any]]] = {
            DIAGNOSTICS: self._diagnostics,
            LIFECYCLE: partial(lifecycle_of, self._observer.node, self._name, NODE_ANSWER_SEC),
            PARAMETERS: self._parameters,
        }
        while True:
            # Cleared before the readers are popped: news from now on starts another round.
            self._news.clear()
            polled = {DIAGNOSTICS}
            if not self._follow_transitions():
                polled.add(LIFECYCLE)
            if not await self._follow_events():
                polled.add(PARAMETERS)
            # Swapped before the requests, so that a change during them is asked for in the next round.
            stale, self._stale = self._stale, set()
            await asyncio.gather(*(self._refresh(part, asks[part]) for part in stale))
            if stale:
                for listener in tuple(self._listeners):
                    listener()
            await asyncio.sleep(CHANGE_PERIOD_SEC)  # a node may change as often as it likes
            try:
                async with asyncio.timeout(POLL_PERIOD_SEC):
                    await self._news.wait()
            except TimeoutError:
                self._stale |= polled

    def _follow_transitions(self) -> bool:
        """Mark the state as stale if it has changed; return whether the node reports changes."""
        if LIFECYCLE not in self._served:
            return True
        try:
            if self._transitions is None:
                self._transitions = self._feeds.read(f"{self._name}/transition_event", 1, self._news.set)
            if self._transitions.pop():
                self._stale.add(LIFECYCLE)
        except (TooManyTopicsError, SubscriptionRefusedError):
            return False
        return True

    async def _refresh(self, part: str, ask: Callable[[], Awaitable[Any]]) -> None:
        found, error = None, None
        if part in self._served:
            try:
                found = await ask()
            except CallboardError as failure:
                found, error = self.parts.get(part), str(failure)  # the last answer, with the error
        self.parts[part] = found
        self.parts["errors"] = {**self.parts.get("errors", {}), part: error}

    async def _diagnostics(self) -> dict[str, Any]:
        client = self._observer.node.create_client(GetDiagnostics, f"{self._name}/get_diagnostics")
        try:
            response = await client.call(GetDiagnostics.Request(), NODE_ANSWER_SEC)
        finally:
            client.destroy()
        return await self._observer.work.run(node_documents.diagnostics, self._name, response)

    async def _parameters(self) -> dict[str, Any]:
        found, omitted = await parameters_of(self._observer, self._name, NODE_ANSWER_SEC)
        return {"by_name": {each["name"]: each for each in found}, "omitted": omitted}

    async def _follow_events(self) -> bool:
        """Mark the parameters as stale if they have changed; return whether the node reports changes."""
        events = self._events
        try:
            received = events.pop()
        except SubscriptionRefusedError:
            return False
        skipped, events.skipped = events.skipped, 0
        if skipped or (received and await self._observer.work.run(_any_is_of, self._name, events, received)):
            self._stale.add(PARAMETERS)
        return True


def _any_is_of(name: str, reader: TopicReader, received: Iterable[Received]) -> bool:
    """Whether one of some messages of `/parameter_events` is about a node."""
    return any(_is_of(name, reader, each.data) for each in received)


def _is_of(name: str, reader: TopicReader, data: bytes) -> bool:
    try:
        event = reader.decode(data)
    except InvalidMessageError:
        return False
    return getattr(event, "node", None) == name


class NodeWatches:
    """The nodes that are shown.

    Args:
        observer: Has the graph.
        feeds: Read topics.
    """

    def __init__(self, observer: Observer, feeds: TopicFeeds) -> None:
        self._observer = observer
        self._feeds = feeds
        self._watches: dict[str, NodeWatch] = {}

    def watch(self, name: str) -> NodeWatch:
        """Return the watch of a node; the caller listens to it at once.

        Args:
            name: Its full name; it need not exist.

        Raises:
            TooManyNodesError: `MAX_NODES` are shown already.
            TooManyTopicsError: See `TopicFeeds.read`.
        """
        found = self._watches.get(name)
        if found is None:
            if len(self._watches) >= MAX_NODES:
                raise TooManyNodesError(f"{MAX_NODES} nodes are shown already; close one")
            found = NodeWatch(self._observer, self._feeds, name, partial(self._watches.__delitem__, name))
            self._watches[name] = found
        return found
