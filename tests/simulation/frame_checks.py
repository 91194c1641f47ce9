"""Invariants of single frames, checked when a broker receives or sends them, or a node sends them.

The sums do not show that a reader got the wrong reason, or that a call went to a server that is leaving.
"""

from __future__ import annotations

from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any, Final
from unittest import mock

from actors.endpoints.departing import DepartingQueues
from actors.endpoints.endpoint import endpoint_of
from broker.routing.deliveries import Enqueue, Send
from broker.routing.records import ServiceRecord
from broker.routing.router import Router
from broker.serving.dispatcher import Dispatcher
from broker.serving.drain import Drain
from proto import limits
from proto.aio.channel import Channel
from proto.errors import ErrorCode
from proto.queues.batches import message_bytes
from proto.wire import frames
from proto.wire.codec import decode
from proto.wire.codes import DetachReason, Op
from proto.wire.session import State
from tests.seams import simulation as seams
from tests.seams.brokers import dispatcher_of
from tests.seams.nodes import context_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from broker.access.rules import Principal
    from broker.routing.deliveries import Delivery
    from broker.serving.link import Link
    from proto.queues.publisher_queue import PublisherQueue
    from tests.simulation.world import World

CALLED_FOR_A_PEER: Final = ("disconnect", "suspend", "restore", "report")
"""The router's other methods that return deliveries."""

OP_AT: Final = 6
"""Where in an encoded frame its opcode stands: behind the prefix and the header's head."""


class FrameChecks:
    """Checks the frames of a world's brokers and nodes."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._retired: set[ServiceRecord] = set()
        """Servers whose RETIRE a broker has taken."""
        self._retire_sent: set[tuple[Channel, int]] = set()
        """Servers that have sent RETIRE."""
        self._caught_up: set[Link] = set()
        """Links that have confirmed that they are held."""
        self._held: dict[Router, set[int]] = {}
        """The publishers that a stopping broker has held before it asked their links to catch up.

        Of one that is declared later a little may come: it is accepted before it is held.
        """
        self._urls: dict[Router, str] = {}
        self._departing: list[PublisherQueue] = []
        """Of publishers that have been destroyed: what is in them still goes out."""

    @contextmanager
    def installed(self) -> Iterator[None]:
        """Check frames while inside."""
        send, departs = Channel.send, DepartingQueues.add

        def recording_send(channel: Channel, frame: frames.Frame) -> None:
            if isinstance(frame, frames.Retire):
                self._retire_sent.add((channel, frame.id))
            send(channel, frame)

        def recording_departs(
            queues: DepartingQueues, queue: PublisherQueue, *, standard: bool = False
        ) -> None:
            self._departing.append(queue)
            departs(queues, queue, standard=standard)

        with (
            mock.patch.object(Channel, "send", recording_send),
            mock.patch.object(DepartingQueues, "add", recording_departs),
            self._router_hooks(),
            self._drain_hooks(),
        ):
            yield

    @contextmanager
    def _router_hooks(self) -> Iterator[None]:
        handle, connect = Router.handle, Router.connect

        def recording_handle(router: Router, peer: int, frame: frames.Frame) -> list[Delivery]:
            if isinstance(frame, frames.Batch):
                self._check_not_held(router, peer, frame)
            gives_way = isinstance(frame, frames.Node) and _is_suspended(router, frame.name)
            out = handle(router, peer, frame)
            if gives_way and any(map(_is_refused, out)):
                self._world.complain(f"{frame} is refused for the sake of a suspended node")
            if isinstance(frame, frames.Retire):
                self._record_retired(router, peer, frame)
            if isinstance(frame, frames.Batch):
                self._record_reached(router, frame)
            self._check_detach_reasons(router, out)
            return out

        def recording_connect(
            router: Router,
            instance: bytes,
            token: bytes,
            principal: Principal | None = None,
            *,
            mesh: bool = False,
        ) -> tuple[int, list[Delivery]]:
            peer, out = connect(router, instance, token, principal, mesh=mesh)
            if (
                sum(
                    (each.instance, each.token) == (instance, token)
                    for each in seams.peers_of(router).values()
                )
                > 1
            ):
                self._world.complain(f"link {peer} does not take over from its node's earlier one")
            self._check_detach_reasons(router, out)
            return peer, out

        with ExitStack() as stack:
            stack.enter_context(mock.patch.object(Router, "handle", recording_handle))
            stack.enter_context(mock.patch.object(Router, "connect", recording_connect))
            for name in CALLED_FOR_A_PEER:
                recording = self._recording(getattr(Router, name))
                stack.enter_context(mock.patch.object(Router, name, recording))
            yield

    @contextmanager
    def _drain_hooks(self) -> Iterator[None]:
        run, hold, caught_up = Drain.run, seams.hold, Dispatcher.caught_up

        def recording_hold(drain: Drain) -> None:
            for router in seams.graphs_of(drain):
                self._held[router] = {publisher.key for publisher in router.routes.publishers.values()}
            hold(drain)

        def recording_caught_up(dispatcher: Dispatcher, link: Link) -> None:
            self._caught_up.add(link)
            caught_up(dispatcher, link)

        async def recording_run(drain: Drain, timeout_sec: float) -> None:
            links = _whole(seams.links_of(drain))
            await run(drain, timeout_sec)
            self._check_goodbye_sent(links)

        with (
            mock.patch.object(Drain, "_hold", recording_hold),
            mock.patch.object(Dispatcher, "caught_up", recording_caught_up),
            mock.patch.object(Drain, "run", recording_run),
        ):
            yield

    def _recording(self, method: Callable[..., list[Delivery]]) -> Callable[..., list[Delivery]]:
        def recording(router: Router, *peer: int) -> list[Delivery]:
            out = method(router, *peer)
            self._check_detach_reasons(router, out)
            return out

        return recording

    def check(self) -> None:
        """Check the servers and nodes that are leaving."""
        for server in self._retired:
            if server.pool is not None:
                self._world.complain(
                    f"the server {server.key} of {server.node_name} gets calls after its RETIRE"
                )
        for member in self._world.members:
            if not member.alive:
                continue
            context = context_of(member.node)
            channel = context.link.channel
            if not context.stopping or channel is None or channel.session.state is not State.OPEN:
                continue
            for service in member.services:
                if (
                    endpoint_of(service).running
                    and not service.destroyed
                    and (channel, service.id) not in self._retire_sent
                ):
                    self._world.complain(f"{member.host}!{service.srv_name} stops, and does not send RETIRE")

    def _record_retired(self, router: Router, peer: int, frame: frames.Retire) -> None:
        record = seams.peers_of(router).get(peer)
        server = None if record is None else record.endpoints.get(frame.id)
        if isinstance(server, ServiceRecord):
            self._retired.add(server)

    def _record_reached(self, router: Router, batch: frames.Batch) -> None:
        publisher = router.routes.publishers.get(batch.publisher)
        if publisher is not None:
            reached, key = self._world.journal.reached, (self._url(router), publisher.gid)
            reached[key] = max(reached.get(key, 0), publisher.next_sequence)

    def _url(self, router: Router) -> str:
        """Return the URL of the broker that a router belongs to."""
        if router not in self._urls:
            self._urls[router] = next(
                process.url
                for process in self._world.brokers
                if process.broker is not None and router in dispatcher_of(process.broker).joined
            )
        return self._urls[router]

    def _check_detach_reasons(self, router: Router, out: list[Delivery]) -> None:
        """Readers wait for publishers that are suspended, and for no others."""
        for delivery in out:
            frame = _detached(delivery)
            if frame is None:
                continue
            publisher = router.routes.publishers.get(frame.publisher)
            silent = publisher is not None and publisher.peer.suspended
            reader = seams.peers_of(router).get(delivery.peer)
            if frame.reason == DetachReason.SUSPENDED and not silent:
                self._world.complain(
                    f"readers are to wait for the publisher {frame.publisher}, which is gone"
                )
            if frame.reason == DetachReason.GONE and silent and reader is not None and not reader.suspended:
                self._world.complain(f"readers do not wait for the publisher {frame.publisher}: {frame}")

    # A broker that stops

    def _check_not_held(self, router: Router, peer: int, batch: frames.Batch) -> None:
        """Who has caught up with a stopping broker publishes no more.

        The rest of large messages may come, and of publishers that have been destroyed.
        """
        small = message_bytes(batch) < limits.FRAGMENT_BYTES
        departs = any(queue.publisher == batch.publisher for queue in self._departing)
        if batch.publisher in self._held.get(router, ()) and small and not departs:
            for link in self._caught_up:
                if link.router is router and link.peer == peer:
                    self._world.complain(f"{link} has been held, and publishes {batch.first_sequence}")

    def _check_goodbye_sent(self, links: list[Link]) -> None:
        """A stop leaves no link without a goodbye."""
        for link in links:
            if link.channel.connected and link.channel.session.state is State.OPEN:
                self._world.complain(f"{link} gets no GOODBYE from the broker that stops")


def _whole(links: Iterable[Link]) -> list[Link]:
    """Return those that are open, and not silent."""
    return [each for each in links if each.channel.session.state is State.OPEN and each.suspended_at is None]


def _is_suspended(router: Router, name: str) -> bool:
    """Tell whether a holder of a name is suspended."""
    return any(each.peer.suspended for each in seams.holders_of(router, name).values())


def _is_refused(delivery: Any) -> bool:
    frame = delivery.frame if isinstance(delivery, Send) else None
    return isinstance(frame, frames.Refused) and frame.code == ErrorCode.NAME_TAKEN


def _detached(delivery: Delivery) -> frames.Detached | None:
    if isinstance(delivery, Send):
        return delivery.frame if isinstance(delivery.frame, frames.Detached) else None
    if (
        isinstance(delivery, Enqueue)
        and isinstance(delivery.item, bytes)
        and delivery.item[OP_AT] == Op.DETACHED
    ):
        frame = decode(delivery.item)
        assert isinstance(frame, frames.Detached)
        return frame
    return None
