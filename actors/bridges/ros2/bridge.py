"""A bridge: reads both graphs, asks the plan what each side should show, and shows it.

Everything happens in one loop: callboard's node, the nodes of ROS 2, and the messages of both.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from actors.bridges.election import ACTIVE, Election, bridges_in
from actors.bridges.graph import (
    BRIDGE_APART,
    BRIDGE_ID_LABEL,
    BRIDGE_LABEL,
    BRIDGE_STATE_LABEL,
    ORIGIN_LABEL,
    SideGraph,
    our_graph,
    unseen,
)
from actors.bridges.plan import EMPTY_PLAN, plan
from actors.bridges.planning_budget import PlanningBudget
from actors.bridges.qos import is_latched
from actors.bridges.ros2.arrivals import Arrivals
from actors.bridges.ros2.conversion import converter
from actors.bridges.ros2.errors import RosError, SuspendedError, UnknownTypeError
from actors.bridges.ros2.importing import LEASE_SEC
from actors.bridges.ros2.inbound_calls import InboundCalls
from actors.bridges.ros2.observer import Observer
from actors.bridges.ros2.outbound_calls import OutboundCalls
from actors.bridges.ros2.participant import Participant
from actors.bridges.ros2.topics import TopicFromCallboard, TopicFromRos
from actors.bridges.ros2.types import Types
from actors.bridges.rules import GLOBAL_TOPICS
from actors.logging.limited_lines import LimitedLines
from actors.processes.backoff import Backoff
from actors.qos.profile import QoSProfile
from proto.aio.tasks import cancel_and_wait
from proto.untrusted_text import peer_text
from proto.wire.codes import EntryKind
from proto.wire.names import split_node_name

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Mapping

    from actors.bridges.counters import Counters
    from actors.bridges.plan import Mirror, Plan, SidePlan
    from actors.bridges.report import Refusal
    from actors.bridges.ros2.importing import Ros
    from actors.bridges.rules import Rules
    from actors.graph.changes import GraphWatch
    from actors.node.bare_node import BareNode
    from actors.node.node import Node

LEAST_PAUSE_SEC: Final = 0.02
"""Time between two plans while the graphs change, unless the budget of planning says more: a launch causes
hundreds of changes."""

POLL_SEC: Final = 0.1
"""Time between two looks at ROS 2's graph; one that finds no change costs microseconds."""

FIRST_RETRY_SEC: Final = 1.0
LAST_RETRY_SEC: Final = 30.0
"""When to try again what a side has refused, although the graphs have not changed: a topic may have had
another type, whose publishers linger, or there were too many open files."""

BEAT_SEC: Final = 0.2
"""How exactly a suspension of the process is measured."""

STEPS: Final = 10
"""Endpoints shown or hidden before messages have their turn: some milliseconds."""


def boot_time() -> float:
    """Return the time since the machine was started, in seconds; that of its sleep counts."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


class Bridge:
    """Shows each side's nodes on the other, and lets messages, calls and goals cross.

    Args:
        node: The bridge's node in callboard; entered by the caller.
        ros: ROS 2.
        rules: What may cross.
        counters: Counts what crosses.
        bridge_id: Names this bridge on both sides.
        domain_id: The domain of ROS 2; None for ROS_DOMAIN_ID.
        clock: Returns a monotonic time in seconds that goes on while the machine sleeps.

    Attributes:
        origin: The label of what it shows in callboard: "ros2/7".
        labels: Those of its own nodes there.

    Raises:
        RosError: ROS 2 does not start.
    """

    def __init__(
        self,
        node: Node,
        ros: Ros,
        rules: Rules,
        counters: Counters,
        *,
        bridge_id: str,
        domain_id: int | None = None,
        clock: Callable[[], float] = boot_time,
    ) -> None:
        self._node = node
        self._clock = clock
        self._ros = ros
        self._rules = rules
        self._counters = counters
        self._log = node.get_logger()
        self._lines = LimitedLines(self._log.warning)
        self._news = asyncio.Event()
        self._types = Types()
        arrivals = Arrivals(ros, asyncio.get_running_loop(), self._failed)
        there = self._participant = Participant(
            ros, bridge_id=bridge_id, domain_id=domain_id, arrivals=arrivals
        )
        self.origin = f"ros2/{there.domain_id}"
        self.labels = {BRIDGE_LABEL: self.origin, BRIDGE_ID_LABEL: bridge_id}
        self._observer = Observer(ros, there)
        self._here = _Here(node, self.origin)
        self._there = _There(there)
        self._caller = node.create_bare_node(
            f"_{node.get_name()}_calls", labels={ORIGIN_LABEL: self.origin}, apart=BRIDGE_APART
        )
        self._from_ros: dict[tuple[str, str], TopicFromRos] = {}
        self._from_callboard: dict[tuple[str, str], TopicFromCallboard] = {}
        outward, inward = (partial(counters.service, from_theirs=each) for each in (False, True))
        self._outbound = OutboundCalls(
            there.control, self._types, outward, self._from_ros.get, self._observer.request_hash
        )
        self._inbound = InboundCalls(self._caller, self._types, inward, self._warn, self._from_callboard.get)
        self._plan = EMPTY_PLAN
        """The last one that was not empty because of another bridge, or of a lost connection."""
        self._retries = Backoff(FIRST_RETRY_SEC, LAST_RETRY_SEC)
        self._retry_at = math.inf
        self._election = Election(bridge_id)
        self._marker: BareNode | None = None
        """Says in callboard's graph that this bridge is active."""
        self._budget = PlanningBudget()
        self._ours = SideGraph()
        self._unseen: tuple[Refusal, ...] = ()
        self._labels: list[Mapping[str, str]] = []

    def _warn(self, kind: str, text: str) -> None:
        """Log a line that other nodes can cause."""
        if self._lines.admits(kind):
            self._log.warning(text)

    def _failed(self, error: Exception) -> None:
        """Go on after an unexpected error: it may be due to one message, which is lost.

        If ROS 2 has ended, its graph cannot be read, either.
        """
        text = f"Something from ROS 2 is lost: {type(error).__name__}: {peer_text(str(error))}"
        self._counters.failed(text)
        self._warn("unexpected errors", text)

    async def run(self) -> None:
        """Follow both graphs until cancelled.

        Raises:
            RosError: ROS 2 has ended: the bridge must not go on half alive.
            SuspendedError: ROS 2 has dropped it while the process did not run. Another bridge can take its
                place in this process.
        """
        loop = asyncio.get_running_loop()
        watch = self._node.watch_graph()
        tasks = [loop.create_task(each) for each in (self._watch(watch), self._beat())]
        state: object = None
        try:
            while True:
                self._news.clear()
                for each in tasks:
                    if each.done():
                        each.result()
                there = self._observer.poll(loop.time())
                if not self._node.connected:
                    self._election.disconnect()
                active = self._node.connected and self._elect(loop.time(), there)
                now = self._ours, self._unseen, there, active
                if now != state or loop.time() >= self._retry_at:
                    state = now
                    self._retry_at = math.inf
                    await self._follow(active=active, there=there)
                    if self._retry_at == math.inf:
                        self._retries.reset()
                self._send_held()
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(POLL_SEC):
                        await self._news.wait()
                await self._pause()
        finally:
            for each in tasks:
                each.cancel()
            try:
                for each in tasks:
                    await cancel_and_wait(each)
            finally:
                watch.destroy()
                self.close()

    def _send_held(self) -> None:
        """Send what has waited for what the graphs may show by now, or will not show any more."""
        for received in self._from_ros.values():
            received.look_again()
        for passed_on in self._from_callboard.values():
            passed_on.publish_for_departed(self._is_here)

    def _is_here(self, node: str) -> bool:
        """Return whether callboard has a native node of a name."""
        return any(each.name == node and not each.origin for each in self._ours.nodes)

    def close(self) -> None:
        """Hide everything, on both sides."""
        self._outbound.close()
        self._inbound.close()
        for topics in (self._topics(from_ros=True), self._topics(from_ros=False)):
            for topic in topics.values():
                topic.close()
        self._participant.close()
        self._here.close()
        self._caller.destroy()
        self._unmark()

    def _unmark(self) -> None:
        """Say that this bridge is not active any more."""
        if self._marker is not None:
            self._marker.destroy()
            self._marker = None

    def document(self) -> dict[str, Any]:
        """Return what crosses, and what does not, as JSON has it."""
        ros, here, there = self._ros, self._here, self._there
        nodes = {name: node.refusal for name, node in here.nodes.items() if node.refusal}
        endpoints = {mirror: each.refusal for mirror, each in here.shown.items() if each.refusal}
        # Those of a refused node have the same reason.
        others = {f"{mirror.name}: {text}" for mirror, text in endpoints.items() if mirror.node not in nodes}
        return {
            "network": self.origin,
            "id": self._participant.bridge_id,
            "active": self._marker is not None,
            "waits_for": self._election.waits_for,
            "rmw": ros.rmw,
            "distribution": ros.distribution,
            "has_own_profile": ros.has_own_profile,
            "shown": {
                "callboard": {
                    "nodes": len(here.nodes) - len(nodes),
                    "endpoints": len(here.shown) - len(endpoints),
                },
                "ros2": {"nodes": len(there.nodes), "endpoints": len(there.shown)},
            },
            "refused_by_broker": sorted(others | {f"{name}: {text}" for name, text in nodes.items()}),
            **self._counters.document(),
        }

    async def _beat(self) -> None:
        """Raise SuspendedError when the process has not run for longer than ROS 2 waits for it."""
        while True:
            before = self._clock()
            await asyncio.sleep(BEAT_SEC)
            pause = self._clock() - before
            if pause > LEASE_SEC:
                raise SuspendedError(
                    f"The bridge was suspended for {pause:.0f} s, and ROS 2 has dropped it; it joins again"
                )

    async def _watch(self, watch: GraphWatch) -> None:
        async for _ in watch.batches():
            with self._planning():
                self._ours = our_graph(watch.snapshot)
            self._unseen = unseen(self._ours, self._node.get_fully_qualified_name(), self._node.user)
            self._labels = list(watch.snapshot.node_labels().values())
            self._news.set()
            await self._pause()

    @contextlib.contextmanager
    def _planning(self) -> Generator[None]:
        """Count what reading or planning costs: CPU time, as a busy machine makes the work no larger."""
        began = time.thread_time()
        yield
        self._budget.spend(asyncio.get_running_loop().time(), time.thread_time() - began)

    async def _pause(self) -> None:
        """Let the loop do other things before the graphs are read, or planned for, again."""
        pause = self._budget.pause(asyncio.get_running_loop().time())
        await asyncio.sleep(max(LEAST_PAUSE_SEC, pause))

    def _elect(self, now: float, there: SideGraph) -> bool:
        """Return whether this bridge, and no other one between the same networks, shows mirrors."""
        here = bridges_in(self._labels, self.origin)
        waited_for = self._election.waits_for
        elected = self._election.update(now, here, {node.origin for node in there.nodes} - {""})
        waits_for = self._election.waits_for
        if waits_for and waits_for != waited_for:
            self._log.info(f"The bridge {waits_for} connects the same networks; this one waits until it ends")
        elif elected and waited_for:
            self._log.info(f"This bridge is active now; it has waited for the bridge {waited_for}")
        return elected

    async def _follow(self, *, active: bool, there: SideGraph) -> None:
        """Hide what the plan has no longer, show what is new in it, and receive what it wants."""
        new = EMPTY_PLAN
        if active:
            await self._look_up_types(there)
            with self._planning():
                new = self._plan = plan(self._ours, there, self._rules, self._types.known, self._plan)
        if active and self._marker is None:
            # Before the first mirror, so that another bridge knows.
            self._marker = self._node.create_bare_node(
                f"_{self._node.get_name()}_active",
                labels={**self.labels, BRIDGE_STATE_LABEL: ACTIVE},
                apart=BRIDGE_APART,
            )
        for refusal in self._counters.refuse(self._unseen + new.refusals):
            if not refusal.quiet:
                self._warn("what does not cross; 'callboard bridge info' shows all", str(refusal))
        pace = _Pace()
        sides = (self._here, new.ours), (self._there, new.theirs)
        for side, wanted in sides:
            await self._hide_surplus(side, wanted, pace)
        for side, wanted in sides:
            await self._show_missing(side, wanted, pace)
        self._receive(new)
        if not active:
            self._unmark()

    async def _look_up_types(self, there: SideGraph) -> None:
        """Import the types that are new: that takes up to 0.1 s each, once, and is no cost of plans."""
        for name in {each.type_name for graph in (self._ours, there) for each in graph.endpoints}:
            self._types.known(name)
            await asyncio.sleep(0)

    async def _hide_surplus(self, side: _Side, wanted: SidePlan, pace: _Pace) -> None:
        successors = {_original_of(each) for each in wanted.mirrors - side.shown.keys() if _keeps(each)}
        for mirror in side.shown.keys() - wanted.mirrors:
            self._hide(side, mirror, is_replaced=_keeps(mirror) and _original_of(mirror) in successors)
            await pace.step()
        for node in side.nodes.keys() - wanted.nodes.keys():
            destroy = side.nodes.pop(node).destroy
            if seconds := side.busy.pop(node, 0.0):
                asyncio.get_running_loop().call_later(seconds, destroy)
            else:
                destroy()
            await pace.step()

    async def _show_missing(self, side: _Side, wanted: SidePlan, pace: _Pace) -> None:
        for node in sorted(wanted.nodes.keys() - side.nodes.keys()):
            self._attempt(side.add, node)
            await pace.step()
        for mirror in sorted(wanted.mirrors - side.shown.keys(), key=_order):
            if mirror.node in side.nodes:
                self._attempt(self._show, side, mirror)
            await pace.step()

    def _attempt(self, function: Callable[..., None], *arguments: Any) -> None:
        """Do what ROS 2 may refuse; that concerns one name, and no other."""
        try:
            function(*arguments)
        except (RosError, UnknownTypeError) as error:
            if self._retry_at == math.inf:  # the first one of a plan
                self._retry_at = asyncio.get_running_loop().time() + self._retries.next(0.0)
            if self._counters.failed(str(error)):
                self._warn("what a side refuses; 'callboard bridge info' shows all", str(error))

    def _show(self, side: _Side, mirror: Mirror) -> None:
        """Show an endpoint."""
        here = side is self._here
        node = side.nodes[mirror.node]
        handle: Any
        called = ""
        if mirror.kind is EntryKind.CLIENT:
            types = self._types.service(mirror.type_name)
            if here:
                handle = node.create_client(types.ours, mirror.name)
            else:
                # It is only seen: it keeps no more of the responses to others than it must.
                handle = node.create_client(types.theirs, mirror.name, qos=QoSProfile(depth=1))
                called = mirror.name
        elif mirror.kind is EntryKind.SERVICE:
            handle = (self._outbound if here else self._inbound).show(mirror, node)
            if here and any(
                each.kind is EntryKind.CLIENT and each.name == mirror.source for each in self._there.shown
            ):
                called = mirror.source
        elif mirror.kind is EntryKind.PUBLISHER:
            handle = self._topic(mirror, from_ros=here).add_publisher(mirror, node)
        else:
            handle = self._topic(mirror, from_ros=not here).add_subscription(mirror, node)
        side.shown[mirror] = handle
        if called:  # not before: it may be refused, and what is shown would never be hidden
            self._outbound.prepare(called)

    def _hide(self, side: _Side, mirror: Mirror, *, is_replaced: bool) -> None:
        """Show an endpoint no longer."""
        here, handle = side is self._here, side.shown.pop(mirror)
        if mirror.kind is EntryKind.CLIENT:
            handle.destroy()
        elif mirror.kind is EntryKind.SERVICE:
            (self._outbound if here else self._inbound).hide(mirror)
        else:
            from_ros = here is (mirror.kind is EntryKind.PUBLISHER)
            topic = self._topics(from_ros=from_ros)[_topic_of(mirror)]
            if seconds := topic.remove(mirror, is_replaced=is_replaced):
                side.busy[mirror.node] = seconds

    def _topics(self, *, from_ros: bool) -> dict[tuple[str, str], Any]:
        return self._from_ros if from_ros else self._from_callboard

    def _topic(self, mirror: Mirror, *, from_ros: bool) -> Any:
        """Return what receives a topic on the side where its messages come from."""
        topics, key = self._topics(from_ros=from_ros), _topic_of(mirror)
        if key not in topics:
            types, name = self._types.message(mirror.type_name), key[0]
            counts = self._counters.topic(name, mirror.type_name, from_theirs=from_ros)
            control = self._participant.control
            convert = converter(types, name, self._rules.prefix, from_ros=from_ros)
            topics[key] = (
                TopicFromRos(name, types, self._observer, control, counts, convert=convert)
                if from_ros
                else TopicFromCallboard(
                    name,
                    types,
                    self._caller,
                    control,
                    counts,
                    theirs=self._rules.name_there(name) or name,
                    convert=convert,
                )
            )
        return topics[key]

    def _receive(self, wanted: Plan) -> None:
        """Take messages where they are wanted; latched ones that have arrived need not arrive again."""
        for key, topic in self._from_ros.items():
            profiles = wanted.theirs.intake.get(key, ())
            if not profiles and topic.is_received:
                profiles = wanted.theirs.latched.get(key, ())
            self._attempt(topic.set_intake, profiles)
        receivers: dict[str, dict[str, int]] = {}
        for (name, node), index in wanted.ours.receivers.items():
            receivers.setdefault(name, {})[node] = index
        for key, here in self._from_callboard.items():
            here.set_intake(wanted.ours.intake.get(key, ()), receivers.get(key[0], {}))
        for topics in (self._topics(from_ros=True), self._topics(from_ros=False)):
            for key in [key for key, topic in topics.items() if topic.is_idle]:
                del topics[key]


class _Side:
    """What is shown on one side.

    Attributes:
        nodes: The mirrors of nodes, by full name.
        shown: The mirrors of endpoints, with the endpoints.
        busy: By node, in how many seconds it can go: its messages are on their way.
    """

    def __init__(self) -> None:
        self.nodes: dict[str, Any] = {}
        self.shown: dict[Mirror, Any] = {}
        self.busy: dict[str, float] = {}

    def add(self, name: str) -> None:
        """Show a node."""
        raise NotImplementedError


class _Here(_Side):
    """What is shown in callboard."""

    def __init__(self, owner: Node, origin: str) -> None:
        super().__init__()
        self._owner, self._labels = owner, {ORIGIN_LABEL: origin}

    def add(self, name: str) -> None:
        """Show a node."""
        namespace, base = split_node_name(name)
        self.nodes[name] = self._owner.create_bare_node(
            base,
            namespace=namespace,
            labels=self._labels,
            apart=BRIDGE_APART,
            shared_name=True,
            yields_name=True,
        )

    def close(self) -> None:
        """Show nothing any more."""
        for node in self.nodes.values():
            node.destroy()


class _There(_Side):
    """What is shown in ROS 2."""

    def __init__(self, participant: Participant) -> None:
        super().__init__()
        self._participant = participant

    def add(self, name: str) -> None:
        """Show a node."""
        self.nodes[name] = self._participant.mirror_node(name)


class _Pace:
    """Lets messages have their turn after every few steps."""

    def __init__(self) -> None:
        self._steps = 0

    async def step(self) -> None:
        """Note a step."""
        self._steps += 1
        if self._steps % STEPS == 0:
            await asyncio.sleep(0)


def _topic_of(mirror: Mirror) -> tuple[str, str]:
    """Return the name and type of a mirror's topic on the side where its messages come from."""
    is_source = mirror.kind is EntryKind.PUBLISHER
    return (mirror.source if is_source else mirror.name), mirror.type_name


def _keeps(mirror: Mirror) -> bool:
    """Return whether a mirror is a publisher that keeps messages for late joiners."""
    # A line of a log that was read is not read again.
    is_publisher = mirror.kind is EntryKind.PUBLISHER and mirror.source not in GLOBAL_TOPICS
    return is_publisher and mirror.qos is not None and is_latched(mirror.qos)


def _original_of(mirror: Mirror) -> tuple[str, str, str]:
    """Return what mirrors of one publisher have in common."""
    return mirror.source_node, mirror.source, mirror.type_name


def _order(mirror: Mirror) -> tuple[bool, str, str]:
    """Put publishers behind all others, so that nothing is published before it can be passed on."""
    return mirror.kind is EntryKind.PUBLISHER, mirror.node, mirror.name
