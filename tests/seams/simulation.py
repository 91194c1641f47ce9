"""What the simulation reads or breaks inside brokers, nodes and loops.

Its checks look for what is left behind, and its breakages show that they would find it: neither has a use for
anybody else, so that no public name is made for them.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any, Final

from actors.endpoints.endpoint import endpoint_of
from broker.routing.declarations import Declarations
from broker.routing.router import Router
from broker.serving.drain import Drain

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actors import Client, Publisher, Subscription
    from actors.endpoints.events import SubscriptionEvents
    from actors.session.attachments import Attachments
    from actors.session.shared_memory import SharedMemory
    from broker.mesh.imports import MeshImports
    from broker.mesh.mesh import Mesh
    from broker.routing.departed_queues import DepartedQueues
    from broker.routing.graph import Graph
    from broker.routing.notices import Notices
    from broker.routing.records import Endpoint, NodeRecord, Peer
    from broker.serving.link import Link
    from proto.aio.arena import Arena
    from proto.aio.channel import Channel
    from proto.queues.outbox import Outbox
    from proto.wire.references import References, SharedBatch

remove_peer: Final = Router._remove_peer
make_node: Final = Declarations._make_node
hold: Final = Drain._hold


def is_strict(publisher: Publisher[Any], subscription: Subscription[Any]) -> bool:
    """Return whether one of two endpoints matches compatible QoS only; they say it in their declarations."""
    return bool(endpoint_of(publisher)._strict_qos or endpoint_of(subscription)._strict_qos)


def wrap_resend(publisher: Publisher[Any], wrap: Callable[[Callable[[], None]], Callable[[], None]]) -> None:
    """Replace what a publisher does to send its retained messages again."""
    endpoint = endpoint_of(publisher)
    endpoint._resend_retained = wrap(endpoint._resend_retained)  # type: ignore[method-assign]


def subscription_events(subscription: Subscription[Any]) -> SubscriptionEvents:
    """Return the events of a subscription with their counts, without callbacks for them."""
    return endpoint_of(subscription)._events


def attached_publishers(attachments: Attachments) -> int:
    """Return to how many publishers' messages anything is still attached."""
    return sum(map(len, attachments._attachments.values()))


def pending_deadlines(client: Client[Any, Any]) -> int:
    """Return how many deadlines of a client's calls are still to come."""
    return len(endpoint_of(client)._deadlines._live)


def kept_deadlines(client: Client[Any, Any]) -> int:
    """Return how many deadlines are kept, those of finished calls included."""
    return len(endpoint_of(client)._deadlines._heap)


def peer_address(channel: Channel) -> str | None:
    """Return the host at the other end of a simulated channel; None without a connection."""
    return None if channel._transport is None else channel._transport.get_extra_info("peername")[0]


def is_closing(channel: Channel) -> bool:
    """Return whether a channel's transport is closing; the channel hears of it in the next loop turn."""
    return channel._transport is not None and channel._transport.is_closing()


def holders_of(router: Router, name: str) -> dict[int, NodeRecord]:
    """Return the nodes that have a name, suspended ones included."""
    return name_holders(router.declarations, name)


def name_holders(declarations: Declarations, name: str) -> dict[int, NodeRecord]:
    """Return the same as `holders_of`."""
    return declarations._names.holders(name)


def peers_of(router: Router) -> dict[int, Peer]:
    """Return all peers of a router by their numbers."""
    return router._peers


def graphs_of(drain: Drain) -> Iterable[Router]:
    """Return the graphs of a broker that stops."""
    return drain._dispatcher.joined


def links_of(drain: Drain) -> Iterable[Link]:
    """Return the links of a broker that stops."""
    return drain._dispatcher.links


def open_transfers(outbox: Outbox) -> int:
    """Return how many large messages have been begun."""
    return len(outbox.transfers._open)


def forget_empty(departed: DepartedQueues) -> None:
    """Forget queues that are empty: that may wait until there are more of them."""
    departed._forget_empty()


def parts_of(mesh: Mesh) -> list[object]:
    """Return those parts of a mesh that hold nothing without nodes."""
    return [mesh._exports, mesh._calls, mesh.wanted]


def ids_by_broker(mesh: Mesh) -> dict[int, Any]:
    """Return the ids that are in use for endpoints of other brokers, by broker."""
    return {number: known.ids for number, known in mesh._imports._brokers.items()}


def shared_bytes_held(memory: SharedMemory) -> int:
    """Return how many bytes of a node's arena its broker holds."""
    return 0 if memory._references is None else memory._references.held_bytes


def arena_of(memory: SharedMemory) -> Arena | None:
    """Return a node's own arena."""
    return memory._arena


# What breakages break


def number_generations(arena: Arena, number: int) -> None:
    """Let the generations of an arena begin with a known number: their length in frames must not vary."""
    arena._generation = number << 40


def forget_count(notices: Notices, endpoint: Endpoint) -> None:
    """Let an endpoint not be sent how many counterparts it has."""
    notices._changed.pop(endpoint, None)


def suspended_entries(graph: Graph) -> dict[int, Endpoint]:
    """Return the suspended endpoints of a graph."""
    return graph._suspended


def forget_instance(router: Router, instance: bytes) -> None:
    """Let a router not know the node of an earlier link again."""
    router._instances.pop(instance, None)


def belongs_to_broker(references: References) -> bool:
    """Return whether references are a broker's: only what it holds is limited."""
    return references._max_held_bytes < sys.maxsize


def replace_newest(references: References, batch: SharedBatch) -> None:
    """Put another batch in the place of the one that was referred to last."""
    references._held[references._count - 1] = batch


def received_number(memory: SharedMemory) -> int:
    """Return the number of the next reference that a node expects."""
    return memory._number


def released_slots(memory: SharedMemory) -> list[int]:
    """Return the slots that a node has still to release."""
    return memory._released


def set_version(imports: MeshImports, broker: int, version: int) -> None:
    """Let a mesh believe that it knows a broker up to a version."""
    known = imports._brokers.get(broker)
    if known is not None:
        known.version = version
