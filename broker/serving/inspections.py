"""Answers to INSPECT: the statistics are collected once for all that wait for them, and not too often."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from broker.routing.deliveries import SendEncoded
from proto.wire.codec import encode, with_id

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable

    from broker.routing.router import Router
    from broker.serving.dispatcher import Dispatcher
    from broker.serving.link import Link
    from broker.serving.stats import Statistics

MAX_UNANSWERED: Final = 10_000
"""INSPECTs of one link that wait for their answers."""

ANSWERS_PER_SHARE: Final = 16
"""Answers to one link before the next link gets its answers."""

ANSWER_SEC: Final = 0.005
"""Seconds of answering in one loop turn. The last answer may exceed them."""

PAUSE_RATIO: Final = 7
"""The pause after collecting and answering is 7 times as long, so that both take 1/8 of the loop's time."""

MAX_PAUSE_SEC: Final = 4.0
"""The longest pause. What took long may have been a pause of the machine, and a node's query for the numbers
ends after 5 s."""


class Inspections:
    """The INSPECTs of all links of one run of a broker that wait for their answers.

    Args:
        loop: The broker's event loop.
        dispatcher: The links and graphs.
        statistics: Collects the numbers.
    """

    def __init__(
        self, loop: asyncio.AbstractEventLoop, dispatcher: Dispatcher, statistics: Statistics
    ) -> None:
        self._loop = loop
        self._dispatcher = dispatcher
        self._statistics = statistics
        self._unanswered: dict[Link, list[int]] = {}
        """Ids of the INSPECTs of each link, in the order in which the links are served."""
        self._scheduled = False
        self._next_at = 0.0
        """Loop time before which the statistics are not collected again."""

    def add(self, link: Link, router: Router, inspect: int) -> None:
        """Answer an INSPECT of a link of this graph in a later loop turn.

        Raises:
            ProtocolError: `MAX_UNANSWERED` of this link wait already.
        """
        waiting = self._unanswered.setdefault(link, [])
        if len(waiting) >= MAX_UNANSWERED:
            text = f"more than {MAX_UNANSWERED} INSPECTs of one link wait for answers: send fewer at a time"
            raise router.refusals.error(text)
        waiting.append(inspect)
        self._answer_later()

    def _answer_later(self) -> None:
        if not self._scheduled:
            self._scheduled = True
            self._loop.call_at(self._next_at, self._answer)

    def _answer(self) -> None:
        """Collect the statistics, and answer INSPECTs for `ANSWER_SEC`; the others wait for the next call."""
        self._scheduled = False
        budget = self._dispatcher.budget
        assert budget is not None
        began = budget.clock()
        try:
            self._answer_until(lambda: budget.clock() - began >= ANSWER_SEC)
            self._dispatcher.flush()
        finally:
            spent = budget.clock() - began
            budget.spend(spent)
            self._next_at = self._loop.time() + min(PAUSE_RATIO * spent, MAX_PAUSE_SEC)
            if self._unanswered:
                self._answer_later()

    def _answer_until(self, over: Callable[[], bool]) -> None:
        dispatcher, unanswered, now = self._dispatcher, self._unanswered, self._loop.time()
        totals = self._statistics.totals(now)
        shared: dict[Router, list[bytes]] = {}
        while unanswered:
            link = next(iter(unanswered))
            inspects, router = unanswered.pop(link), link.router
            if router is None:
                continue
            peer = router.peer(link.peer)
            pieces = shared.get(router)
            if pieces is None or (peer is not None and peer.rights is not None):
                frames = self._statistics.answer(now, router, link, totals)
                pieces = [encode(frame) for frame in frames]
                if peer is None or peer.rights is None:
                    shared[router] = pieces
            now_answered, rest = inspects[:ANSWERS_PER_SHARE], inspects[ANSWERS_PER_SHARE:]
            if rest:
                unanswered[link] = rest  # behind the others
            answers = [SendEncoded(link.peer, with_id(raw, each)) for each in now_answered for raw in pieces]
            dispatcher.deliver(router, [*answers])
            if over():
                break
