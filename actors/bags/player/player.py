"""The node that plays.

    async with Player("trip", options=PlayerOptions(rate=2)) as player:
        await player.wait()

A thread reads and converts (`read_ahead.py`); the event loop waits until a message is due (`schedule.py`),
and publishes it with the time when it was published first.
"""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Self, Unpack

from actors.bags.errors import BagError
from actors.bags.player.bag_source import BagSource
from actors.bags.player.options import PlayerOptions
from actors.bags.player.read_ahead import ReadAhead
from actors.bags.player.schedule import NS_PER_SEC, Schedule
from actors.bags.player.services import PlayerServices
from actors.bags.player.topic_publishers import CLOCK_TOPIC, TopicPublishers
from actors.bags.recorder.selection import Selection
from actors.endpoints.publisher.publisher import MAX_STAMP_NS
from actors.logging.limited_lines import LimitedLines
from actors.node.node import Node
from proto.aio.tasks import cancel_and_wait
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Coroutine
    from types import TracebackType

    from actors.bags.player.played_topic import QueuedMessage
    from actors.node.options import NodeKeywords

NODE_NAME: Final = "bag_player"
EVERYTHING: Final = Selection(
    all_topics=True, all_services=True, all_actions=True, include_hidden_topics=True
)
DEFAULTS: Final = PlayerOptions()
EARLY_NS: Final = 500_000
"""A message may be this early: a loop wakes up at whole milliseconds, and would be late by up to one."""
TURN_MESSAGES: Final = 100
"""Messages published in one turn of the loop, if so many are due."""


@dataclass(frozen=True, kw_only=True, slots=True)
class PlayingStatistics:
    """What a player has done so far.

    Attributes:
        start_ns: The time of the bag's first message.
        end_ns: The time of its last message.
        position_ns: The time of the bag now.
        rate: Seconds of the bag for each second.
        is_paused: Whether it is paused.
        is_playing: Whether it has not come to the end.
        passes: How often it has come to the end.
        published: Messages that have been published.
        dropped: Of these, messages that did not leave the node.
        invalid: Messages that are none of their topic's type, and were left out.
        topics: By topic, the messages that have been published.
        problems: What cannot be played, each in one sentence.
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
    topics: dict[str, int]
    problems: tuple[str, ...]


class Player:
    """Plays a bag, from `async with` to its end.

    Args:
        path: The folder of the bag, or a file of one.
        selection: Which topics; default: all.
        options: How.
        node_name: The name of the player's node.
        **keywords: Options of the node, such as `url`.

    Attributes:
        path: As given.
        node: The node. Other nodes control it by its services `~/pause`, `~/resume`, `~/toggle_paused`,
            `~/is_paused`, `~/set_rate`, `~/get_rate`, `~/play`, `~/play_next`, `~/burst`, `~/seek` and
            `~/stop`.

    Raises:
        InvalidNameError, InvalidUrlError and others: As `Node`.
    """

    def __init__(
        self,
        path: str | Path,
        selection: Selection = EVERYTHING,
        options: PlayerOptions = DEFAULTS,
        *,
        node_name: str = NODE_NAME,
        **keywords: Unpack[NodeKeywords],
    ) -> None:
        self.path = Path(path)
        self._selection, self._options = selection, options
        self.node = Node(node_name, use_global_arguments=False, **keywords)
        self._log = self.node.get_logger()
        self._lines = LimitedLines(self._log.warning)
        self._tasks: set[asyncio.Task[None]] = set()
        self._playing: asyncio.Task[None] | None = None
        self._error: BaseException | None = None
        self._is_error_raised = False
        self._passes = 0
        self._stepped = 0
        """Messages of the burst that have been published."""
        self._burst: asyncio.Future[int] | None = None
        PlayerServices(self.node, self)

    async def __aenter__(self) -> Self:
        """Open the bag, make the publishers, and begin to play.

        Raises:
            BagError: The bag cannot be read.
            BrokerUnreachable: As for a node.
            InvalidPlayingError: It has no messages.
            MissingExtraError: The extra `bags` is not installed.
        """
        options = self._options
        self._changed = asyncio.Event()
        self._done = asyncio.Event()
        self._burst_lock = asyncio.Lock()
        self._ahead = ReadAhead(options.read_ahead, self._changed.set)
        excluded = frozenset({CLOCK_TOPIC} if options.publishes_clock else ())
        try:
            self._source = await self._ahead.call(
                BagSource, self.path, self._selection, excluded, options.order
            )
            self._publishers = TopicPublishers(self.node, self._source, options)
            self._schedule = Schedule(
                self._source.start_ns,
                self._source.end_ns,
                rate=options.rate,
                start_offset_ns=round(options.start_offset_sec * NS_PER_SEC),
                delay_ns=round(options.delay_sec * NS_PER_SEC),
                duration_ns=None
                if options.duration_sec is None
                else round(options.duration_sec * NS_PER_SEC),
                until_ns=options.until_ns,
                is_paused=options.start_paused,
            )
            await self.node.__aenter__()
        except BaseException:
            await self._ahead.close()
            raise
        self._begin()
        if options.clock_hz:
            self._start(self._run_clock(1 / options.clock_hz))
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Stop playing, and send what has been published.

        Raises:
            BagError: The bag could not be read to its end, and `wait` has not said so.
        """
        try:
            self._settle_burst()
            for task in [*self._tasks]:
                await cancel_and_wait(task)
            self._lines.close()
            await self._ahead.close()
        finally:
            await self.node.__aexit__(kind, error, traceback)
        if self._error is not None and not self._is_error_raised:
            if kind is None:
                raise self._error
            self._log.error(str(self._error))

    def _start(self, coroutine: Coroutine[Any, Any, None]) -> asyncio.Task[None]:
        task = asyncio.create_task(self._supervised(coroutine))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    async def _supervised(self, coroutine: Coroutine[Any, Any, None]) -> None:
        try:
            await coroutine
        except Exception as error:  # noqa: BLE001 - raised by `wait`, and by leaving
            if self._error is None:
                self._error = error
                if not isinstance(error, BagError):
                    self._log.error("Playing has failed", exc_info=error)
            self.stop()

    # What its users call

    async def wait(self) -> None:
        """Wait until the bag has been played, or `stop` is called.

        Raises:
            BagError: The bag cannot be read any further. What comes before the damage has been played.
        """
        await self._done.wait()
        if self._error is not None:
            self._is_error_raised = True
            raise self._error

    def stop(self) -> None:
        """End the playing: `wait` returns."""
        if self._playing is not None:
            self._playing.cancel()
            self._playing = None
        self._settle_burst()
        self._done.set()

    def play(
        self, *, start_offset_ns: int = 0, duration_ns: int | None = None, until_ns: int | None = None
    ) -> bool:
        """Play again, after the end.

        Args:
            start_offset_ns: Begin so long after the first message.
            duration_ns: Play this much of the bag; None for all.
            until_ns: Play up to this time of the bag; None for all.

        Returns:
            Whether it does: not while it plays.
        """
        if self._playing is not None or start_offset_ns < 0:
            return False
        self._schedule.set_range(start_offset_ns, duration_ns, until_ns)
        self._begin()
        return True

    def _begin(self) -> None:
        self._done.clear()
        self._schedule.start(time.monotonic_ns())
        self._read_from_beginning()
        self._playing = self._start(self._play())

    def _read_from_beginning(self) -> None:
        schedule = self._schedule
        is_whole = schedule.begin_ns == schedule.start_ns
        # What was published before the first message was received is played, too.
        self._ahead.begin(self._source, None if is_whole else schedule.begin_ns)

    @property
    def is_paused(self) -> bool:
        """Whether messages wait now."""
        return self._schedule.is_paused

    def pause(self) -> None:
        """Publish nothing from now on."""
        if not self.is_paused:
            self._schedule.pause(time.monotonic_ns())
            self._log.info("Pausing play")
            self._changed.set()

    def resume(self) -> None:
        """Go on."""
        if self.is_paused:
            self._schedule.resume(time.monotonic_ns())
            self._log.info("Resuming play")
            self._settle_burst()
            self._changed.set()

    def toggle_paused(self) -> None:
        """Pause, or resume if it is paused."""
        if self.is_paused:
            self.resume()
        else:
            self.pause()

    @property
    def rate(self) -> float:
        """Seconds of the bag for each second."""
        return self._schedule.rate

    def set_rate(self, rate: float) -> None:
        """Go on with another rate.

        Args:
            rate: Seconds of the bag for each second.

        Raises:
            InvalidPlayingError: It is not above 0, or extreme.
        """
        self._schedule.set_rate(rate, time.monotonic_ns())
        self._changed.set()

    def seek(self, time_ns: int) -> bool:
        """Go to a time of the bag.

        Args:
            time_ns: In nanoseconds since 1970.

        Returns:
            Whether the bag has that time; if not, nothing changes.
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
            Whether there was one, and it was paused.
        """
        return await self.burst(1) == 1

    async def burst(self, count: int = 0) -> int:
        """Publish the next messages at once, while paused.

        Args:
            count: Their number; 0 for all that follow.

        Returns:
            How many have been published; 0 if it was not paused.
        """
        async with self._burst_lock:
            if self._playing is None or not self.is_paused:
                return 0
            self._stepped = 0
            self._burst = asyncio.get_running_loop().create_future()
            self._schedule.step(count or MAX_STAMP_NS)
            self._changed.set()
            try:
                return await self._burst
            finally:
                self._schedule.forget_steps()
                self._burst = None

    def _settle_burst(self) -> None:
        """End a burst: all have been published, or nothing more will be."""
        self._schedule.forget_steps()
        if self._burst is not None and not self._burst.done():
            self._burst.set_result(self._stepped)

    def statistics(self) -> PlayingStatistics:
        """Return what has been done so far."""
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
            invalid=sum(each.invalid for each in self._source.topics),
            topics=topics,
            problems=tuple(self._source.problems),
        )

    # What happens meanwhile

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
            if message is None or message.time_ns > schedule.stop_ns:
                in_turn = 0
                if schedule.is_paused:
                    # Somebody may still go back.
                    self._settle_burst()
                    await self._until_changed(None)
                    continue
                self._passes += 1
                if not self._options.loop:
                    break
                schedule.start_again(time.monotonic_ns())
                self._read_from_beginning()
                continue
            wait_ns = schedule.wait_ns(message.time_ns, time.monotonic_ns())
            if wait_ns is None or wait_ns > EARLY_NS:
                in_turn = 0
                await self._until_changed(wait_ns)
                continue
            ahead.pop()
            await self._publishers.publish(message)
            if schedule.is_paused:
                self._note_step(message)
            in_turn += 1
            if in_turn >= TURN_MESSAGES:
                in_turn = 0
                await asyncio.sleep(0)
        if self._options.wait_for_all_acked_sec is not None:
            await self._publishers.flush(self._options.wait_for_all_acked_sec or None)
        self._playing = None
        self._done.set()

    def _note_step(self, message: QueuedMessage) -> None:
        schedule = self._schedule
        if schedule.steps:
            self._stepped += 1
            schedule.played(message.time_ns)
            if not schedule.steps:
                self._settle_burst()

    async def _until_changed(self, wait_ns: int | None) -> None:
        """Wait for so long, or until something changes."""
        timer = None
        if wait_ns is not None:
            loop = asyncio.get_running_loop()
            timer = loop.call_later((wait_ns - EARLY_NS) / NS_PER_SEC, self._changed.set)
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
            # Those that were missed are not made up for.
            due = max(due + period_sec, loop.time())
            await asyncio.sleep(due - loop.time())
