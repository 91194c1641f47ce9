"""Invariants of the structures behind the sums: each total equals the sum of its parts.

Each function yields violations as text.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from broker.routing.records import ClientRecord, PublisherRecord, ServiceRecord, SubscriptionRecord
from proto import limits
from proto.queues.batches import held_bytes, message_bytes
from proto.queues.publisher_queue import ReplaySource
from proto.wire.fragments import is_large
from proto.wire.frames import Batch, Replay
from tests.seams.brokers import dispatcher_of, endpoint_keys
from tests.seams.nodes import link_of
from tests.seams.simulation import peers_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    import actors
    from broker.routing.records import Endpoint, Peer
    from broker.routing.router import Router
    from broker.server import Broker
    from proto.queues.outbox import Outbox
    from proto.queues.publisher_queue import PublisherQueue
    from proto.wire.frames import Buffer

Wrongs: TypeAlias = "Iterator[str]"


def of_broker(broker: Broker) -> Wrongs:
    """Check a broker: its graphs, and what waits for its links."""
    for router in dispatcher_of(broker).joined:
        yield from of_router(router)
    for link in dispatcher_of(broker).links:
        outbox = link.channel.outbox
        joined = link.router if link.channel.connected else None
        if link.router is not joined:
            continue  # it has failed with messages waiting, and leaves in the next loop turn
        queues = [] if joined is None else joined.routes.peer_queues()
        of_link = {id(each.queue): each.queue for each in queues if each.peer == link.peer}.values()
        yield from of_outbox(outbox, [queue for queue in of_link if not queue.scheduled])
        held = sum(queue.counted_bytes for queue in of_link)
        if outbox.held_bytes != held:
            yield f"an outbox counts {outbox.held_bytes} bytes of messages, its queues {held}"
        if link.channel.connected:
            for queue in outbox._ready:  # what its ceiling was compared with is what waits
                if queue.counted_bytes != queue.held_bytes:
                    yield f"a queue counts for {queue.counted_bytes} bytes and holds {queue.held_bytes}"


def of_suspensions(broker: Broker) -> Wrongs:
    """Check the suspended peers: in the graph as on its link."""
    for router, joined in dispatcher_of(broker).joined.items():
        for number, link in joined.items():
            peer = router.peer(number)
            if peer is not None and peer.suspended != (link.suspended_at is not None):
                yield f"{link} is silent since {link.suspended_at}, suspended: {peer.suspended}"


def of_node(node: actors.Node) -> Wrongs:
    """Check a node: what waits on its link."""
    channel = link_of(node).channel
    if channel is not None:
        yield from of_outbox(channel.outbox)


def of_router(router: Router) -> Wrongs:
    """Check a graph."""
    peers = list(peers_of(router).values())
    endpoints = [endpoint for peer in peers for endpoint in peer.endpoints.values()]
    there = [each for each in endpoints if not each.peer.suspended and not getattr(each, "retired", False)]
    if {endpoint.key for endpoint in there} != endpoint_keys(router):
        yield f"{len(there)} endpoints are there, and the graph has {len(router.graph)}"
    for endpoint in endpoints:
        yield from _of_endpoint(endpoint)
    for each in [*peers, *(broker for peer in peers for broker in peer.brokers.values())]:
        yield from _of_peer(each)
    yield from _of_calls(router, endpoints)
    for queue, *_ in router.routes.peer_queues():
        yield from of_queue(queue)


def _of_endpoint(endpoint: Endpoint) -> Wrongs:
    if isinstance(endpoint, PublisherRecord):
        readers = {
            (reader.peer.id, reader.id)
            for reader in endpoint.matched.values()
            if endpoint.opened
            and reader.key not in endpoint.unattached
            and not (reader.stalled and endpoint.waits_for_readers)
        }
        routed = {(peer, reader) for peer, route in endpoint.routes.items() for reader in route.subscriptions}
        if not endpoint.unattached <= endpoint.matched.keys():
            yield f"publisher {endpoint.key} waits for {endpoint.unattached}, not all of which match"
        if readers != routed:
            yield f"publisher {endpoint.key} is matched with {readers} and sends to {routed}"
        kept = endpoint.latched
        held = sum(map(held_bytes, kept)), sum(batch.length for batch in kept)
        if held != (endpoint.latched_bytes, endpoint.latched_messages):
            yield f"publisher {endpoint.key} keeps {held}, not {endpoint.latched_bytes} bytes"
    if isinstance(endpoint, PublisherRecord | SubscriptionRecord):
        if endpoint.peers != len(endpoint.matched):
            yield f"endpoint {endpoint.key} has {endpoint.peers} counterparts, not {len(endpoint.matched)}"
        if endpoint.peer.suspended and endpoint.matched:
            yield f"endpoint {endpoint.key} is suspended, and matched"


def _of_peer(peer: Peer) -> Wrongs:
    endpoints = [endpoint for endpoint in peer.endpoints.values() if endpoint.peer is peer]
    latched = sum(each.latched_bytes for each in endpoints if isinstance(each, PublisherRecord))
    if latched != peer.latched_bytes:
        yield f"peer {peer.id} has latched {peer.latched_bytes} bytes, its publishers {latched}"
    matched = sum(each.peers > 0 for each in endpoints)
    if matched != peer.matched:
        yield f"peer {peer.id} has {peer.matched} matched endpoints, not {matched}"
    pending = sum(len(each.pending) for each in endpoints if isinstance(each, ClientRecord))
    if pending != peer.pending_calls:
        yield f"peer {peer.id} has {peer.pending_calls} calls pending, its clients {pending}"
    owed = sum(len(each.pending) for each in endpoints if isinstance(each, ServiceRecord))
    if owed != peer.owed_calls:
        yield f"peer {peer.id} owes {peer.owed_calls} answers, its servers {owed}"


def _of_calls(router: Router, endpoints: list[Endpoint]) -> Wrongs:
    asked = sum(len(each.pending) for each in endpoints if isinstance(each, ClientRecord))
    owed = sum(len(each.pending) for each in endpoints if isinstance(each, ServiceRecord))
    if not asked == owed == router.calls.pending:
        yield f"{router.calls.pending} calls are pending: clients know of {asked}, servers of {owed}"


def of_queue(queue: PublisherQueue) -> Wrongs:
    """Check that a queue's counters match its content."""
    batches = [item for item in queue._queue if isinstance(item, Batch)]
    pending = sum(batch.length for batch in batches) - queue._skip
    if queue.pending != pending:
        yield f"a queue counts {queue.pending} messages and holds {pending}"
    size = sum(map(message_bytes, batches))
    if queue.pending_bytes != size:
        yield f"a queue counts {queue.pending_bytes} bytes of messages and holds {size}"
    others = [
        b"" if isinstance(item, ReplaySource) else item.payload if isinstance(item, Replay) else item
        for item in (*queue._front, *queue._queue, queue._leaving)
        if not isinstance(item, Batch | None)
    ]
    if queue.control_bytes != memory(others):
        yield f"a queue counts {queue.control_bytes} control bytes and holds {memory(others)}"
    count = sum(isinstance(item, Batch) for item in queue._queue)
    if queue._batches != count:
        yield f"a queue counts {queue._batches} batches in it and holds {count}"
    large = memory(item for item in others if is_large(item))
    if not large <= queue.bulk_bytes <= queue.control_bytes:
        yield f"a queue counts {queue.bulk_bytes} of {queue.control_bytes} bytes as large, and holds {large}"
    number = 0
    for item in queue._queue:
        if not isinstance(item, Batch):
            number = 0  # behind an ATTACHED a publisher that is back may send again what it sent before
        elif item.first_sequence < number:
            yield f"a queue holds {item.first_sequence} behind {number}"
        else:
            number = item.first_sequence + item.length


def memory(frames: Iterable[Buffer]) -> int:
    """Return what frames that are no batches count for while they wait."""
    return sum(len(frame) + limits.FRAME_OVERHEAD_BYTES for frame in frames)


def of_outbox(outbox: Outbox, without_credit: Iterable[PublisherQueue] = ()) -> Wrongs:
    """Check what waits on a link, without the publisher queues."""
    large = sum(queue.control_bytes for queue in outbox.large_calls.values())
    calls = [each if isinstance(each, tuple) else (each, None) for each in outbox._calls]
    small = memory(outbox._control) + memory(raw for raw, _ in calls)
    # A large answer without a name is in no table, only in the queue for its turn.
    unnamed = sum(
        queue.control_bytes for queue in outbox._ready if getattr(queue, "key", 0) is None and not queue.empty
    )
    behind = memory(outbox._after_calls.values())
    urgent = small + large + unnamed + behind
    if outbox.urgent_bytes != urgent:
        yield f"an outbox counts {outbox.urgent_bytes} urgent bytes and holds {urgent}"
    requests = [raw for raw, share in calls if share is not None]
    shared = [queue for queue in outbox._ready if getattr(queue, "share", None) is not None]
    held = memory(requests) + sum(queue.control_bytes for queue in shared)
    if outbox.shared_bytes != held:
        yield f"an outbox counts {outbox.shared_bytes} bytes of requests and holds {held}"
    if outbox.ordered_bytes < 0:
        yield f"an outbox counts {outbox.ordered_bytes} bytes in publisher queues"
    if outbox._after_calls.keys() - {endpoint for endpoint, _ in outbox.large_calls}:
        yield "the last word of an endpoint waits for nothing"
    bulk = sum(queue.bulk_bytes for queue in (*outbox._ready, *without_credit) if queue not in shared)
    if outbox.bulk_bytes + outbox.replay_bytes != bulk or outbox.undroppable_bytes < 0:
        yield f"an outbox counts {outbox.bulk_bytes + outbox.replay_bytes} bytes as large and holds {bulk}"
    for queue in outbox._ready:
        if not queue.scheduled:
            yield "a queue waits for its turn and does not know it"
