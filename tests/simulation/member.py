"""One simulated process: a node with random endpoints, and the tasks that use them."""

from __future__ import annotations

import asyncio
import math
from contextlib import contextmanager
from random import Random
from typing import TYPE_CHECKING, Any, Final

import actors
from actors.endpoints.endpoint import endpoint_of
from tests.simulation.network import on_host
from tests.simulation.records import Ask, CallHistory, Note, PublisherHistory, SubscriptionHistory

if TYPE_CHECKING:
    from collections.abc import Awaitable, Callable, Coroutine, Iterator

    from actors.endpoints.service.service import ServiceServer
    from tests.simulation.world import World

TOPICS: Final = ("red", "green", "blue")
LARGE_BYTES: Final = (70_000, 300_000)
SERVICES: Final = ("double", "twice")

SLACK_SEC: Final = 0.001
"""What a timed wait may take beyond its time: a loop's turns take no virtual time."""

STOP_SEC: Final = 15.0
"""A node stops within this, whatever its callbacks do."""

STRICT_SHARE: Final = 0.1
"""How many publishers and subscriptions match no incompatible ones."""

GONE: Final = "nobody"
"""Stands for the callback that runs when the process has ended."""

KINDS: Final = ("plain", "plain", "async", "slow", "calling", "beside", "iterate")
"""How subscriptions read."""


class Member:
    """A process that can be killed, stopped and started again. What it has is the same in each life."""

    def __init__(self, world: World, name: str, random: Random, url: str = "") -> None:
        self.world = world
        self.url = url or world.url
        self.name = name
        self.random = random
        self.host = name
        self.node: actors.Node
        self.publishers: list[PublisherHistory] = []
        self.subscriptions: list[SubscriptionHistory] = []
        self.clients: list[tuple[str, actors.Client[Ask.Request, Ask.Response]]] = []
        self.services: list[ServiceServer[Ask.Request, Ask.Response]] = []
        self.raised = 0
        """Times that a subscription's callback has raised in this life."""
        self.task: asyncio.Task[None] | None = None
        self._inside = ""
        """The callback that holds the mailbox."""
        self._lives = 0
        self._calls = 0
        self._stop = asyncio.Event()
        self._readers: list[asyncio.Task[None]] = []
        self._activities: list[asyncio.Task[None]] = []
        self._published = random.choices(TOPICS, k=random.randint(0, 3))
        self._subscribed = random.choices(TOPICS, k=random.randint(1, 3))
        self._served = random.choices(SERVICES, k=random.randint(0, 2))
        self._called = random.sample(SERVICES, k=random.randint(0, 2))

    @property
    def alive(self) -> bool:
        """Whether the process runs."""
        return self.task is not None and not self.task.done()

    # Its life

    def start(self) -> None:
        """Start a new process."""
        self._lives += 1
        self.host = f"{self.name}.{self._lives}"
        self.world.record(f"start {self.host}")
        self._stop = asyncio.Event()
        self._make_node()
        with on_host(self.host):
            self.task = asyncio.create_task(self._live(), name=self.host)

    def _make_node(self) -> None:
        shares = Random(f"{self.world.seed} {self.name} shares memory").random() < 0.8
        self.node = actors.Node(self.name, url=self.url, use_global_arguments=False, shared_memory=shares)
        self.publishers, self.subscriptions, self.clients, self.services = [], [], [], []
        self.raised, self._inside = 0, ""
        for topic in self._published:
            self.publish_on(topic)
        for service in self._served:
            self._serve(service)
        for service in self._called:
            self.clients.append((service, self.node.create_client(Ask, service)))

    async def _live(self) -> None:
        for _ in range(20):
            try:
                await self._run_node()
                return
            except actors.NodeNameTaken:
                # The broker has not noticed the earlier process's death yet.
                self.world.record(f"{self.host}: the name is taken")
                await asyncio.sleep(5)
                self._make_node()
        self.world.complain(f"{self.host} does not get its name")

    async def _run_node(self) -> None:
        async with self.node:
            for topic in self._subscribed:
                self.subscribe_to(topic)
            self._activities = [asyncio.create_task(task) for task in self._tasks()]
            try:
                await self._stop.wait()
            finally:
                self._gone()

    def _gone(self) -> None:
        self._inside = GONE
        for task in (*self._activities, *self._readers):
            task.cancel()
        for pub in self.publishers:
            pub.gone = True
        for sub in self.subscriptions:
            sub.leave()

    async def activities_end(self) -> None:
        """Wait until everything the member has begun by itself has come to its end."""
        if not self._activities:
            return
        done, late = await asyncio.wait(self._activities, timeout=120)
        for task in late:
            self.world.complain(f"{self.host} never ends: {task.get_stack()}")
            task.cancel()
        self._complain_about_errors(done)

    def _complain_about_errors(self, tasks: set[asyncio.Task[Any]]) -> None:
        for task in tasks:
            if not task.cancelled() and task.exception() is not None:
                self.world.complain(f"{self.host}: {task.exception()!r}")

    async def stop(self) -> None:
        """End the process in order."""
        self.world.record(f"stop {self.host}")
        self.world.thaw(self.host)
        began, lost = self.world.loop.time(), self.world.lost_time(self.host)
        self._stop.set()
        await self._ended()
        took = self.world.loop.time() - began - (self.world.lost_time(self.host) - lost)
        if took > STOP_SEC:
            self.world.complain(f"{self.host} took {took:.3f} s to stop")

    async def kill(self, *, silent: bool) -> None:
        """End the process at once; its peers see a reset, or nothing."""
        self.world.record(f"kill {self.host}")
        self._gone()
        self.world.network.crash(self.host, silent=silent)
        self.world.thaw(self.host)
        assert self.task is not None
        self.task.cancel()
        await self._ended()

    async def _ended(self) -> None:
        assert self.task is not None
        done, _ = await asyncio.wait({self.task, *self._activities, *self._readers})
        self._complain_about_errors(done)

    # What it has

    def publish_on(self, topic: str) -> PublisherHistory:
        """Add a publisher."""
        publisher = self.node.create_publisher(Note, topic, self._qos(), strict_qos=self._strict())
        pub = PublisherHistory(f"{self.host}>{topic}>{len(self.world.journal.publishers)}", publisher)
        self.world.steps.add_publisher(pub)
        self.publishers.append(pub)
        self.world.journal.publishers.append(pub)
        return pub

    def _strict(self) -> bool:
        return self.random.random() < STRICT_SHARE

    def _qos(self) -> actors.QoSProfile:
        choice = self.random.choice
        reliable = actors.ReliabilityPolicy.RELIABLE
        durability = choice([actors.DurabilityPolicy.VOLATILE, actors.DurabilityPolicy.TRANSIENT_LOCAL])
        liveliness = choice([actors.LivelinessPolicy.AUTOMATIC, actors.LivelinessPolicy.MANUAL_BY_TOPIC])
        return actors.QoSProfile(
            history=choice([actors.HistoryPolicy.KEEP_LAST, actors.HistoryPolicy.KEEP_ALL]),
            depth=choice([1, 3, 10, 100]),
            reliability=choice([reliable, reliable, actors.ReliabilityPolicy.BEST_EFFORT]),
            durability=durability,
            deadline=choice([0, 0, 0, 0.5]),
            # What late joiners must get in the end is known only of what does not expire.
            lifespan=choice([0, 0, 5.0]) if durability is actors.DurabilityPolicy.VOLATILE else 0,
            liveliness=liveliness,
            liveliness_lease_duration=choice([0, 1.0]),
        )

    def subscribe_to(
        self, topic: str, *, qos: actors.QoSProfile | None = None, kind: str = ""
    ) -> SubscriptionHistory:
        """Add a subscription of some kind; the node runs."""
        kind = kind or self.random.choice(KINDS)
        pause = self.random.choice([0.001, 0.005, 0.02])
        sub: SubscriptionHistory

        def plain(message: Note, info: actors.MessageInfo) -> None:
            sub.record(message, info)
            with self._alone(sub.name, concurrent=False):
                if self.random.random() < 0.005:
                    self.raised += 1
                    raise ValueError("this message is not to my liking")

        async def asynchronous(message: Note, info: actors.MessageInfo) -> None:
            sub.record(message, info)
            with self._alone(sub.name, concurrent=kind == "beside"):
                if kind == "slow" or self.random.random() < 0.1:
                    await asyncio.sleep(pause * self.random.random())
                if kind == "calling" and self.clients and self.random.random() < 0.05:
                    await self._call_inside(sub.name)

        callback = None if kind == "iterate" else plain if kind == "plain" else asynchronous
        subscription = self.node.create_subscription(
            Note,
            topic,
            callback,
            qos or self._qos(),
            concurrent=kind == "beside",
            stall_timeout_sec=600.0,
            strict_qos=qos is None and self._strict(),
        )
        name = f"{self.host}<{topic}<{len(self.world.journal.subscriptions)}({kind})"
        broker = endpoint_of(subscription).context.link.url
        past = self.world.journal.past(subscription.qos_profile, broker)
        sub = SubscriptionHistory(name, self.world.complain, self.world.loop.time, subscription, before=past)
        self.subscriptions.append(sub)
        self.world.journal.subscriptions.append(sub)
        self.world.steps.add_subscription(sub)
        if kind == "iterate":
            self._readers.append(asyncio.create_task(self._iterate(sub, pause)))
        return sub

    async def _iterate(self, sub: SubscriptionHistory, pause: float) -> None:
        async for message in sub.subscription:
            sub.record(message, None)
            if self.random.random() < 0.3:
                await asyncio.sleep(pause * self.random.random())

    def _serve(self, name: str) -> None:
        concurrent = self.random.random() < 0.5
        what = f"{self.host}!{name}"

        async def asynchronous(request: Ask.Request) -> Ask.Response:
            self.world.journal.handle(request.caller, request.number)
            with self._alone(what, concurrent=concurrent):
                await asyncio.sleep(request.seconds)
                if request.hops and self.clients:
                    await self._call_inside(what, concurrent=concurrent, hops=request.hops - 1)
            self._still_wanted(request)
            return _answer(request)

        def plain(request: Ask.Request) -> Ask.Response:
            self.world.journal.handle(request.caller, request.number)
            with self._alone(what, concurrent=concurrent):
                return _answer(request)

        kinds: list[Callable[[Ask.Request], Ask.Response | Awaitable[Ask.Response]]] = [plain, asynchronous]
        callback = self.random.choice(kinds)
        self.services.append(self.node.create_service(Ask, name, callback, concurrent=concurrent))

    @contextmanager
    def _alone(self, name: str, *, concurrent: bool) -> Iterator[None]:
        """A callback runs: unless it may run beside others, no other one is running."""
        if concurrent:
            yield
            return
        self._enter(name)
        try:
            yield
        finally:
            if self._inside != GONE:
                self._inside = ""

    def _enter(self, name: str) -> None:
        if self._inside == GONE:
            return
        if self._inside:
            self.world.complain(f"{name} runs while {self._inside} does")
        self._inside = name

    async def _call_inside(self, name: str, *, concurrent: bool = False, hops: int = 0) -> None:
        """Call somebody from a callback, which lets others run meanwhile."""
        if not concurrent and self._inside != GONE:
            self._inside = ""
        try:
            await self._call(*self.random.choice(self.clients), hops=hops)
        finally:
            if not concurrent:
                self._enter(name)

    def _still_wanted(self, request: Ask.Request) -> None:
        """Where nothing is broken, a handler is cancelled soon after its caller has given up."""
        given_up = self.world.journal.given_up.get((request.caller, request.number), math.inf)
        if self.world.calm and self.world.loop.time() - given_up > self.world.cancel_sec:
            self.world.complain(f"{request.caller} #{request.number} is handled for nobody")

    # What it does

    def _tasks(self) -> Iterator[Coroutine[Any, Any, None]]:
        for pub in self.publishers:
            yield self._publish(pub)
        for name, client in self.clients:
            yield from self._use(name, client)
        yield self._come_and_go()

    def _use(
        self, name: str, client: actors.Client[Ask.Request, Ask.Response]
    ) -> Iterator[Coroutine[Any, Any, None]]:
        yield self._keep_calling(name, client)
        yield self._keep_waiting(client)

    def next_number(self) -> int:
        """Return the number of the next call that the handlers like."""
        self._calls += 1 + ((self._calls + 1) % 17 == 0)
        return self._calls

    async def _publish(self, pub: PublisherHistory) -> None:
        random = self.random
        rhythm = random.choice([0.03, 0.2, 1.0])
        while self.world.active and not pub.gone:
            await asyncio.sleep(random.expovariate(1 / rhythm))
            for _ in range(random.choice([1, 1, 3, 20])):
                weight = random.choice([0, 0, 10, 200])
                if random.random() < self.world.large_share:
                    weight = LARGE_BYTES[pub.published % 2]
                await self.publish_one(pub, weight)
            if random.random() < 0.1 and not pub.gone:
                await self._in_time(
                    pub.publisher.flush(2.0),
                    2.0,
                    actors.WaitTimeout,
                    actors.BrokerUnreachable,
                    actors.NodeDestroyed,
                )

    async def publish_one(self, pub: PublisherHistory, weight: int) -> None:
        """Publish the next message, unless the publisher is full."""
        if pub.gone:
            return
        try:
            pub.publisher.publish(Note(source=pub.name, number=pub.published, weight=bytes(weight)))
        except actors.PublisherFull:
            await self._in_time(pub.publisher.ready(1.0), 1.0, actors.WaitTimeout, actors.NodeDestroyed)

    async def _in_time(
        self, wait: Coroutine[Any, Any, object], timeout: float, *expected: type[Exception]
    ) -> object:
        """Await something with a deadline; complain if it comes late or ends otherwise."""
        host = self.host
        began, lost = self.world.loop.time(), self.world.lost_time(host)
        name = getattr(wait, "__qualname__", "")
        try:
            return await wait
        except expected:
            return None
        finally:
            took = self.world.loop.time() - began - (self.world.lost_time(host) - lost)
            if took > timeout + SLACK_SEC:
                self.world.complain(f"{self.host}: {name} took {took:.6f} s, {timeout} s were allowed")

    async def _keep_calling(self, name: str, client: actors.Client[Ask.Request, Ask.Response]) -> None:
        while self.world.active and not client.destroyed:
            await asyncio.sleep(self.random.expovariate(2))
            many = self.random.random() < 0.02
            calls = [
                asyncio.create_task(self._call(name, client))
                for _ in range(40 if many else self.random.choice([1, 1, 2, 10]))
            ]
            if many or self.random.random() < 0.1:
                await asyncio.sleep(self.random.choice([0.0, 0.0, 0.1]) * self.random.random())
                for call in calls if many else calls[:1]:
                    call.cancel()
            try:
                await asyncio.wait(calls)
            finally:
                for call in calls:
                    call.cancel()
            self._complain_about_errors(set(calls))

    async def _call(
        self, name: str, client: actors.Client[Ask.Request, Ask.Response], *, hops: int | None = None
    ) -> str:
        """Make one call and write it down; return its outcome.

        Its handler makes a call, too, if `hops` is not 0, and so on.
        """
        world, host = self.world, self.host
        self._calls += 1
        timeout = self.random.choice([0.01, 0.5, 3.0, 20.0])
        call = CallHistory(f"{self.host}?{name}", self._calls, world.loop.time(), timeout)
        world.journal.calls.append(call)
        seconds = self.random.choice([0.0, 0.0, 0.01, 1.0])
        weight = bytes(400_000 if self.random.random() < 0.03 else 0)
        if hops is None:
            hops = self.random.choice([0, 0, 0, 0, 0, 1, 3])
        request = Ask.Request(caller=call.name, number=self._calls, seconds=seconds, weight=weight, hops=hops)
        lost = world.lost_time(host)

        def ended(_: object) -> None:
            # Not when the caller goes on: in a callback it waits for the mailbox first.
            call.ended = world.journal.given_up[call.name, call.number] = world.loop.time()
            allowed = timeout + SLACK_SEC + world.lost_time(host) - lost
            if call.ended - call.began > allowed:
                world.complain(f"{call.name} took {call.ended - call.began:.6f} s of {timeout} s")

        try:
            future = client.call_async(request, timeout)
            future.add_done_callback(ended)
            reply = await future
            call.outcome = "reply"
            if reply.number != 2 * request.number or len(reply.weight) != len(weight):
                world.complain(f"{call.name}: {request.number} was answered with {reply.number}")
        except actors.CallFailed as error:
            call.outcome = type(error).__name__
            expected = request.number % 17 == 0 and "ValueError" in str(error)
            if isinstance(error, actors.RemoteError) and not expected:
                world.complain(f"{call.name} #{request.number}: {error!r}")
        except actors.NodeDestroyed:
            if call.ended is None:  # it was not even made
                ended(None)
            call.outcome = "destroyed"
        finally:
            world.record(f"{call.name} #{call.number} ends: {call.outcome or 'cancelled'}")
        return call.outcome

    async def _keep_waiting(self, client: actors.Client[Ask.Request, Ask.Response]) -> None:
        while self.world.active:
            await asyncio.sleep(self.random.expovariate(1))
            if client.destroyed:
                return
            timeout = self.random.choice([0.0, 0.5, 5.0])
            there = await self._in_time(client.wait_for_service(timeout), timeout, actors.NodeDestroyed)
            if there and not client.service_is_ready():
                self.world.complain(f"{self.host}: wait_for_service says yes, service_is_ready no")

    async def _come_and_go(self) -> None:
        """Endpoints that come late, and go."""
        while self.world.active:
            await asyncio.sleep(self.random.expovariate(0.5))
            self.random.choice(self._changes())()

    def _changes(self) -> list[Callable[[], None]]:
        return [self._come, self._go, self._serve_anew, self._publish_anew, self._call_anew]

    def _come(self) -> None:
        self.subscribe_to(self.random.choice(TOPICS))

    def _go(self) -> None:
        if len(self.subscriptions) > 1:
            sub = self.random.choice(self.subscriptions)
            self.subscriptions.remove(sub)
            sub.leave()
            self.node.destroy_subscription(sub.subscription)

    def _serve_anew(self) -> None:
        if self.services:
            service = self.services.pop(0)
            self.node.destroy_service(service)
            self._serve(service.srv_name)

    def _publish_anew(self) -> None:
        if self.publishers:
            pub = self.publishers.pop(0)
            pub.gone = True
            self.node.destroy_publisher(pub.publisher)
            pub = self.publish_on(pub.publisher.topic)
            self._activities.append(asyncio.create_task(self._publish(pub)))

    def _call_anew(self) -> None:
        if self.clients:
            name, client = self.clients.pop(0)
            self.node.destroy_client(client)
            client = self.node.create_client(Ask, name)
            self.clients.append((name, client))
            self._activities += map(asyncio.create_task, self._use(name, client))


def _answer(request: Ask.Request) -> Ask.Response:
    if request.number % 17 == 0:
        raise ValueError("no multiples of 17, please")
    return Ask.Response(number=2 * request.number, weight=request.weight)
