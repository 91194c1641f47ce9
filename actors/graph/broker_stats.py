"""The broker's numbers as a node gets them: asked over its link, at the moment of the question."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.diagnostics.records import Size
from actors.graph.broker_report import BrokerReport, ReportParts
from actors.graph.queries import QUERY_TIMEOUT_SEC, answered, connected
from proto import frames

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.endpoints.context import NodeContext


class BrokerView:
    """Asks the broker for its numbers over a node's link."""

    def __init__(self, context: NodeContext) -> None:
        self._context = context
        self._next_id = 0
        self._questions: dict[int, ReportParts] = {}
        context.link.handle(frames.Stats, self._received)

    def sizes(self) -> Iterator[Size]:
        """Say how many questions are under way."""
        yield Size(name="questions for the broker's numbers", size=len(self._questions))

    def _received(self, frame: frames.Stats) -> None:
        question = self._questions.get(frame.id)
        if question is None:
            return
        question.add(frame)
        if question.complete:
            self._context.link.wake()

    async def report(self, timeout_sec: float = QUERY_TIMEOUT_SEC) -> BrokerReport:
        """Return the broker's numbers.

        Raises:
            BrokerUnreachable: No broker within `timeout_sec`, or the link broke meanwhile.
        """
        await connected(self._context, timeout_sec)
        link = self._context.link
        assert link.channel is not None
        self._next_id += 1
        number, question = self._next_id, ReportParts()
        self._questions[number] = question
        try:
            link.channel.send(frames.Inspect(number))
            await answered(self._context, lambda: question.complete, link.connections, timeout_sec)
        finally:
            del self._questions[number]
        return question.report()
