"""A broker's part in a mesh: one engine for all its graphs."""

from __future__ import annotations

import asyncio
from collections import Counter
from contextlib import suppress
from functools import partial
from itertools import cycle, islice
from typing import TYPE_CHECKING, Final

from broker.mesh.broker_session import MeshMemory
from broker.mesh.engine.channel import MeshChannel
from broker.mesh.engine.engine import Traffic
from broker.mesh.mesh import Mesh
from proto.aio.read_budget import SHARE_FRAMES, SHARE_SEC
from proto.aio.tasks import cancel_and_wait, keep_running
from proto.untrusted_text import escape
from proto.wire.identity import VERSION
from proto.wire.mesh_keys import broker_id, zenoh_id
from proto.wire.stats import MeshBrokerStats, MeshStats

if TYPE_CHECKING:
    from collections.abc import Callable

    from broker.access.rules import AccessRules
    from broker.mesh.engine.engine import Engine, Host
    from broker.routing.deliveries import Delivery
    from broker.routing.router import Router
    from broker.serving.dispatcher import Dispatcher
    from proto.aio.read_budget import ReadBudget


PAUSE_US: Final = 100_000
"""The least time between two measurements. INSPECT starts them, and many clients may send it."""

VALID_US: Final = 10_000_000
"""How long the statistics show a measurement that no later one has replaced."""


class RoundTrips:
    """The latest round trips to other brokers. Times are in microseconds.

    Attributes:
        by_broker: The round trips, by the numbers of brokers.
    """

    def __init__(self) -> None:
        self.by_broker: dict[int, int] = {}
        self._began_us = -PAUSE_US

    def begin(self, now_us: int) -> bool:
        """Return whether to measure again: send each broker a PING with this time as its token."""
        since = now_us - self._began_us
        if since < PAUSE_US:
            return False
        if since > VALID_US:
            self.by_broker.clear()
        self._began_us = now_us
        return True

    def record(self, broker: int, token: int, now_us: int) -> None:
        """Record a broker's answer, unless it answers an earlier PING."""
        if token == self._began_us:
            self.by_broker[broker] = max(1, now_us - token)


HEARTBEAT_SEC: Final = 1.0
"""A lost last message is noticed within about this time; a heartbeat costs each other broker one message."""

LAST_PING: Final = 0
"""The token of the PING at a stop; the tokens of the others are times."""

LAST_ANSWER_SEC: Final = 5.0
"""How long a stop waits for other brokers."""

STEPS: Final = 20
"""Steps of long work between two looks at the clock: some 0.3 ms."""

PAUSE_SEC: Final = SHARE_SEC
"""The least time between two shares of long work, so that it takes half of the event loop at most: Zenoh's
threads and other links need the rest."""

MAX_NEIGHBOURS: Final = 100
"""Neighbours that the statistics name."""


class MeshMember:
    """A broker in a mesh (`engine.Host`).

    Args:
        number: The broker's number in the mesh, 1 to 2^31 - 1 (others may have up to `MAX_U32`).
        dispatcher: The broker's links.
        make_engine: Returns an engine for a broker's number and host.
        name: The broker's name in listings and logs; others may have it, too.

    Attributes:
        number: As given.
    """

    def __init__(
        self, number: int, dispatcher: Dispatcher, make_engine: Callable[[int, Host], Engine], name: str
    ) -> None:
        self.number = number
        self._name = name
        self._dispatcher = dispatcher
        self._engine = make_engine(number, self)
        self._meshes: dict[int, Mesh] = {}
        self._channels: dict[int, MeshChannel] = {}
        self._memory = MeshMemory()
        self._round_trips = RoundTrips()
        self._going_on = False
        """Whether long work goes on in a later loop turn."""
        self._stopped = False
        self._heartbeat: asyncio.Task[None] | None = None
        self._unanswered: set[tuple[int, int]] = set()
        """Domains and brokers that have not answered the last PING."""
        self._all_answered = asyncio.Event()

    async def start(self) -> None:
        """Connect to other brokers."""
        await self._engine.start()
        heartbeats = keep_running("The mesh's heartbeat", self._send_heartbeats)
        self._heartbeat = asyncio.get_running_loop().create_task(heartbeats)

    async def stop(self) -> None:
        """Disconnect when the others have received everything that was sent."""
        if self._heartbeat is not None:
            await cancel_and_wait(self._heartbeat)
        try:
            await self._wait_for_others()
        finally:  # also if it is cancelled
            self._stopped = True
            await self._engine.stop()

    async def _wait_for_others(self) -> None:
        """Wait until each broker has answered a last PING.

        The end of a Zenoh session can overtake the messages before it; the answers show that they arrived.
        """
        for domain, mesh in self._meshes.items():
            brokers = mesh.sessions.names()
            self._unanswered.update((domain, broker) for broker in brokers)
            mesh.queries.ping(brokers, LAST_PING)
        self._all_answered.clear()
        self.flush()
        if self._unanswered:
            with suppress(TimeoutError):
                await asyncio.wait_for(self._all_answered.wait(), LAST_ANSWER_SEC)

    def _go_on_later(self) -> None:
        """Go on with long work after a pause."""
        if not self._going_on:
            self._going_on = True
            asyncio.get_running_loop().call_later(PAUSE_SEC, self._budget.wait, self)

    def go_on_reading(self) -> None:
        """Go on with long work, for a share of the read budget (`read_budget.Reader`)."""
        if self._stopped:  # the engine sends no more requests
            return
        self._going_on = False
        budget = self._budget
        began = budget.clock()
        busy = [mesh.work for mesh in self._meshes.values() if mesh.work.pending]
        channels = [each for each in self._channels.values() if each.mesh.busy]
        for channel in islice(cycle(channels), SHARE_FRAMES // STEPS):
            channel.mesh.work.go_on(STEPS)
            channel.ask()
            if budget.clock() - began > SHARE_SEC:
                break
        # A broker with many endpoints has come or gone: what it took, or its snapshot, is free now.
        if busy and not any(work.pending for work in busy):
            self._dispatcher.memory.freed = True
        self.flush()
        budget.spend(budget.clock() - began)

    async def _send_heartbeats(self) -> None:
        while True:
            await asyncio.sleep(HEARTBEAT_SEC)
            for mesh in self._meshes.values():
                mesh.send_heartbeat()
            self.flush()

    def add(self, router: Router) -> MeshChannel:
        """Join the graph of a router; return the channel for its peer."""
        domain = router.domain

        def deliver(deliveries: list[Delivery]) -> None:
            self._dispatcher.deliver(router, deliveries)
            self._dispatcher.reports.report_soon()

        most = self._dispatcher.options.max_mesh_endpoints
        mesh = self._meshes[domain] = Mesh(
            self.number,
            router,
            deliver,
            partial(self._warn, domain),
            max_endpoints=most,
            name=self._name,
            memory=self._memory,
        )

        def ponged(broker: int, token: int) -> None:
            if token == LAST_PING:
                self._unanswered.discard((domain, broker))
            self._round_trips.record(broker, token, self._now_us())

        mesh.queries.ponged = ponged
        rules = self._dispatcher.admission.rules
        if rules is not None:
            mesh.set_rights(rules.imports, rules.exports)
        self._engine.join(domain)
        channel = self._channels[domain] = MeshChannel(
            mesh, router, self._engine, lambda: self._dispatcher.options, self._go_on_later
        )
        return channel

    def apply(self, rules: AccessRules) -> None:
        """Apply changed access rules."""
        for mesh in self._meshes.values():
            mesh.set_rights(rules.imports, rules.exports)

    def brokers(self, domain: int) -> tuple[MeshBrokerStats, ...]:
        """Return the brokers in a domain, this one first, and start to measure the round trips again.

        The numbers are those of the measurement before, as the answers are still to come.
        """
        names, now = self._meshes[domain].sessions.names(), self._now_us()
        if self._round_trips.begin(now):
            self._meshes[domain].queries.ping(names, now)
        engine = self._engine.statistics()
        others: list[MeshBrokerStats] = []
        for number, (name, version) in names.items():
            traffic = engine.traffic.get(number, Traffic())
            stats = MeshBrokerStats(
                number,
                name,
                version,
                direct=zenoh_id(number) in engine.neighbours,
                round_trip_us=self._round_trips.by_broker.get(number, 0),
                sent=traffic.sent,
                bytes_sent=traffic.bytes_sent,
                received=traffic.received,
                bytes_received=traffic.bytes_received,
            )
            others.append(stats)
        return (MeshBrokerStats(self.number, self._name, VERSION), *sorted(others))

    def totals(self) -> MeshStats:
        """Return the numbers of all domains together."""
        engine = self._engine.statistics()
        counts: Counter[str] = Counter()
        for mesh in self._meshes.values():
            counts.update(mesh.counts())
        outboxes = [channel.outbox for channel in self._channels.values()]
        traffic = engine.traffic.values()
        waiting = sum(each.held_bytes + each.urgent_bytes + each.ordered_bytes for each in outboxes)
        brokers = {number for mesh in self._meshes.values() for number in mesh.sessions.names()}
        held = self._memory.bytes + self._memory.importing
        return MeshStats(
            brokers=len(brokers),
            sent=engine.sent,
            bytes_sent=engine.bytes_sent,
            received=sum(each.received for each in traffic),
            bytes_received=sum(each.bytes_received for each in traffic),
            waiting_bytes=waiting,
            sending_bytes=engine.sending_bytes,
            unhandled_bytes=engine.unhandled_bytes + held,
            dropped=sum(outbox.dropped for outbox in outboxes),
            overruns=engine.overruns,
            failed=engine.failed,
            malformed=engine.malformed,
            **counts,
            neighbours=" ".join(engine.neighbours[:MAX_NEIGHBOURS]),
        )

    def _now_us(self) -> int:
        return int(1e6 * self._budget.clock())

    @property
    def _budget(self) -> ReadBudget:
        budget = self._dispatcher.budget
        assert budget is not None
        return budget

    def warn(self, reason: str, text: str, *values: object) -> None:
        """Log a warning, or count it (`engine.Host`)."""
        self._dispatcher.warnings.warn(reason, text, *values)

    def _warn(self, domain: int, what: str, broker: int, text: str) -> None:
        session = self._meshes[domain].sessions.get(broker)
        shown = broker_id(broker)
        if session is not None and session.name:
            shown = f"{escape(session.name)} ({shown})"
        reason = f"the mesh {what} a broker"
        self._dispatcher.warnings.warn(reason, "Mesh: %s the broker %s: %s", what, shown, text)

    def mesh(self, domain: int) -> Mesh:
        """Return the mesh of a domain, in which this broker takes part from now on."""
        if domain not in self._meshes:
            self._dispatcher.router(domain)
        return self._meshes[domain]

    def flush(self) -> None:
        """Send what the routers have returned."""
        self._dispatcher.flush()
        # A broker that has left meanwhile does not answer: do not wait for it.
        if all(broker not in self._meshes[domain].sessions for domain, broker in self._unanswered):
            self._all_answered.set()
