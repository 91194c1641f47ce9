"""The broker that programs embed and the daemon runs.

    async with Broker(BrokerOptions(port=0)) as broker:
        print(broker.url)

`Broker` wires the parts, starts them and stops them. Nothing is global: many brokers can share a loop.
"""

from __future__ import annotations

import asyncio
import logging
import secrets
import time
from dataclasses import fields, replace
from itertools import count
from typing import TYPE_CHECKING, Self

from broker.access.admission import Admission
from broker.access.files import load_rules
from broker.options import BrokerOptions
from broker.serving.capacity import Capacity
from broker.serving.connection import Connection
from broker.serving.dispatcher import Dispatcher
from broker.serving.drain import Drain
from broker.serving.inspections import Inspections
from broker.serving.listening import Listener, listen
from broker.serving.peer_warnings import PeerWarnings
from broker.serving.periodic_check import PeriodicCheck
from broker.serving.presence_log import PresenceLog
from broker.serving.stats import Statistics
from proto import limits
from proto.aio.forks import drop_in_children
from proto.aio.read_budget import ReadBudget
from proto.aio.tasks import cancel_and_wait, keep_running
from proto.aio.tls import server_context

if TYPE_CHECKING:
    import ssl
    from collections.abc import Callable
    from types import TracebackType

    from broker.mesh.engine.engine import Engine, Host
    from broker.mesh.engine.member import MeshMember
    from proto.wire.stats import BrokerStats, LinkStats, MeshStats, TopicStats


class Broker:
    """A broker that can be embedded. Enter it to listen, leave it to stop; it can be entered again.

    Args:
        options: Where to listen and what to allow.
        node_log_level: Level of the lines in the log "callboard.broker" that say which nodes join, leave and
            die. The daemon uses `logging.INFO`. Hidden nodes are always logged at debug.
        clock: Steady seconds, which limit how long the broker works between two turns of its event loop. For
            tests and simulations.
        mesh_engine: Joins a mesh over another engine than Zenoh; called with the broker's number in the mesh
            and with what handles messages. For simulations.

    Attributes:
        options: As given, or the defaults.
        instance: A random identity of 16 bytes that its clients and its statistics see.
    """

    def __init__(
        self,
        options: BrokerOptions | None = None,
        *,
        node_log_level: int = logging.DEBUG,
        clock: Callable[[], float] = time.perf_counter,
        mesh_engine: Callable[[int, Host], Engine] | None = None,
    ) -> None:
        self.options = options or BrokerOptions()
        self.instance = secrets.token_bytes(limits.INSTANCE_BYTES)
        self._node_log_level = node_log_level
        self._clock = clock
        self._make_engine = mesh_engine
        self._sessions = count(1)
        self._loop: asyncio.AbstractEventLoop | None = None
        self._entered = False
        self._listener: Listener | None = None
        self._check: asyncio.Task[None] | None = None
        self._tls: ssl.SSLContext | None = None
        self._mesh: MeshMember | None = None
        self._reset()

    def _reset(self) -> None:
        """Begin with empty graphs: those of an earlier run accept no calls and hold their publishers."""
        options = self.options
        admission = Admission(
            None, max_per_address=options.max_connections_per_address, plain_tokens=options.insecure
        )
        capacity = Capacity(options.max_connections)
        presence_log = PresenceLog(self._node_log_level, self._now)
        warnings = PeerWarnings(self._now)
        self._dispatcher = Dispatcher(options, capacity, admission, presence_log, warnings)
        self._statistics = Statistics(self.instance.hex(), self._dispatcher)
        drop_in_children(self._dispatcher)

    @property
    def url(self) -> str:
        """The URL for nodes, such as "callboard://127.0.0.1:7411". RuntimeError unless it listens."""
        if self._listener is None:
            raise RuntimeError("The broker is not listening: use `async with Broker() as broker:`")
        return str(self._listener.url)

    def stats(self) -> BrokerStats:
        """Return the totals; two of them give rates: `later.rates_since(earlier)`.

        Returns:
            Counters since the start, and current numbers; zeros if it has never run.
        """
        return self._statistics.totals(self._now())

    def mesh_stats(self) -> MeshStats:
        """Return what has been exchanged with other brokers.

        Returns:
            Counters since the start, and current numbers; zeros without a mesh.
        """
        return self._statistics.mesh()

    def topic_stats(self) -> list[TopicStats]:
        """Return the numbers of each topic of each domain.

        Returns:
            One entry for each topic that has a publisher or a subscription.
        """
        return self._statistics.topics()

    def link_stats(self) -> list[LinkStats]:
        """Return the numbers of each link whose handshake is over.

        Returns:
            One entry for each link; usually one for each node.
        """
        return self._statistics.links(self._now())

    def _now(self) -> float:
        return 0.0 if self._loop is None else self._loop.time()

    def reconfigure(self, options: BrokerOptions) -> None:
        """Apply the options that can change while the broker runs; the others keep their values.

        Args:
            options: The new options. Those whose metadata has `reloads` are applied.
        """
        changed = {
            each.name: getattr(options, each.name) for each in fields(options) if each.metadata["reloads"]
        }
        self.options = self._dispatcher.options = replace(self.options, **changed)
        for link in self._dispatcher.links:
            link.reconfigure(self.options)

    def _tls_context(self) -> ssl.SSLContext | None:
        options = self.options
        if options.tls_cert is None or options.tls_key is None:
            return None
        return server_context(options.tls_cert, options.tls_key, options.tls_client_ca)

    async def __aenter__(self) -> Self:
        """Listen.

        Raises:
            AccessFileError: The file of access rules is broken, or cannot be read.
            AddressInUseError: Something else listens there.
            UnprotectedError: Other machines could connect, and there are neither rules, nor authorities of
                client certificates, nor `insecure`.
            ConfigurationError: It cannot join the mesh as its options say.
            ListenError: It cannot listen there for another reason.
            RuntimeError: It is running already.
            TlsFileError: A certificate, key or authority cannot be used.
        """
        if self._entered:
            raise RuntimeError("This broker is running already; it can be entered again when it has stopped")
        self._entered = True
        try:
            return await self._start()
        except BaseException:
            self._entered = False
            await self._leave_mesh()
            raise

    async def _start(self) -> Self:
        self._loop = loop = asyncio.get_running_loop()
        self._reset()
        dispatcher, statistics = self._dispatcher, self._statistics
        budget = dispatcher.budget = ReadBudget(loop, self._clock)
        if self.options.auth is not None:
            dispatcher.admission.rules = load_rules(self.options.auth)
        self._tls = self._tls_context()

        inspections = Inspections(loop, dispatcher, statistics)

        def connect() -> asyncio.BufferedProtocol:
            channel = Connection(loop, dispatcher, inspections, self.instance, self._sessions).channel
            if self._tls is None:
                return channel
            from proto.aio.tls_transport import TlsTransport  # noqa: PLC0415 - few brokers use TLS

            return TlsTransport(channel, self._tls, loop=loop, budget=budget, received=dispatcher.received)

        if self.options.joins_mesh or self._make_engine is not None:
            from broker.mesh.engine.joining import join_mesh  # noqa: PLC0415 - few brokers join one

            self._mesh = await join_mesh(dispatcher, self.options, budget, self._make_engine)
        statistics.started_at = loop.time()
        self._listener = await listen(self.options, connect, backlog=dispatcher.capacity.backlog)
        check = PeriodicCheck(dispatcher, statistics.lag)
        self._check = loop.create_task(keep_running("The broker's periodic check", check.run))
        return self

    async def _leave_mesh(self) -> None:
        mesh, self._mesh = self._mesh, None
        if mesh is not None:
            await mesh.stop()

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Stop."""
        await self.stop()

    def reload(self) -> None:
        """Read the files of access rules and certificates again.

        New connections get the new certificate. The rules hold for all connections: sessions whose user or
        token is gone are closed; endpoints that are not allowed any more are removed.

        Raises:
            AccessFileError: The rules are broken, or cannot be read. The earlier rules and certificates stay.
            TlsFileError: A certificate, key or authority cannot be used; likewise.
        """
        if self._listener is None:
            return
        tls = self._tls_context()
        if self.options.auth is not None:
            self._dispatcher.apply(load_rules(self.options.auth))
        self._tls = tls

    async def serve_forever(self) -> None:
        """Wait until cancelled."""
        await asyncio.get_running_loop().create_future()

    async def stop(self) -> None:
        """Accept nothing new, deliver what has been accepted, say goodbye and close.

        It takes at most `drain_timeout_sec` and two seconds, in a mesh five more. Cancel it to close
        everything at once.
        """
        listener, dispatcher = self._listener, self._dispatcher
        if listener is None or dispatcher.draining:
            return
        listener.close()
        try:
            await Drain(dispatcher).run(self.options.drain_timeout_sec)
        finally:
            links = tuple(dispatcher.links)
            for link in links:
                link.channel.abort()
            for link in links:
                dispatcher.leave(link)  # not only when its end is noticed: the broker may run again by then
            dispatcher.report_omitted(at_once=True)
            dispatcher.shared_memory.close()
            self._listener = None
            self._entered = False
            await self._stop_check()
            await self._leave_mesh()

    async def _stop_check(self) -> None:
        check, self._check = self._check, None
        if check is not None:
            await cancel_and_wait(check)
