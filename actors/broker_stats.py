"""The broker's numbers as a node gets them: asked over its link, at the moment of the question."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, Final

from actors.asking import QUERY_TIMEOUT_SEC, answered, connected
from actors.diagnostics import Size
from proto import frames
from proto.stats import BrokerRates, BrokerStats, LinkStats, TopicStats, risen

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from actors.core import Core

TOPIC_TOTALS: Final = ("messages", "bytes", "delivered", "dropped", "abandoned", "lost_on_break")
LINK_TOTALS: Final = ("dropped", "bytes_received", "bytes_sent")
"""What only grows while a topic or a link is there."""


@dataclass(frozen=True, kw_only=True, slots=True)
class BrokerReportRates:
    """What happened per second between two reports.

    Attributes:
        totals: In the whole broker.
        topics: By name: messages, bytes, delivered, dropped, abandoned, lost_on_break.
        links: By session: dropped, bytes_received, bytes_sent.
    """

    totals: BrokerRates
    topics: dict[str, dict[str, float]]
    links: dict[int, dict[str, float]]

    def as_dict(self) -> dict[str, Any]:
        """Return the same as dicts and numbers."""
        return asdict(self)


@dataclass(frozen=True, kw_only=True, slots=True)
class BrokerReport:
    """A broker at one moment.

    Attributes:
        totals: The whole broker, all domains together.
        topics: Those of the asking node's domain, by name.
        links: Those of the asking node's domain, by session.
    """

    totals: BrokerStats
    topics: dict[str, TopicStats]
    links: dict[int, LinkStats]

    def as_dict(self) -> dict[str, Any]:
        """Return the same as dicts, tuples, strings and numbers."""
        return {
            "totals": self.totals.as_dict(),
            "topics": {name: topic._asdict() for name, topic in self.topics.items()},
            "links": {session: link._asdict() for session, link in self.links.items()},
        }

    def rates_since(self, earlier: BrokerReport) -> BrokerReportRates:
        """Return what has happened per second since an earlier report of the same broker.

        A topic or a link that was not there then counts from zero; of those gone in between nothing is known.

        Raises:
            ValueError: `earlier` is not earlier, or another broker's.
        """
        totals = self.totals.rates_since(earlier.totals)
        return BrokerReportRates(
            totals=totals,
            topics=_rates(TOPIC_TOTALS, earlier.topics, self.topics, totals.seconds),
            links=_rates(LINK_TOTALS, earlier.links, self.links, totals.seconds),
        )


def _rates(
    totals: Sequence[str], earlier: Mapping[Any, object], later: Mapping[Any, object], seconds: float
) -> dict[Any, dict[str, float]]:
    rates: dict[Any, dict[str, float]] = {}
    for key, entry in later.items():
        rise = risen(totals, earlier.get(key), entry)  # it may have gone and come again
        rates[key] = {total: change / seconds for total, change in rise.items()}
    return rates


@dataclass(slots=True)
class _Question:
    """What has come of an answer."""

    complete: bool = False
    totals: frames.Options = field(default_factory=dict[str, frames.Scalar])
    topics: dict[str, TopicStats] = field(default_factory=dict[str, TopicStats])
    links: dict[int, LinkStats] = field(default_factory=dict[int, LinkStats])


class BrokerView:
    """Asks the broker for its numbers over a node's link."""

    def __init__(self, core: Core) -> None:
        self._core = core
        self._next_id = 0
        self._questions: dict[int, _Question] = {}
        core.link.handle(frames.Stats, self._received)

    def sizes(self) -> Iterator[Size]:
        """Say how many questions are under way."""
        yield Size(name="questions for the broker's numbers", size=len(self._questions))

    def _received(self, frame: frames.Stats) -> None:
        question = self._questions.get(frame.id)
        if question is None:
            return
        question.totals = {**question.totals, **frame.totals}
        question.topics.update((topic.name, topic) for topic in frame.topics)
        question.links.update((link.session, link) for link in frame.links)
        if not frame.more:
            question.complete = True
            self._core.link.wake()

    async def report(self, timeout_sec: float = QUERY_TIMEOUT_SEC) -> BrokerReport:
        """Return the broker's numbers.

        Raises:
            BrokerUnreachable: No broker within `timeout_sec`, or the link broke meanwhile.
        """
        await connected(self._core, timeout_sec)
        link = self._core.link
        assert link.channel is not None
        self._next_id += 1
        number, question = self._next_id, _Question()
        self._questions[number] = question
        try:
            link.channel.send(frames.Inspect(number))
            await answered(self._core, lambda: question.complete, link.connections, timeout_sec)
        finally:
            del self._questions[number]
        return BrokerReport(
            totals=BrokerStats.from_map(question.totals), topics=question.topics, links=question.links
        )
