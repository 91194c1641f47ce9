"""Deliberate breakages of the product, one per promise, which the checks must find.

Each is a context manager; `BREAKAGES` maps them to the kind of history in which they are found.
"""

from __future__ import annotations

from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any, Final
from unittest import mock

import broker.routing.attachment_frames
import broker.routing.latched
import broker.routing.routes
import broker.routing.topics
import broker.serving.shared_memory
from actors.callbacks.deadlines import Deadlines
from actors.endpoints.client.endpoint import ClientEndpoint
from actors.endpoints.context import NodeContext
from actors.endpoints.publisher.endpoint import PublisherEndpoint
from actors.endpoints.service.endpoint import ServiceEndpoint
from actors.endpoints.subscription.consumer import Consumer
from actors.endpoints.subscription.credit import SubscriptionCredit
from actors.endpoints.subscription.endpoint import SubscriptionEndpoint
from actors.session.shared_memory import SharedMemory
from broker.routing.calls import Calls
from broker.routing.declarations import Declarations
from broker.routing.deliveries import Discard, Enqueue
from broker.routing.departed_queues import DepartedQueues
from broker.routing.graph import Graph
from broker.routing.node_names import NodeNames
from broker.routing.notices import Notices
from broker.routing.records import ClientRecord, PublisherRecord, Route, ServiceRecord, SubscriptionRecord
from broker.routing.router import Router
from broker.routing.services import Services
from broker.routing.stalls import Stalls
from broker.routing.topics import Topics
from broker.server import Broker
from broker.serving.drain import Drain
from broker.serving.link import Link
from broker.serving.shared_memory import LinkMemory
from proto.liveness import Liveness, PeerState
from proto.queues.batches import message_bytes
from proto.queues.outbox import Outbox
from proto.queues.publisher_queue import PublisherQueue
from proto.wire.codec import array_head
from proto.wire.frames import Replay, ReplyEntry
from proto.wire.references import References, Slot, shared_batch
from tests.proto.outboxes import Replays
from tests.seams import simulation as seams
from tests.simulation import faults, shared_memory
from tests.simulation.histories import History, live

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager

    from actors.session.attachments import Attachment
    from broker.routing.records import Endpoint, Peer
    from proto.aio.arena import Arena
    from proto.wire.frames import Batch, Reference
    from proto.wire.references import SharedBatch
    from tests.simulation.faults import Fault


def does_nothing(
    owner: Any, name: str, returned: object = None
) -> Callable[[], AbstractContextManager[object]]:
    """Return a breakage: this method does nothing."""
    return lambda: mock.patch.object(owner, name, return_value=returned)


def hides_counts(*kinds: type[Endpoint]) -> Callable[[], AbstractContextManager[object]]:
    """Return a breakage: endpoints of these kinds are not sent how many counterparts they have."""
    set_count = Notices.set_count

    def silent(notices: Notices, endpoint: Endpoint, count: int) -> None:
        set_count(notices, endpoint, count)
        if isinstance(endpoint, kinds):
            seams.forget_count(notices, endpoint)

    return lambda: mock.patch.object(Notices, "set_count", silent)


def among(
    breakage: Callable[[], AbstractContextManager[object]], network: Fault, processes: Fault
) -> Callable[[], AbstractContextManager[object]]:
    """Return the breakage in histories that only these faults befall: those in which it can show."""

    @contextmanager
    def broken() -> Iterator[None]:
        with (
            breakage(),
            mock.patch.object(faults, "OF_THE_NETWORK", (network,)),
            mock.patch.object(faults, "OF_PROCESSES", (processes,)),
        ):
            yield

    return broken


@contextmanager
def drops_in_silence() -> Iterator[None]:
    """A publisher queue does not count what it drops."""
    trim = PublisherQueue.trim

    def silent(queue: PublisherQueue) -> None:
        dropped = queue.dropped
        trim(queue)
        queue.dropped = dropped

    with mock.patch.object(PublisherQueue, "trim", silent):
        yield


@contextmanager
def forwards_twice() -> Iterator[None]:
    """The broker sends each batch twice."""
    deliver = Enqueue.deliver

    def twice(delivery: Enqueue, channel: Any) -> None:
        deliver(delivery, channel)
        if not isinstance(delivery.item, bytes):
            deliver(delivery, channel)

    with mock.patch.object(Enqueue, "deliver", twice):
        yield


@contextmanager
def loses_in_silence() -> Iterator[None]:
    """The broker does not count what a link that ends can no longer get."""
    with mock.patch.object(Enqueue, "lose"), mock.patch.object(Discard, "lose"):
        yield


@contextmanager
def takes_what_it_has_seen() -> Iterator[None]:
    """A subscription forgets what it has had from a publisher that comes back."""
    attached = SubscriptionEndpoint.attached

    def forgetful(subscription: SubscriptionEndpoint, attachment: Attachment) -> None:
        subscription.tracker.known.pop(attachment.gid, None)
        subscription.tracker.attachments.pop(attachment.gid, None)
        attached(subscription, attachment)

    with mock.patch.object(SubscriptionEndpoint, "attached", forgetful):
        yield


@contextmanager
def answers_somebody_else() -> Iterator[None]:
    """Of two replies that come together, each gets the other's body."""
    reply = Calls.reply

    def mixed(calls: Calls, server: Any, entries: tuple[ReplyEntry, ...]) -> None:
        bodies = [entry.body for entry in entries]
        swapped = zip(entries, [*bodies[1:], *bodies[:1]], strict=True)
        reply(calls, server, tuple(entry._replace(body=body) for entry, body in swapped))

    with mock.patch.object(Calls, "reply", mixed):
        yield


@contextmanager
def answers_twice() -> Iterator[None]:
    """The broker gives a request to its server twice."""
    requested = ServiceEndpoint.requested

    def twice(service: ServiceEndpoint, entries: Any) -> None:
        requested(service, entries)
        requested(service, tuple(entry._replace(call=entry.call + 2**40) for entry in entries))

    with mock.patch.object(ServiceEndpoint, "requested", twice):
        yield


@contextmanager
def latches_backwards() -> Iterator[None]:
    """Late joiners get the latched batches in the wrong order."""

    def backwards(*ends: Any) -> Replays:
        source, taken = broker.routing.latched.LatchedReplay(*ends), []
        while source.next_bytes():
            taken.append(source.pop())
        return Replays(taken[::-1])

    with mock.patch.object(broker.routing.attachment_frames, "LatchedReplay", backwards):
        yield


@contextmanager
def latches_too_little() -> Iterator[None]:
    """A late joiner does not get the first of the latched messages."""
    receive = SubscriptionEndpoint.receive

    def deaf(subscription: SubscriptionEndpoint, attachment: Attachment, batch: Batch | Replay) -> None:
        if not isinstance(batch, Replay):
            receive(subscription, attachment, batch)

    with mock.patch.object(SubscriptionEndpoint, "receive", deaf):
        yield


@contextmanager
def declares_all_as_live() -> Iterator[None]:
    """A publisher that sends latched messages again does not declare them as old."""
    declaration = PublisherEndpoint.declaration

    def young(publisher: PublisherEndpoint) -> Any:
        frame: Any = declaration(publisher)
        return frame._replace(live_sequence=frame.next_sequence)

    with mock.patch.object(PublisherEndpoint, "declaration", young):
        yield


@contextmanager
def keeps_all_like_one() -> Iterator[None]:
    """The broker keeps one message, whatever a subscription asks for."""

    def shallow(route: Route) -> None:
        route.queue.depth = 1

    with mock.patch.object(Route, "_update_depth", shallow):
        yield


@contextmanager
def never_judges() -> Iterator[None]:
    """Nobody is ever taken for silent."""
    with mock.patch.object(Liveness, "check", return_value=PeerState.ALIVE):
        yield


@contextmanager
def runs_concurrently() -> Iterator[None]:
    """Callbacks do not wait for each other."""
    begin = SubscriptionEndpoint.__init__

    def concurrent(subscription: SubscriptionEndpoint, *arguments: Any, **options: Any) -> None:
        begin(subscription, *arguments, **{**options, "concurrent": True})

    with mock.patch.object(SubscriptionEndpoint, "__init__", concurrent):
        yield


@contextmanager
def takes_any_name() -> Iterator[None]:
    """The broker lets two nodes have one name."""
    with mock.patch.object(NodeNames, "claim"):
        yield


@contextmanager
def miscounts_a_break() -> Iterator[None]:
    """A subscription does not count what a broken link has cost."""
    attached = SubscriptionEndpoint.attached

    def silent(subscription: SubscriptionEndpoint, attachment: Attachment) -> None:
        before = subscription.tracker.lost_on_break
        attached(subscription, attachment)
        subscription.tracker.lost_on_break = before

    with mock.patch.object(SubscriptionEndpoint, "attached", silent):
        yield


@contextmanager
def does_not_count_gaps() -> Iterator[None]:
    """A subscription does not count what the broker has dropped."""
    receive = SubscriptionEndpoint.receive

    def silent(subscription: SubscriptionEndpoint, attachment: Attachment, batch: Batch | Replay) -> None:
        before = subscription.tracker.lost
        receive(subscription, attachment, batch)
        subscription.tracker.lost = before

    with mock.patch.object(SubscriptionEndpoint, "receive", silent):
        yield


@contextmanager
def has_no_ceiling() -> Iterator[None]:
    """However much waits for a link, nothing goes."""
    with mock.patch.object(Outbox, "drop_from_fullest"), mock.patch.object(Link, "fail_if_over_limit"):
        yield


@contextmanager
def relies_on_the_gone() -> Iterator[None]:
    """A broker goes on checking links that are gone."""
    remove = seams.remove_peer

    def forgetful(router: Router, peer: Peer, reason: str) -> None:
        remove(router, peer, reason)
        router.relied_on.add(peer.id)

    with mock.patch.object(Router, "_remove_peer", forgetful):
        yield


@contextmanager
def remembers_suspensions() -> Iterator[None]:
    """The graph keeps the keys of those that never came back."""
    remove = Graph.remove

    def keeping(graph: Graph, endpoint: Endpoint, *, suspended: bool = False) -> None:
        before = {key: entry for key, entry in seams.suspended_entries(graph).items() if key == endpoint.key}
        remove(graph, endpoint, suspended=suspended)
        seams.suspended_entries(graph).update(before)

    with mock.patch.object(Graph, "remove", keeping):
        yield


@contextmanager
def leaves_its_check() -> Iterator[None]:
    """A broker that stops leaves a task behind."""

    async def nothing(_: Broker) -> None:
        return

    with mock.patch.object(Broker, "_stop_check", nothing):
        yield


@contextmanager
def restores_nobody() -> Iterator[None]:
    """A link that was suspended stays out of the graph."""
    with mock.patch.object(Router, "restore", return_value=[]):
        yield


@contextmanager
def holds_nobody() -> Iterator[None]:
    """A broker that stops lets its publishers go on."""
    with mock.patch.object(Topics, "hold"):
        yield


@contextmanager
def stops_in_silence() -> Iterator[None]:
    """A node that stops does not announce that its servers take no more calls."""
    retire = ServiceEndpoint.retire

    def silent(service: ServiceEndpoint) -> None:
        if not service.running:
            retire(service)

    with mock.patch.object(ServiceEndpoint, "retire", silent):
        yield


@contextmanager
def reports_all_as_gone() -> Iterator[None]:
    """Readers of a suspended publisher get DETACHED with GONE."""
    with mock.patch.object(broker.routing.routes, "DetachReason", mock.Mock(SUSPENDED=0, GONE=0)):
        yield


@contextmanager
def reports_all_as_suspended() -> Iterator[None]:
    """Readers of a publisher that has gone for good get DETACHED with SUSPENDED."""
    with mock.patch.object(broker.routing.routes, "DetachReason", mock.Mock(SUSPENDED=1, GONE=1)):
        yield


@contextmanager
def forgets_its_own() -> Iterator[None]:
    """A broker does not know the node again whose earlier link is still there."""
    connect = Router.connect

    def forgetful(router: Router, instance: bytes, token: bytes) -> Any:
        seams.forget_instance(router, instance)
        return connect(router, instance, token)

    with mock.patch.object(Router, "connect", forgetful):
        yield


@contextmanager
def matches_strict_pairs() -> Iterator[None]:
    """A broker takes no endpoint for strict."""
    with mock.patch.object(broker.routing.topics, "_is_strict", return_value=False):
        yield


@contextmanager
def keeps_names_of_the_silent() -> Iterator[None]:
    """A broker keeps a name for a node that is suspended."""
    make = seams.make_node

    def loyal(declarations: Declarations, peer: Peer, frame: Any, key: int) -> Any:
        holders = seams.name_holders(declarations, frame.name)
        if not holders:
            return make(declarations, peer, frame, key)
        with mock.patch.multiple(next(iter(holders.values())).peer, suspended=False, names_released=False):
            return make(declarations, peer, frame, key)

    with mock.patch.object(Declarations, "_make_node", loyal):
        yield


@contextmanager
def stops_without_drain() -> Iterator[None]:
    """A broker that stops drops everything at once."""

    async def nothing(_: Drain, timeout_sec: float) -> None:
        return

    with mock.patch.object(Drain, "run", nothing):
        yield


@contextmanager
def waits_for_ever() -> Iterator[None]:
    """A broker never suspends the credit of a reader that stalls."""
    with mock.patch.object(Stalls, "check", return_value=[]):
        yield


@contextmanager
def in_small_arenas(breakage: Callable[[], AbstractContextManager[object]]) -> Iterator[None]:
    """Have the breakage where slots are soon used again, and readers are referred to many of them."""
    with (
        breakage(),
        mock.patch.object(shared_memory, "ARENA_BYTES", (shared_memory.MIB,)),
        mock.patch.object(shared_memory, "AHEAD_BYTES", (8 * shared_memory.MIB,)),
        mock.patch.object(shared_memory, "COPIES", (True,)),
    ):
        yield


@contextmanager
def releases_while_it_is_read() -> Iterator[None]:
    """The broker releases slots that readers have not released."""
    refer = References.refer

    def early(references: References, batch: SharedBatch) -> bytes:
        raw = refer(references, batch)
        if seams.belongs_to_broker(references):
            slot = batch.slot
            other = Slot(slot.arena, slot.memory, slot.offset, slot.generation, lambda _: None)
            seams.replace_newest(
                references, shared_batch(other, batch[:6], batch.start, message_bytes(batch))
            )
        return raw

    with mock.patch.object(References, "refer", early):
        yield


@contextmanager
def takes_what_was_written_later() -> Iterator[None]:
    """Besides, readers do not compare generations."""

    def unchecked(arena: Arena, reference: Reference) -> bytes:
        start = reference.offset + reference.start
        return array_head(reference.length) + arena.memory[start : start + reference.size]

    with releases_while_it_is_read(), mock.patch.object(shared_memory, "read_copy", unchecked):
        yield


@contextmanager
def loses_references() -> Iterator[None]:
    """A node does not take what a reference refers to, and counts nothing."""
    receive = SharedMemory.receive

    def lossy(memory: SharedMemory, frame: Reference) -> Batch | None:
        batch = receive(memory, frame)
        return None if seams.received_number(memory) % 3 == 0 else batch

    with mock.patch.object(SharedMemory, "receive", lossy):
        yield


@contextmanager
def releases_late() -> Iterator[None]:
    """A node releases a slot only with the next one that it releases."""
    read_finished = SharedMemory.read_finished

    def late(memory: SharedMemory) -> None:
        released = seams.released_slots(memory)
        if len(released) > 1:
            last = released.pop()
            read_finished(memory)
            released.append(last)

    with mock.patch.object(SharedMemory, "read_finished", late):
        yield


BREAKAGES: Final[dict[str, tuple[Callable[[], AbstractContextManager[object]], bool]]] = {
    "strict endpoints match no incompatible ones": (matches_strict_pairs, True),
    "order of latched messages": (latches_backwards, True),
    "latched messages come": (latches_too_little, True),
    "latched messages are kept": (does_nothing(broker.routing.routes, "latch", 0), True),
    "latched messages outlive a broker": (
        among(does_nothing(PublisherEndpoint, "_resend_retained"), faults.drop, faults.crash_broker),
        False,
    ),
    "latched messages are for those who want them": (
        among(declares_all_as_live, faults.drop, faults.crash_broker),
        False,
    ),
    "at most once": (forwards_twice, True),
    "at most once across a reconnect": (takes_what_it_has_seen, False),
    "drops are counted": (drops_in_silence, False),
    "depth in the broker and the publisher": (does_nothing(PublisherQueue, "trim"), False),
    "links have a ceiling": (has_no_ceiling, False),
    "depth in the node": (does_nothing(Consumer, "_trim"), True),
    "KEEP_ALL loses nothing": (keeps_all_like_one, True),
    "gaps are counted": (does_not_count_gaps, False),
    "breaks are counted": (miscounts_a_break, False),
    "links that end are accounted for": (loses_in_silence, False),
    "a reader that stalls is not waited for": (waits_for_ever, True),
    "credit comes": (does_nothing(SubscriptionCredit, "consumed"), True),
    "replies go to their caller": (answers_somebody_else, True),
    "requests come once": (answers_twice, True),
    "deadlines end calls": (does_nothing(Deadlines, "_expire_due"), True),
    "handlers of callers that give up are cancelled": (does_nothing(ClientEndpoint, "_withdraw"), True),
    "calls to a server that goes end": (does_nothing(Calls, "server_left"), True),
    "the silent are noticed": (never_judges, False),
    "names are unique": (takes_any_name, True),
    "the graph is right": (does_nothing(Graph, "remove"), False),
    "matching is pushed": (hides_counts(PublisherRecord, SubscriptionRecord), True),
    "servers are pushed": (hides_counts(ServiceRecord, ClientRecord), True),
    "callbacks run one at a time": (runs_concurrently, True),
    "errors of callbacks are counted": (does_nothing(NodeContext, "callback_failed"), True),
    "links that are gone are forgotten": (relies_on_the_gone, True),
    "suspensions are forgotten": (remembers_suspensions, False),
    "queues that are empty are forgotten": (does_nothing(DepartedQueues, "_drop_if_empty"), True),
    "a stopped broker leaves nothing": (leaves_its_check, True),
    "the suspended come back": (among(restores_nobody, faults.freeze, faults.stop), False),
    "those that are gone are not waited for": (reports_all_as_suspended, False),
    "the suspended are waited for": (reports_all_as_gone, False),
    "a stopping server gets no more calls": (
        among(does_nothing(Services, "retire"), faults.drop, faults.stop),
        False,
    ),
    "a stopping server sends RETIRE": (among(stops_in_silence, faults.drop, faults.stop), False),
    "a node takes its own name back": (among(forgets_its_own, faults.partition, faults.drop), False),
    "the suspended give way to their name's next bearer": (
        among(keeps_names_of_the_silent, faults.drop, faults.usurp),
        False,
    ),
    "slots come back from readers": (does_nothing(SharedMemory, "_release"), True),
    "slots come back from the broker": (does_nothing(LinkMemory, "_send_released"), True),
    "arenas are forgotten": (does_nothing(broker.serving.shared_memory.SharedMemory, "forget"), False),
    "queues go on after a release": (does_nothing(LinkMemory, "released"), True),
    "nobody takes what was written later": (partial(in_small_arenas, takes_what_was_written_later), False),
    "slots are kept while they are read": (partial(in_small_arenas, releases_while_it_is_read), True),
    "references are not lost": (loses_references, True),
    "slots come back in time": (releases_late, True),
    "a stopping broker drains": (stops_without_drain, False),
    "a stopping broker holds its publishers": (holds_nobody, False),
}
"""By promise: how to break it, and whether calm histories show it."""


def live_with_a_breakage(seed: int, *, calm: bool) -> History:
    """Live through a history in which the broker sends each batch twice; for a soak that must find it."""
    with forwards_twice():
        return live(seed, calm=calm, until_complaint=True)
