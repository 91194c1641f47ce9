"""The node that plays a bag.

    async with Player("trip", options=PlayerOptions(rate=2)) as player:
        await player.wait()

A thread reads and converts messages (`read_ahead.py`). The event loop waits until a message is due
(`schedule.py`), and publishes it with its original publish time.
"""

from __future__ import annotations

import asyncio
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, Self, Unpack

from actors.bags.player.bag_source import BagSource
from actors.bags.player.options import PlayerOptions
from actors.bags.player.played_service import PlayedService
from actors.bags.player.read_ahead import ReadAhead
from actors.bags.player.schedule import Schedule
from actors.bags.player.service_requests import ServiceRequests
from actors.bags.player.services import PlayerServices
from actors.bags.player.topic_publishers import CLOCK_TOPIC, TopicPublishers
from actors.bags.selection import Selection
from actors.bags.supervised_tasks import SupervisedTasks
from actors.logging.limited_lines import LimitedLines
from actors.node.node import Node
from actors.time.types import NANOSECONDS_PER_SECOND
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Iterable
    from types import TracebackType

    from actors.bags.player.played_topic import DueMessage
    from actors.node.options import NodeKeywords

NODE_NAME: Final = "bag_player"
EVERYTHING: Final = Selection(
    all_topics=True, all_services=True, all_actions=True, include_hidden_topics=True
)
DEFAULTS: Final = PlayerOptions()
EARLY_NS: Final = 500_000
"""Publish a message up to this early: a loop wakes up at whole milliseconds, up to one too late."""
TURN_MESSAGES: Final = 100
"""Limit for the messages published in one turn of the loop, so that other tasks get their turn."""


@dataclass(frozen=True, kw_only=True, slots=True)
class PlayingStatistics:
    """Position and counts of a player.

    Attributes:
        start_ns: Log time of the bag's first message.
        end_ns: Log time of its last message.
        position_ns: The present time of the bag.
        rate: Seconds of the bag that are played per second.
        is_paused: Whether the player is paused.
        is_playing: Whether it has not reached the end.
        passes: How many times it has reached the end.
        published: Number of published messages, and of sent requests.
        dropped: Number of published messages that did not leave the node.
        invalid: Number of messages that were left out, as they are not valid messages of their topic's type.
        answered: Number of requests that have been answered.
        failed: Number of requests that ended with an error, or without a reply in time.
        unserved: Number of requests that were not sent, as their service had no server when they were due.
        topics: Number of published messages or sent requests, by topic.
        problems: What cannot be played, each problem in one sentence.
    """

    start_ns: int
    end_ns: int
    position_ns: int
    rate: float
    is_paused: bool
    is_playing: bool
    passes: int
    published: int
    dropped: int
    invalid: int
    answered: int
    failed: int
    unserved: int
    topics: dict[str, int]
    problems: tuple[str, ...]


class Player:
    """Plays a bag, or several at once, for the duration of an `async with` block.

    Args:
        path: The folder of the bag, or a file of one; or several of them, whose messages are merged by time.
        selection: The topics to play; default: all.
        options: How to play them.
        node_name: The name of the player's node.
        **keywords: Options of the node, such as `url`.

    Attributes:
        paths: The bags.
        node: The node. Other nodes control it through its services `~/pause`, `~/resume`, `~/toggle_paused`,
            `~/is_paused`, `~/set_rate`, `~/get_rate`, `~/play`, `~/play_next`, `~/burst`, `~/seek` and
            `~/stop`.

    Raises:
        InvalidNameError, InvalidUrlError and others: As `Node`.
    """

    def __init__(
        self,
        path: str | Path | Iterable[str | Path],
        selection: Selection = EVERYTHING,
        options: PlayerOptions = DEFAULTS,
        *,
        node_name: str = NODE_NAME,
        **keywords: Unpack[NodeKeywords],
    ) -> None:
        self.paths = [Path(each) for each in ([path] if isinstance(path, (str, Path)) else path)]
        self._selection, self._options = selection, options
        self.node = Node(node_name, use_global_arguments=False, **keywords)
        self._log = self.node.get_logger()
        self._lines = LimitedLines(self._log.warning)
        self._tasks = SupervisedTasks("Playing", self._log, on_failed=self.stop)
        self._playing: asyncio.Task[None] | None = None
        self._passes = 0
        self._stepped = 0
        """Number of messages that the present burst has published."""
        self._burst: asyncio.Future[int] | None = None
        PlayerServices(self.node, self)

    async def __aenter__(self) -> Self:
        """Open the bag, create the publishers, and start to play.

        Raises:
            BagError: A bag cannot be read, or there are no messages.
            BrokerUnreachable: As for a node.
            MissingExtraError: The extra `bags` is not installed.
        """
        options = self._options
        self._changed = asyncio.Event()
        self._burst_lock = asyncio.Lock()
        self._ahead = ReadAhead(options.read_ahead, self._changed.set)
        excluded = frozenset({CLOCK_TOPIC} if options.publishes_clock else ())
        try:
            self._source = await self._ahead.call(
                BagSource, self.paths, self._selection, excluded, options.order, options.service_requests
            )
            self._publishers = TopicPublishers(self.node, self._source, options)
            self._requests = ServiceRequests(self.node, self._source, options, self._lines)
            self._schedule = Schedule(
                self._source.start_ns,
                self._source.end_ns,
                rate=options.rate,
                start_offset_ns=round(options.start_offset_sec * NANOSECONDS_PER_SECOND),
                delay_ns=round(options.delay_sec * NANOSECONDS_PER_SECOND),
                duration_ns=None
                if options.duration_sec is None
                else round(options.duration_sec * NANOSECONDS_PER_SECOND),
                until_ns=options.until_ns,
                is_paused=options.start_paused,
            )
            await self.node.__aenter__()
        except BaseException:
            await self._ahead.close()
            raise
        try:
            if self._requests.has_services and self.node.connected:
                # The answer comes after the clients are declared: the node knows by then which have a server.
                await self.node.get_graph()
        except BaseException as error:
            await self.__aexit__(type(error), error, error.__traceback__)
            raise
        self._begin()
        if options.clock_hz:
            self._tasks.start(self._run_clock(1 / options.clock_hz))
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Stop playing, and send the messages published so far.

        Raises:
            BagError: The bag could not be read to its end, and `wait` has not raised the error.
        """
        try:
            self._settle_burst()
            await self._tasks.cancel()
            self._lines.close()
            await self._ahead.close()
        finally:
            await self.node.__aexit__(kind, error, traceback)
        self._tasks.raise_error(is_failing=kind is not None)

    # Called by programs and by the services

    async def wait(self) -> None:
        """Wait until the bag has been played, or `stop` is called.

        Raises:
            BagError: The bag is damaged. The messages before the damage have been played.
        """
        await self._tasks.wait()

    def stop(self) -> None:
        """End the playing; `wait` returns."""
        if self._playing is not None:
            self._playing.cancel()
            self._playing = None
        self._settle_burst()
        self._tasks.end()

    def play(
        self, *, start_offset_ns: int = 0, duration_ns: int | None = None, until_ns: int | None = None
    ) -> bool:
        """Play again, after the end.

        Args:
            start_offset_ns: Start this many nanoseconds after the first message.
            duration_ns: Nanoseconds of the bag to play; 0: nothing, as in ROS 2; None for all.
            until_ns: Play up to this time of the bag; None for all.

        Returns:
            Whether playing has started; False while it plays already.
        """
        if self._playing is not None or start_offset_ns < 0:
            return False
        self._schedule.set_range(start_offset_ns, duration_ns, until_ns)
        self._begin()
        return True

    def _begin(self) -> None:
        if self._schedule.is_empty:
            self._log.warning(
                "Nothing is played: the end is before the start, or the duration is 0; -1 plays all"
            )
        self._tasks.begin()
        self._schedule.start(time.monotonic_ns())
        self._read_from_beginning()
        self._playing = self._tasks.start(self._play())

    def _read_from_beginning(self) -> None:
        schedule = self._schedule
        is_whole = schedule.begin_ns == schedule.start_ns
        # No limit: by publish time, messages may be due before the log time of the first one.
        self._ahead.begin(self._source, None if is_whole else schedule.begin_ns)

    @property
    def is_paused(self) -> bool:
        """Whether the player is paused."""
        return self._schedule.is_paused

    def pause(self) -> None:
        """Publish nothing until `resume` is called."""
        if not self.is_paused:
            self._schedule.pause(time.monotonic_ns())
            self._log.info("Pausing play")
            self._changed.set()

    def resume(self) -> None:
        """Continue to play."""
        if self.is_paused:
            self._schedule.resume(time.monotonic_ns())
            self._log.info("Resuming play")
            self._settle_burst()
            self._changed.set()

    def toggle_paused(self) -> None:
        """Pause, or resume if paused."""
        if self.is_paused:
            self.resume()
        else:
            self.pause()

    @property
    def rate(self) -> float:
        """Seconds of the bag that are played per second."""
        return self._schedule.rate

    def set_rate(self, rate: float) -> None:
        """Change the rate.

        Args:
            rate: Seconds of the bag to play per second, from 1e-6 to 1e9.

        Raises:
            InvalidBagOptionError: The rate is out of range.
        """
        self._schedule.set_rate(rate, time.monotonic_ns())
        self._changed.set()

    def seek(self, time_ns: int) -> bool:
        """Continue at a time of the bag.

        Args:
            time_ns: The time in nanoseconds since 1970.

        Returns:
            Whether the time is within the bag and the player is playing; if not, nothing changes.
        """
        if self._playing is None or not self._schedule.has(time_ns):
            return False
        self._schedule.seek(time_ns, time.monotonic_ns())
        self._settle_burst()
        self._ahead.begin(self._source, time_ns)
        self._changed.set()
        return True

    async def play_next(self) -> bool:
        """Publish the next message, while paused.

        Returns:
            Whether a message was published: not if there is none left, or if the player is not paused.
        """
        return await self.burst(1) == 1

    async def burst(self, count: int = 0) -> int:
        """Publish the next messages at once, while paused.

        Args:
            count: Number of messages; 0 for all that are left.

        Returns:
            The number of published messages; 0 if the player is not paused.
        """
        async with self._burst_lock:
            if self._playing is None or not self.is_paused:
                return 0
            self._stepped = 0
            self._burst = asyncio.get_running_loop().create_future()
            self._schedule.step(count or sys.maxsize)
            self._changed.set()
            try:
                return await self._burst
            finally:
                self._schedule.forget_steps()
                self._burst = None

    def _settle_burst(self) -> None:
        """End the burst, if there is one, and return its count to the caller."""
        self._schedule.forget_steps()
        if self._burst is not None and not self._burst.done():
            self._burst.set_result(self._stepped)

    def statistics(self) -> PlayingStatistics:
        """Return the position and the counts so far."""
        topics: dict[str, int] = {}
        for each in self._source.topics:
            topics[each.name] = topics.get(each.name, 0) + each.published
        return PlayingStatistics(
            start_ns=self._schedule.start_ns,
            end_ns=self._schedule.end_ns,
            position_ns=self._schedule.position_ns(time.monotonic_ns()),
            rate=self.rate,
            is_paused=self.is_paused,
            is_playing=self._playing is not None,
            passes=self._passes,
            published=sum(topics.values()),
            dropped=self._publishers.dropped,
            answered=self._requests.answered,
            failed=self._requests.failed,
            unserved=self._requests.unserved,
            invalid=sum(each.invalid for each in self._source.topics),
            topics=topics,
            problems=tuple(self._source.problems),
        )

    # Tasks

    async def _play(self) -> None:
        """Publish each message when it is due, up to the end."""
        schedule, ahead = self._schedule, self._ahead
        in_turn = 0
        while True:
            message = ahead.first
            if message is None and not ahead.is_ended:
                in_turn = 0
                await self._until_changed(None)
                continue
            if message is None or schedule.is_over(message.time_ns):
                in_turn = 0
                if await self._goes_on():
                    continue
                break
            wait_ns = schedule.wait_ns(message.time_ns, time.monotonic_ns())
            if wait_ns is None or wait_ns > EARLY_NS:
                in_turn = 0
                await self._until_changed(wait_ns)
                continue
            ahead.pop()
            if message.split is None and message.topic.publisher is not None:
                await self._publishers.publish(message)
            else:
                await self._play_other(message)
            if schedule.is_paused:
                self._note_step(message)
            in_turn += 1
            if in_turn >= TURN_MESSAGES:
                in_turn = 0
                await asyncio.sleep(0)
        await self._requests.finish()
        if self._options.wait_for_all_acked_sec is not None:
            await self._publishers.flush(self._options.wait_for_all_acked_sec or None)
        self._playing = None
        self._tasks.end()

    async def _play_other(self, message: DueMessage) -> None:
        """Play a message that is a request, or the first one of a further file."""
        if message.split is not None:
            self._publishers.publish_split(*message.split)
        if isinstance(message.topic, PlayedService):
            await self._requests.send(message, message.topic)
        else:
            await self._publishers.publish(message)

    async def _goes_on(self) -> bool:
        """At the end of the bag, return whether there may be more to play."""
        schedule = self._schedule
        if schedule.is_paused:
            # `seek` may still go back, so the playing does not end while paused.
            self._settle_burst()
            await self._until_changed(None)
            return True
        self._passes += 1
        if not self._options.loop or schedule.is_empty:
            return False
        schedule.start_again(time.monotonic_ns())
        self._read_from_beginning()
        return True

    def _note_step(self, message: DueMessage) -> None:
        schedule = self._schedule
        if schedule.steps:
            self._stepped += 1
            schedule.played(message.time_ns)
            if not schedule.steps:
                self._settle_burst()

    async def _until_changed(self, wait_ns: int | None) -> None:
        """Wait until something changes, for `wait_ns` at most; then log invalid messages."""
        timer = None
        if wait_ns is not None:
            loop = asyncio.get_running_loop()
            timer = loop.call_later((wait_ns - EARLY_NS) / NANOSECONDS_PER_SECOND, self._changed.set)
        try:
            await self._changed.wait()
        finally:
            self._changed.clear()
            if timer is not None:
                timer.cancel()
        for topic in self._source.topics:
            if topic.problem:
                if self._lines.admits("messages that are not played"):
                    self._log.warning(f"A message on '{escape(topic.name)}' is not played: {topic.problem}")
                topic.problem = ""

    async def _run_clock(self, period_sec: float) -> None:
        """Publish the time of the bag regularly, also while paused."""
        loop = asyncio.get_running_loop()
        due = loop.time()
        while True:
            self._publishers.publish_clock(self._schedule.position_ns(time.monotonic_ns()))
            # After a delay, missed ticks are not made up for.
            due = max(due + period_sec, loop.time())
            await asyncio.sleep(due - loop.time())
