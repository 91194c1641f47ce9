"""Watches the graph with a hidden node, and samples the broker's counters."""

from __future__ import annotations

import asyncio
import math
import time
from collections import defaultdict
from contextlib import suppress
from typing import TYPE_CHECKING, Final, Self

from actors.config.contexts import find_broker_target
from actors.errors import BrokerUnreachable
from actors.graph.snapshot import GraphSnapshot
from actors.tools.broker_names import BrokerNames
from actors.tools.hidden_node import make_hidden_node
from actors.tools.overview import Overview, Sample, Samples
from actors.web.documents import PAUSE
from actors.web.node_names import NODE_NAMES
from actors.web.worker import Worker
from proto.aio.tasks import RESTART_PAUSE_SEC, cancel_and_wait, keep_running
from proto.wire.labels import NODE_KEY

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from types import TracebackType

    from actors.graph.broker_report import BrokerReport
    from actors.graph.changes import GraphWatch
    from proto.wire.frames import GraphEntry

ACTION_PART: Final = "/_action/"
"""In the names of an action's services and topics."""

SAMPLE_PERIOD_SEC: Final = 1.0
"""Seconds between two samples of the broker's counters, while a browser or program reads them."""

MIN_RATE_SEC: Final = SAMPLE_PERIOD_SEC / 2
"""The shortest time over which rates are computed: programs may take samples in quick succession."""

MAX_SAMPLE_GAP_SEC: Final = 10.0
"""Rates start again after a longer time without samples, as they would be averages over that time."""

CHANGE_PERIOD_SEC: Final = 0.1
"""The shortest time between two reports of graph changes: a launch causes hundreds of changes."""

MAX_CHANGE_SHARE: Final = 20
"""After a change that keeps the event loop busy, the next one waits this many times as long: the graph is
reported less often if it is large, or if much of what is shown depends on it."""

FRESH_SEC: Final = 0.1
"""A sample that is younger is as good as another one, which costs as much as there are topics and links."""

GRAPH_SEC: Final = 2.0
"""Time for the broker to report the graph; whoever asks before gets an empty one."""

CONNECT_SEC: Final = 2.0
STOP_SEC: Final = 1.0


class Observer:
    """Watches one graph through a hidden node, which reconnects by itself.

    Args:
        url: The broker's URLs.
        domain: The domain id.
        token: A user's, to see the graph with that user's rights; None for the environment's.
        client_address: The address of that user's browser; None for nobody's.
        worker: The thread that all observers of the server share; None for one of its own.

    Entering raises NotAuthorized if the broker refuses the token, and BrokerUnreachable if no broker answers
    within `CONNECT_SEC`. It waits up to `GRAPH_SEC` for the graph.

    Raises:
        As `Node`.

    Attributes:
        url: As given.
        domain: As given.
        target: Both in one text, to be displayed.
        worker: As given.
        work: The share of it that this user has.
        node: The node, for other queries and for controls.
        snapshot: The graph as it was last, without the nodes of this process.
        report: The broker's counters; None before the first sample.
        overview: The graph at work; None before the first sample.
    """

    def __init__(
        self,
        url: str,
        domain: int,
        *,
        token: str | None = None,
        client_address: str | None = None,
        worker: Worker | None = None,
    ) -> None:
        self.url, self.domain = url, domain
        self.worker = worker or Worker()
        self._owns_worker = worker is None
        self.work = self.worker.share()
        self.target = f"{url} domain {domain}"
        found = find_broker_target(url, domain)
        certified = bool(found.credentials.tls.certificate)
        self._guarded = any(each.path or (each.tls and certified) for each in found.urls)
        self._name = NODE_NAMES.acquire()
        self.node = make_hidden_node(
            self._name,
            url=url,
            domain=domain,
            token=token,
            client_address=client_address,
            shared_name=True,  # it goes on if somebody takes its name while there is no connection
            connect_timeout_sec=CONNECT_SEC,
            stop_timeout_sec=STOP_SEC,
        )
        self.snapshot = GraphSnapshot()
        self.report: BrokerReport | None = None
        self.overview: Overview | None = None
        self._samples = Samples(least_sec=MIN_RATE_SEC)
        self._sampled_sec = -math.inf
        self._asked: asyncio.Task[BrokerReport] | None = None
        """The last query for the broker's counters."""
        self._asked_sec = -math.inf
        self._fresh_until_sec = -math.inf
        self._sampling: asyncio.Task[Overview] | None = None
        self._query: asyncio.Task[GraphSnapshot] | None = None
        """The query that has not been sent yet."""
        self._querying = asyncio.Lock()
        self._parts: tuple[GraphSnapshot, dict[str, dict[int, GraphEntry]]] | None = None
        """Parts of a snapshot by names; see `around`."""
        self._reported = asyncio.Event()
        """Set when the broker has reported the graph, or refuses to."""
        self._graph_listeners: set[Callable[[], None]] = set()
        self._sample_listeners: set[Callable[[], None]] = set()
        self._tasks: list[asyncio.Task[None]] = []
        self._sampled = asyncio.Event()
        """Set while there are sample listeners. Without them the broker is not asked."""

    async def __aenter__(self) -> Self:
        """Connect the node and begin to watch."""
        try:
            await self.node.__aenter__()
        except BaseException:
            NODE_NAMES.release(self._name)
            raise
        loop = asyncio.get_running_loop()
        for name, work in (("The watch of the graph", self._watch), ("The sampling", self._sample_regularly)):
            self._tasks.append(loop.create_task(keep_running(name, work)))
        with suppress(TimeoutError):
            async with asyncio.timeout(GRAPH_SEC):
                await self._reported.wait()
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Stop the node."""
        for task in self._tasks:
            await cancel_and_wait(task)
        await self.node.__aexit__(kind, error, traceback)
        NODE_NAMES.release(self._name)
        if self._owns_worker:
            self.worker.close()

    @property
    def connected(self) -> bool:
        """Whether the node has a broker now. If not, the snapshot and the samples are old."""
        return self.node.connected

    @property
    def guarded(self) -> bool:
        """Whether the broker is not for everybody on this machine.

        It has access rules, asks for certificates, or listens on a unix socket, which is for its owner.
        """
        return self._guarded or self.node.user is not None

    def broker_names(self) -> BrokerNames | None:
        """Return the names of the mesh's brokers if it has several, as of the last sample; else None."""
        names = None if self.report is None else BrokerNames(self.report)
        return names if names is not None and names.several else None

    def brokers_of_nodes(self) -> Mapping[str, str]:
        """Return each node's broker by the node's name; empty unless a mesh has several brokers."""
        names = self.broker_names()
        if names is None:
            return {}
        return {node: names.joined(each) for node, each in self.snapshot.node_brokers().items()}

    def on_graph(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call a function when the graph may have changed, at most every `CHANGE_PERIOD_SEC`.

        Args:
            listener: Takes nothing, does not block.

        Returns:
            Ends it.
        """
        self._graph_listeners.add(listener)
        return lambda: self._graph_listeners.discard(listener)

    def on_sample(self, listener: Callable[[], None]) -> Callable[[], None]:
        """Call a function after each sample, and sample every `SAMPLE_PERIOD_SEC` while anybody listens.

        Args:
            listener: Takes nothing, does not block.

        Returns:
            Ends it.
        """
        if not self._sample_listeners and time.monotonic() - self._sampled_sec > MAX_SAMPLE_GAP_SEC:
            self._samples, self.overview = Samples(least_sec=MIN_RATE_SEC), None
        self._sample_listeners.add(listener)
        self._sampled.set()

        def end() -> None:
            self._sample_listeners.discard(listener)
            if not self._sample_listeners:
                self._sampled.clear()

        return end

    def around(self, name: str) -> GraphSnapshot:
        """Return the part of the graph that has a name: what a look at one thing need not search for.

        A thread may call it. The first call after a change of the graph takes as long as the graph is large.

        Args:
            name: The full name of a topic, service, action or node. The endpoints of a node and the services
                and topics of an action are included.
        """
        snapshot, parts = self._parts or (None, {})
        if snapshot is not self.snapshot:
            self._parts = snapshot, parts = self.snapshot, _parts_of(self.snapshot)
        return GraphSnapshot(parts.get(name, {}))

    async def newest_around(self, name: str) -> GraphSnapshot:
        """Return the same part; of the graph that the broker has now, if the last one has no such name.

        Raises:
            BrokerUnreachable: There is no broker now.
        """
        part = self.around(name)
        return part if part.entries else await self.newest()

    async def newest(self) -> GraphSnapshot:
        """Return the graph that the broker has now. Those who ask while another query is answered share one.

        Raises:
            BrokerUnreachable: There is no broker now.
        """
        if self._query is None:
            self._query = asyncio.get_running_loop().create_task(self._ask())
        return await asyncio.shield(self._query)

    async def _ask(self) -> GraphSnapshot:
        async with self._querying:
            self._query = None  # its answer may be too old for those who ask from now on
            return await self.node.get_graph()

    async def sample(self) -> Overview:
        """Take a sample, or return a fresh one: for `FRESH_SEC`, and longer if it took long.

        Raises:
            BrokerUnreachable: There is no broker now.
        """
        if self.overview is not None and time.monotonic() < self._fresh_until_sec:
            return self.overview
        if self._sampling is None or self._sampling.done():
            self._sampling = asyncio.get_running_loop().create_task(self._take_sample())
        # Shielded: others wait for it, too.
        return await asyncio.shield(self._sampling)

    async def broker_report(self) -> BrokerReport:
        """Return the broker's counters, which may be those that somebody has asked for within `FRESH_SEC`.

        Raises:
            BrokerUnreachable: There is no broker now.
        """
        asked, now = self._asked, time.monotonic()
        if asked is None or (asked.done() and now - self._asked_sec > FRESH_SEC):
            asked = self._asked = asyncio.get_running_loop().create_task(self.node.get_broker_stats())
            self._asked_sec = now
        return await asyncio.shield(asked)

    async def _take_sample(self) -> Overview:
        report, samples = await self.broker_report(), self._samples
        began = time.monotonic()
        seen = await self.work.run(samples.add, Sample(self.snapshot, report))
        self.report, self._sampled_sec, self.overview = report, time.monotonic(), seen
        # Less than the period of those who listen, who get a new one each time.
        fresh_sec = min(PAUSE * (self._sampled_sec - began), SAMPLE_PERIOD_SEC / 2)
        self._fresh_until_sec = self._sampled_sec + max(FRESH_SEC, fresh_sec)
        return seen

    async def _watch(self) -> None:
        watch = self.node.watch_graph()
        try:
            while True:
                try:
                    return await self._follow(watch)
                except BrokerUnreachable:  # the broker refuses it, which the node has logged
                    self._reported.set()
                    await asyncio.sleep(RESTART_PAUSE_SEC)
        finally:
            watch.destroy()

    async def _follow(self, watch: GraphWatch) -> None:
        async for _ in watch.batches():
            # Of this thread: if the machine pauses here, the page need not wait twenty times as long.
            began = time.thread_time()
            seen = NODE_NAMES.without_own(watch.snapshot)
            self._reported.set()
            # Each stream and each reader of a topic changes this process's own nodes only. The same object as
            # before says that everything made of it is still good.
            if seen != self.snapshot:
                self.snapshot = seen
            # In any case: a broker that was started again may have the same graph, and other rules.
            for listener in tuple(self._graph_listeners):
                listener()
            spent = time.thread_time() - began
            # `batches` combines the changes of this time, so that a busy graph costs ten updates a second.
            await asyncio.sleep(max(CHANGE_PERIOD_SEC, MAX_CHANGE_SHARE * spent))

    async def _sample_regularly(self) -> None:
        while True:
            await self._sampled.wait()
            with suppress(BrokerUnreachable):  # `connected` says so; the node reconnects
                await self.sample()
            for listener in tuple(self._sample_listeners):
                listener()
            await asyncio.sleep(SAMPLE_PERIOD_SEC)


def _parts_of(snapshot: GraphSnapshot) -> dict[str, dict[int, GraphEntry]]:
    """Return the entries that each node, topic, service and action has, by name."""
    parts: defaultdict[str, dict[int, GraphEntry]] = defaultdict(dict)
    for key, entry in snapshot.entries.items():
        parts[entry.node][key] = entry
        if entry.name:
            parts[entry.name][key] = entry
            node = entry.qos.get(NODE_KEY)
            if isinstance(node, int) and node in snapshot.entries:  # its labels are told with the endpoint
                parts[entry.name][node] = snapshot.entries[node]
            action, found, _ = entry.name.partition(ACTION_PART)
            if found:
                parts[action][key] = entry
    return dict(parts)
