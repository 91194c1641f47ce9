"""Checks at the end of every history, when all faults are healed."""

from __future__ import annotations

import asyncio
from collections import deque
from typing import TYPE_CHECKING, Final

import actors
from actors.endpoints.endpoint import endpoint_of
from broker.mesh.engine.channel import MeshChannel
from tests.seams import simulation as seams
from tests.seams.brokers import dispatcher_of, remote_endpoints
from tests.seams.nodes import context_of, link_of
from tests.simulation.member import LARGE_BYTES
from tests.simulation.records import Ask, keep_all, match
from tests.simulation.shared_memory import check_slots

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from actors.endpoints.service.service import ServiceServer
    from actors.endpoints.subscription.subscription import Subscription
    from broker.mesh.mesh import Mesh
    from broker.server import Broker
    from tests.simulation.member import Member
    from tests.simulation.records import Note, PublisherHistory, SubscriptionHistory
    from tests.simulation.world import World

IDLE_TIMEOUT_SEC: Final = 200.0
"""A healed world has come to rest by then: slow readers have read, links are back."""

FRESH_MESSAGES: Final = 30
"""So often a message may be lost for a good reason before one is received."""

SETTLING_SEC: Final = 1.0
"""Before a message is published: a link that has just come back may not have declared everything yet."""

FRESH_PAUSE_SEC: Final = 2.0
"""Between two of them: a broker sends a slow KEEP_ALL reader its earlier messages first, which may expire."""

PAUSE_SEC: Final = 0.01
"""Between two looks at what is awaited."""

REACTION_TIMEOUT_SEC: Final = 30.0
"""Anything asked of a world at rest has happened by then."""

COLLECTIONS: Final = (dict, list, set, deque)

LATEST: Final = actors.QoSProfile(
    history=actors.HistoryPolicy.KEEP_ALL, durability=actors.DurabilityPolicy.TRANSIENT_LOCAL
)


async def check(world: World) -> None:
    """Check everything, and end the world."""
    await _wait_until_idle(world)
    await world.end_stalls()
    await _check_delivery(world)
    await _check_calls_are_served(world)
    await _check_graph(world)
    await _check_late_joiners(world)
    await _wait_until_idle(world)
    _check_outboxes_empty(world)
    check_slots(world)
    _check_calls_ended(world)
    for sub in _subscriptions(world):
        _check_sums(world, sub)
    _check_error_counts(world)
    world.steps.check_all()
    await _stop_all(world)


def _publishers(world: World) -> Iterator[PublisherHistory]:
    for member in world.members:
        yield from member.publishers


def _subscriptions(world: World) -> Iterator[SubscriptionHistory]:
    for member in world.members:
        yield from member.subscriptions


async def _until(world: World, unmet: Callable[[], str], limit: float) -> None:
    """Wait until nothing is unmet any more; complain about what is after `limit`."""
    end = world.loop.time() + limit
    while unmet():
        if world.loop.time() > end:
            world.complain(unmet())
            return
        end += await _pause(world)


async def _pause(world: World) -> float:
    """Wait a moment; return how much longer a limit is by that.

    What thousands of large messages take on a slow network between brokers counts for no limit.
    """
    await asyncio.sleep(PAUSE_SEC)
    return PAUSE_SEC if world.backed_up else 0.0


async def _wait_until_idle(world: World) -> None:
    """Everybody is connected, and nothing waits anywhere.

    Where a link may hold less than a large message, each that must not be dropped ends the links of its
    readers, and one that is latched does so again and again: after a while the brokers get other limits.
    """
    if world.max_link_bytes < LARGE_BYTES[-1]:
        end = world.loop.time() + IDLE_TIMEOUT_SEC
        while world.loop.time() < end and next(_not_idle(world), ""):
            await asyncio.sleep(PAUSE_SEC)
        if next(_not_idle(world), ""):
            for process in world.brokers:
                process.raise_ceiling()
    await _until(world, lambda: next(_not_idle(world), ""), IDLE_TIMEOUT_SEC)
    await asyncio.sleep(5)


def _not_idle(world: World) -> Iterator[str]:
    for member in world.members:
        if not member.alive:
            yield f"{member.host} is dead"
        if not member.node.connected:
            yield f"{member.host} does not connect"
        for name, waiting in _waiting(member):
            if waiting:
                yield f"{name} still has {waiting} waiting"
    for broker in (each.broker for each in world.brokers if each.alive and each.broker is not None):
        yield from _unsent(broker)
    if world.backed_up:
        yield "a network between brokers still has messages"


def _unsent(broker: Broker) -> Iterator[str]:
    for link in dispatcher_of(broker).links:
        if link.channel.outbox.has_more or link.channel.outbox.blocked:
            yield f"{link} still has messages that may be sent"
    if any(each.has_unsent for each in dispatcher_of(broker).mesh_channels.values()):
        yield "a broker still has messages for others"


def _waiting(member: Member) -> Iterator[tuple[str, int]]:
    for pub in member.publishers:
        yield pub.name, pub.publisher.queued
    for queue in context_of(member.node).departing:
        yield f"{member.host}: a destroyed publisher", queue.pending
    for sub in member.subscriptions:
        yield sub.name, sub.subscription.queued
    for service in member.services:
        yield f"{member.host}!{service.srv_name}", service.pending
    for _, client in member.clients:
        yield f"{member.host}?{client.srv_name}", client.pending


async def _check_delivery(world: World) -> None:
    """After healing a fresh message of every publisher reaches every subscription that it matches."""
    for pub in _publishers(world):
        there = [sub for sub in _subscriptions(world) if sub.subscription.topic == pub.publisher.topic]
        readers = [sub for sub in there if match(pub, sub)]

        def unmatched(pub: PublisherHistory = pub, readers: list[SubscriptionHistory] = readers) -> str:
            count = pub.publisher.get_subscription_count()
            return "" if count == len(readers) else f"{pub.name} matches {count} of {len(readers)}"

        await _until(world, unmatched, REACTION_TIMEOUT_SEC)
        for _ in range(FRESH_MESSAGES):
            missing, excused = await _publish_fresh(world, pub, readers)
            if not excused:
                break
            await asyncio.sleep(FRESH_PAUSE_SEC)
        if missing:
            world.complain(missing)
    await asyncio.sleep(1)


async def _publish_fresh(
    world: World, pub: PublisherHistory, readers: list[SubscriptionHistory]
) -> tuple[str, bool]:
    """Publish a message and wait for it, while those before it arrive: credit may let few pass at a time.

    Returns:
        Which subscription has not received it, and whether it may have been lost: a link broke meanwhile, or
        just before, since tiny ceilings may still end links that get a backlog, or a message was older than
        its lifespan.
    """

    def excuses() -> list[int]:
        links = [
            endpoint_of(pub.publisher).context.link,
            *(endpoint_of(sub.subscription).context.link for sub in readers),
        ]
        return [*(link.connections for link in links), *(sub.subscription.expired for sub in readers)]

    def not_received() -> str:
        for sub in readers:
            numbers = sub.numbers.get(pub.name)
            if not numbers or numbers[-1] != number:
                last = numbers[-1] if numbers else "nothing"
                return f"{sub.name} does not receive {pub.name} #{number}, but {last}"
        return ""

    before = excuses()
    await asyncio.sleep(SETTLING_SEC)
    await world.members[0].publish_one(pub, 10)
    number = pub.published - 1
    missing = await _until_stuck(world, not_received, lambda: excuses() == before)
    return missing, bool(missing) and excuses() != before


async def _check_calls_are_served(world: World) -> None:
    """After healing every client reaches a server, or learns at once that there is none."""
    for member in world.members:
        for name, client in member.clients:
            servers = sum(service.srv_name == client.srv_name for service in _services(world))
            if client.service_is_ready() != bool(servers):
                world.complain(f"{member.host}: {client.peers} servers of {name}, there are {servers}")
            began = world.loop.time()
            try:
                await client.call(
                    Ask.Request(caller=f"check {member.host}", number=member.next_number()), 20.0
                )
                ready = True
            except actors.ServiceUnavailable:
                ready = False
            except actors.ServiceTimeout:
                world.complain(f"{member.host}: a fresh call of {name} timed out")
                continue
            if ready != bool(servers) or (not ready and world.loop.time() - began > 2):
                took = world.loop.time() - began
                world.complain(f"{member.host}: a fresh call of {name} gave {ready} in {took:.3f} s")


def _services(world: World) -> Iterator[ServiceServer[Ask.Request, Ask.Response]]:
    for member in world.members:
        yield from member.services


async def _check_graph(world: World) -> None:
    """The graph names each live node once, and nobody else."""
    right = sorted(member.node.get_fully_qualified_name() for member in world.members)
    for member in world.members:
        names = [f"{namespace.rstrip('/')}/{name}" for name, namespace in await _names(member)]
        if sorted(names) != right:
            world.complain(f"the graph of {member.host} has {sorted(names)}, there are {right}")


async def _names(member: Member) -> list[tuple[str, str]]:
    return await member.node.get_node_names_and_namespaces()


async def _check_late_joiners(world: World) -> None:
    """A late joiner gets the latched messages, in order, once."""
    latecomer = world.members[-1]
    topics = sorted({pub.publisher.topic for pub in _publishers(world)})
    late = {topic: latecomer.subscribe_to(topic, qos=LATEST, kind="plain") for topic in topics}

    def unmet() -> str:
        for pub in _publishers(world):
            joiner = late[pub.publisher.topic]
            numbers = joiner.numbers.get(pub.name, [])
            right = list(range(pub.published - pub.latched, pub.published)) if match(pub, joiner) else []
            lost = world.lost_between_brokers(pub, joiner)
            # A broker that has lost some keeps older ones instead.
            complete = lost and not set(right) - set(numbers) - lost
            if numbers != right and not complete:
                received, expected = (f"{list_[:5]}… ({len(list_)})" for list_ in (numbers, right))
                return f"a late joiner receives {received} of {pub.name}, not {expected}"
        return ""

    await _until_stuck(world, unmet)
    await asyncio.sleep(1)
    if unmet():
        world.complain(unmet())


async def _until_stuck(
    world: World, problem: Callable[[], str], goes_on: Callable[[], bool] = lambda: True
) -> str:
    """Wait until there is no problem, or the same one for `REACTION_TIMEOUT_SEC`, or it does not go on.

    Returns:
        The problem that is left.
    """
    found, end = problem(), world.loop.time() + REACTION_TIMEOUT_SEC
    while found and goes_on() and world.loop.time() < end:
        end += await _pause(world)
        if found != (found := problem()):
            end = world.loop.time() + REACTION_TIMEOUT_SEC
    return found


def _check_calls_ended(world: World) -> None:
    for call in world.journal.calls:
        if call.ended is None:
            world.complain(f"{call.name} #{call.number}, begun at {call.began:.6f} s, never ended")


def _check_sums(world: World, sub: SubscriptionHistory) -> None:
    """What has come is what was published; the sums at every step count by what the subscription knows."""
    subscription = sub.subscription
    by_gid = {pub.publisher.gid: pub for pub in world.journal.publishers}
    for gid, first in sub.first.items():
        pub, attachment = by_gid[gid], endpoint_of(subscription).tracker.attachments.get(gid)
        if not match(pub, sub):
            world.complain(f"{sub.name} is attached to {pub.name}, although their QoS is incompatible")
        if not pub.gone and (attachment is None or attachment.expected != pub.published):
            covered = None if attachment is None else attachment.expected
            world.complain(f"{sub.name} covers {pub.name} up to {covered}, not {pub.published}")
        numbers = sub.numbers.get(pub.name, [])
        lossless = keep_all(subscription.qos_profile) and keep_all(pub.publisher.qos_profile)
        end = sub.ends[gid] if pub.gone else pub.published
        start = max(first, world.live_from(pub, sub))
        right = list(range(start, end))
        if world.calm and lossless and [n for n in numbers if n >= start] != right:
            world.complain(f"{sub.name} has lost something of {pub.name}, though both keep all")
    _check_event_counts(world, sub.name, subscription)
    if subscription.received != sum(map(len, sub.numbers.values())):
        world.complain(f"{sub.name} counts {subscription.received} messages, and has received others")
    if subscription.undecodable or (world.calm and subscription.lost_on_break):
        world.complain(f"{sub.name}: {subscription.undecodable=} {subscription.lost_on_break=}")


def _check_event_counts(world: World, name: str, subscription: Subscription[Note]) -> None:
    """Check that the events match the facts: who is matched, and whether each of them is alive."""
    matched = seams.subscription_events(subscription).matched.counts
    if matched[1] != subscription.peers or matched[0] < matched[1]:
        world.complain(f"{name} got events of {matched} matches, and has {subscription.peers}")
    alive, silent = seams.subscription_events(subscription).liveliness.counts
    if alive + silent != subscription.peers or min(alive, silent) < 0:
        world.complain(f"{name}: {alive} publishers alive, {silent} not, of {subscription.peers}")


def _check_error_counts(world: World) -> None:
    """Callbacks that have raised are counted, and their node lives on."""
    for member in world.members:
        if member.node.callback_errors < member.raised:
            world.complain(f"{member.host} counts {member.node.callback_errors} errors of {member.raised}")


def _check_outboxes_empty(world: World) -> None:
    """At rest every outbox is empty, in fact and by its own counters."""
    brokers = [each.broker for each in world.brokers if each.alive and each.broker is not None]
    channels = [link.channel for broker in brokers for link in dispatcher_of(broker).links]
    to_mesh = [each for broker in brokers for each in dispatcher_of(broker).mesh_channels.values()]
    for channel in (*to_mesh, *channels, *(link_of(member.node).channel for member in world.members)):
        assert channel is not None
        outbox = channel.outbox
        held = (
            outbox.urgent_bytes,
            outbox.ordered_bytes,
            outbox.bulk_bytes,
            outbox.replay_bytes,
            len(outbox.large_calls),
            seams.open_transfers(outbox),
        )
        if any(held):
            world.complain(f"an outbox at rest holds {held}")


def _check_broker_empty(world: World, broker: Broker) -> None:
    """Without nodes a broker holds nothing."""
    stats = broker.stats()
    if stats.connections or stats.endpoints or stats.queued or stats.pending_calls:
        world.complain(f"without nodes the broker has {stats}")
    _check_empty(world, dispatcher_of(broker), "links", "handshaking", "_unflushed")
    _check_empty(world, dispatcher_of(broker).shared_memory, "arenas")
    for router, joined in dispatcher_of(broker).joined.items():
        if joined:
            world.complain(f"without nodes {len(joined)} links are joined")
        waiting = sum(not peer_queue.queue.empty for peer_queue in router.routes.peer_queues())
        if waiting:
            world.complain(f"without nodes messages wait in {waiting} publisher queues")
        departed = router.routes.departed
        seams.forget_empty(departed)  # it may wait with that for more of them
        parts: list[object] = [router.declarations, router.routes, router.topics, router.services]
        parts += [router.graph, departed]
        mesh = dispatcher_of(broker).mesh_channels.get(router)
        if mesh is None:
            parts.append(router)
        else:  # it is a peer of the router, and has sessions with other brokers
            assert isinstance(mesh, MeshChannel)
            parts += seams.parts_of(mesh.mesh)
            _check_mesh_empty(world, mesh.mesh)
        for part in parts:
            _check_empty(world, part, *(name for name in vars(part) if name != "_handlers"))


def _check_mesh_empty(world: World, mesh: Mesh) -> None:
    """Nothing is known of other brokers' endpoints, and none has broken a rule."""
    if remote_endpoints(mesh):
        world.complain("without nodes endpoints of other brokers are known")
    for number, ids in seams.ids_by_broker(mesh).items():
        if ids:
            world.complain(f"without nodes the broker {number} has {ids}")
    if mesh.rejected or mesh.counts()["refused"]:
        world.complain(f"brokers that keep the rules are rejected or refused: {mesh.counts()}")


def _check_empty(world: World, part: object, *names: str) -> None:
    """Of these attributes those that are collections are empty."""
    held = {name: getattr(part, name) for name in names}
    left = {name: what for name, what in held.items() if isinstance(what, COLLECTIONS) and what}
    if left:
        world.complain(f"without nodes the {type(part).__name__} holds {left}")


async def _stop_all(world: World) -> None:
    """Everything stops, and leaves nothing behind."""
    for member in world.members:
        await member.stop()
    await asyncio.sleep(5)
    brokers = [process for process in world.brokers if process.alive]
    for process in brokers:
        assert process.broker is not None
        _check_broker_empty(world, process.broker)
    for process in brokers:
        await process.stop()
    await asyncio.sleep(5)
    if world.network.open:
        world.complain(f"{len(world.network.open)} transports are still open")
    left = asyncio.all_tasks() - {asyncio.current_task()}
    if left:
        world.complain(f"tasks are left: {left}")
