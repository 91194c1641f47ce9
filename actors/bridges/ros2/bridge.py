"""A bridge: reads both graphs, asks the plan what each side should show, and shows it.

Everything happens in one loop: callboard's node, the nodes of ROS 2, and the messages of both.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import time
from typing import TYPE_CHECKING, Any, Final

from actors.bridges.election import ACTIVE, Election, bridges_in
from actors.bridges.graph import (
    BRIDGE_APART,
    BRIDGE_ID_LABEL,
    BRIDGE_LABEL,
    BRIDGE_STATE_LABEL,
    SideGraph,
    our_graph,
    unseen,
)
from actors.bridges.options import LEASE_SEC
from actors.bridges.plan import EMPTY_PLAN, plan
from actors.bridges.planning_budget import PlanningBudget
from actors.bridges.ros2.arrivals import Arrivals
from actors.bridges.ros2.errors import SuspendedError
from actors.bridges.ros2.importing import ANNOUNCEMENT_SEC
from actors.bridges.ros2.mirrors import Mirrors
from actors.bridges.ros2.observer import Observer
from actors.bridges.ros2.participant import Participant
from actors.bridges.ros2.types import Types
from actors.logging.limited_lines import LimitedLines
from actors.processes.backoff import Backoff
from proto.aio.tasks import cancel_and_wait
from proto.untrusted_text import peer_text

if TYPE_CHECKING:
    from collections.abc import Callable, Generator, Mapping

    from actors.bridges.counters import Counters
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
"""Time between two polls of ROS 2's graph; one that finds no change costs microseconds."""

FIRST_RETRY_SEC: Final = 1.0
LAST_RETRY_SEC: Final = 30.0
"""When to try again what a side has refused, although the graphs have not changed: a topic may have had
another type, whose publishers linger, or there were too many open files."""

BEAT_SEC: Final = 0.2
"""Time between two checks whether the process was suspended; a suspension is measured as exactly as that."""


def boot_time() -> float:
    """Return the time since the machine was started, in seconds; that of its sleep counts."""
    return time.clock_gettime(time.CLOCK_BOOTTIME)


class Bridge:
    """Shows each side's nodes on the other, and lets messages, calls and goals cross.

    Args:
        node: The bridge's node in callboard; entered by the caller.
        ros: ROS 2.
        rules: What may cross, and under which names.
        counters: Counts what crosses.
        bridge_id: Identifies this bridge on both sides; a token of a ROS name.
        domain_id: The domain of ROS 2; None for ROS_DOMAIN_ID.
        lease_sec: How long ROS 2 shows the bridge after it was killed.
        clock: Returns a monotonic time in seconds that goes on while the machine sleeps.

    Attributes:
        origin: The label of its mirrors in callboard, such as "ros2/7".
        labels: The labels of its own nodes in callboard.

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
        lease_sec: int = LEASE_SEC,
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
            ros, bridge_id=bridge_id, domain_id=domain_id, arrivals=arrivals, lease_sec=lease_sec
        )
        self._max_pause_sec = lease_sec - ANNOUNCEMENT_SEC
        """How long the bridge may not run: an announcement may have been due when the pause began. Processes
        that have dropped the bridge may miss endpoints of it afterwards, or get messages twice."""
        self.origin = f"ros2/{there.domain_id}"
        self.labels = {BRIDGE_LABEL: self.origin, BRIDGE_ID_LABEL: bridge_id}
        self._observer = Observer(ros, there)
        self._mirrors = Mirrors(
            node,
            there,
            origin=self.origin,
            observer=self._observer,
            types=self._types,
            rules=rules,
            counters=counters,
            warn=self._warn,
        )
        self._plan = EMPTY_PLAN
        """The last one while this bridge was active: mirror nodes keep their names when it is again."""
        self._retries = Backoff(FIRST_RETRY_SEC, LAST_RETRY_SEC)
        self._election = Election(bridge_id)
        self._marker: BareNode | None = None
        """Tells other bridges in callboard's graph that this one is active."""
        self._budget = PlanningBudget()
        self._type_names: set[str] = set()
        """Those of both graphs at the last plan."""
        self._ours = SideGraph()
        self._planned = self._ours, self._ours
        """Both graphs as the last plan knew them."""
        self._unseen: tuple[Refusal, ...] = ()
        self._labels: list[Mapping[str, str]] = []

    def _warn(self, kind: str, text: str) -> None:
        """Log a warning that other nodes can cause, at a limited rate for each kind."""
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
        retry_at = math.inf
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
                if now != state or loop.time() >= retry_at:
                    state = now
                    if await self._follow(active=active, there=there):
                        retry_at = math.inf
                        self._retries.reset()
                    else:
                        retry_at = loop.time() + self._retries.next(0.0)
                elif retry_at == math.inf and self._mirrors.has_lost_names:
                    # Usually the graph shows who has the name, and the next plan gives the mirror another.
                    # But the node may have gone since, or be silent or not to be seen.
                    retry_at = loop.time() + self._retries.next(0.0)
                self._mirrors.find_publishers(self._is_here, *self._planned)
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

    def _is_here(self, node: str) -> bool:
        """Return whether callboard has a native node of a name."""
        return any(each.name == node and not each.origin for each in self._ours.nodes)

    def close(self) -> None:
        """Hide everything, on both sides."""
        self._mirrors.close()
        self._participant.close()
        self._unmark()

    def _unmark(self) -> None:
        """Withdraw the marker: this bridge is not active any more."""
        if self._marker is not None:
            self._marker.destroy()
            self._marker = None

    def document(self) -> dict[str, Any]:
        """Return what crosses and what does not, as a JSON object."""
        ros = self._ros
        return {
            "network": self.origin,
            "id": self._participant.bridge_id,
            "active": self._marker is not None,
            "waits_for": self._election.waits_for,
            "rmw": ros.rmw,
            "distribution": ros.distribution,
            "has_own_profile": ros.has_own_profile,
            **self._mirrors.document(),
            **self._counters.document(),
        }

    async def _beat(self) -> None:
        """Raise SuspendedError when the bridge has not run for so long that ROS 2 may have dropped it.

        It may have been suspended, or have waited in a function of ROS 2: Fast DDS waits for a lock in shared
        memory that a killed process has held, a second at a time, and announces nothing meanwhile.
        """
        while True:
            before = self._clock()
            await asyncio.sleep(BEAT_SEC)
            pause = self._clock() - before
            if pause > self._max_pause_sec:
                raise SuspendedError(
                    f"The bridge was suspended for {pause:.1f} s. ROS 2 may have dropped it: it joins again"
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

    async def _follow(self, *, active: bool, there: SideGraph) -> bool:
        """Make a plan of both graphs and do what it says; hide everything while another bridge is active.

        Returns:
            False if a side has refused something, which is to be tried again.
        """
        new = EMPTY_PLAN
        if active:
            await self._look_up_types(there)
            self._planned = self._ours, there
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
        is_complete = await self._mirrors.apply(new)
        if not active:
            self._unmark()
        return is_complete

    async def _look_up_types(self, there: SideGraph) -> None:
        """Import the types that are new: that takes up to 0.1 s each, once, and is no cost of plans."""
        names = {each.type_name for graph in (self._ours, there) for each in graph.endpoints}
        new, self._type_names = names - self._type_names, names
        for name in new:
            self._types.known(name)
            await asyncio.sleep(0)
