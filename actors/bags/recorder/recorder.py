"""The node that records.

    async with Recorder("trip", Selection(topics=["/imu"])) as recorder:
        await recorder.wait()

Only the thread of `writer_thread.py`, which converts and writes messages, waits for the disk. On the event
loop, `topic_follower.py` subscribes, and `message_collector.py` takes messages and counts them.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Self, Unpack

from actors.bags.errors import BagError
from actors.bags.recorder.buffers import SnapshotRing
from actors.bags.recorder.discovery import Discovery
from actors.bags.recorder.losses import losses_of
from actors.bags.recorder.message_collector import MessageCollector, Source
from actors.bags.recorder.options import MAX_CACHE_SIZE, RecorderOptions
from actors.bags.recorder.services import RecorderServices
from actors.bags.recorder.topic_follower import TopicFollower
from actors.bags.recorder.writer_thread import WriterThread
from actors.bags.selection import Selection
from actors.bags.supervised_tasks import SupervisedTasks
from actors.bags.writer import Writer
from actors.interfaces.rosbag2_interfaces.msg import WriteSplitEvent
from actors.logging.limited_lines import LimitedLines
from actors.node.node import Node

if TYPE_CHECKING:
    from collections.abc import Callable, Collection
    from types import TracebackType

    from actors.graph.snapshot import GraphSnapshot
    from actors.node.options import NodeKeywords

NODE_NAME: Final = "bag_recorder"
CHECK_SEC: Final = 0.1
"""How often to look for invalid messages to report, and whether `until_no_messages_sec` is over."""
ALL_TOPICS: Final = Selection(all_topics=True)
DEFAULTS: Final = RecorderOptions()


@dataclass(frozen=True, kw_only=True, slots=True)
class RecordingStatistics:
    """Counts of a recorder.

    Attributes:
        file: The file that is being written.
        is_paused: Whether the recorder is paused.
        topics: Number of messages in the bag, by topic.
        received: Number of messages that arrived while the recorder was not paused.
        written: Number of messages in the bag.
        flushed: Number of messages that survive a kill of the process: all that are older than 0.5 s.
        lost: Number of messages that did not arrive.
        dropped: Number of messages that arrived when the memory limit was reached, or after the bag could not
            be written any more.
        invalid: Number of messages that are not valid messages of their topic's type.
        queued_bytes: Memory of the messages that wait for the disk, in bytes.
    """

    file: str
    is_paused: bool
    topics: dict[str, int]
    received: int
    written: int
    flushed: int
    lost: int
    dropped: int
    invalid: int
    queued_bytes: int


class Recorder:
    """Records topics into a bag, for the duration of an `async with` block.

    Args:
        path: The folder of the bag, which must not exist.
        selection: The topics, services and actions to record; default: all topics that are not hidden.
        options: How to record them.
        node_name: The name of the recorder's node.
        **keywords: Options of the node, such as `url`.

    Attributes:
        path: As given.
        node: The node. Other nodes control it through its services `~/pause`, `~/resume`, `~/toggle_paused`,
            `~/is_paused`, `~/split_bagfile`, `~/snapshot`, `~/start_discovery`, `~/stop_discovery`,
            `~/is_discovery_running`, `~/stop` and `~/get_report`.
        discovery: Finds topics that appear; it can be stopped, and started again.

    Raises:
        InvalidNameError, InvalidUrlError and others: As `Node`.
    """

    def __init__(
        self,
        path: str | Path,
        selection: Selection = ALL_TOPICS,
        options: RecorderOptions = DEFAULTS,
        *,
        node_name: str = NODE_NAME,
        **keywords: Unpack[NodeKeywords],
    ) -> None:
        self.path = Path(path)
        self._selection, self._options = selection, options
        self.node = Node(
            node_name,
            use_global_arguments=False,
            parameter_overrides={"use_sim_time": options.use_sim_time},
            **keywords,
        )
        self._log = self.node.get_logger()
        self._lines = LimitedLines(self._log.warning)
        self._split_events = self.node.create_publisher(WriteSplitEvent, "events/write_split", 1)
        self._tasks = SupervisedTasks("Recording", self._log)
        self.discovery = Discovery(self.node, self._tasks, self._look)
        RecorderServices(self.node, self, has_snapshots=options.snapshot_mode)

    async def __aenter__(self) -> Self:
        """Create the bag, and subscribe to the selected topics that exist.

        Raises:
            BagExistsError: The path exists.
            BagWriteError: The bag cannot be created.
            MissingExtraError: The extra `bags` is not installed.
            InvalidBagOptionError: The bag's writer refuses an option.
            BrokerUnreachable: As for a node.
        """
        options, clock = self._options, self.node.get_clock()
        max_bytes = options.max_cache_size or MAX_CACHE_SIZE
        self._thread = WriterThread(
            self._open_bag,
            write_through=not options.max_cache_size,
            on_failed=self._tasks.fail,
            on_split=self._report_split,
        )
        self._collector = MessageCollector(
            self._thread,
            max_bytes=max_bytes,
            lossless=options.lossless,
            ring=SnapshotRing(max_bytes) if options.snapshot_mode else None,
            now_ns=(lambda: clock.now().nanoseconds) if options.use_sim_time else None,
            is_paused=options.start_paused,
        )
        self._follower = TopicFollower(self.node, self._selection, options, self._begin)
        await self.node.__aenter__()
        try:
            await self._thread.open()
        except BaseException as error:
            # Also when cancelled, as the thread would keep the bag open.
            try:
                await self._thread.close(dict)
            finally:
                await self.node.__aexit__(type(error), error, error.__traceback__)
            raise
        self._tasks.start(self._check())
        try:
            await self.discovery.begin(once=options.no_discovery)
        except BaseException as error:
            await self.__aexit__(type(error), error, error.__traceback__)
            raise
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Write all messages that have arrived, and complete the bag.

        Raises:
            BagWriteError: The bag could not be written completely, and `wait` has not raised the error.
        """
        try:
            await self._finish()
        finally:
            await self.node.__aexit__(kind, error, traceback)
        self._tasks.raise_error(is_failing=kind is not None)

    def _open_bag(self) -> Writer:
        options = self._options
        return Writer(
            self.path,
            max_bag_size=options.max_bag_size,
            max_bag_duration_sec=options.max_bag_duration_sec,
            max_splits=options.max_splits,
            compression=options.compression,
            fsync=options.fsync,
            custom_data=options.custom_data,
        )

    # Called by programs and by the services

    async def wait(self) -> None:
        """Wait until the recording ends: by `stop`, for lack of messages, or because of an error.

        Raises:
            BagWriteError: The bag cannot be written any more, such as on a full disk. The messages written
                so far are a complete bag.
        """
        await self._tasks.wait()

    def stop(self) -> None:
        """End the recording; `wait` returns. The bag is completed when the block is left."""
        self._tasks.end()

    @property
    def is_paused(self) -> bool:
        """Whether the recorder is paused."""
        return self._collector.is_paused

    def pause(self) -> None:
        """Discard messages from now on, until `resume`."""
        if not self._collector.is_paused:
            self._collector.is_paused = True
            self._log.info("Pausing recording")

    def resume(self) -> None:
        """Record messages again."""
        if self._collector.is_paused:
            self._collector.is_paused = False
            self._log.info("Resuming recording")

    def toggle_paused(self) -> None:
        """Pause, or resume if paused."""
        if self._collector.is_paused:
            self.resume()
        else:
            self.pause()

    async def split(self) -> None:
        """Finish the file, and continue with the next one.

        Raises:
            BagError: The bag cannot be written, or the recording has ended.
        """
        self._collector.hand_over()
        await self._thread.split()

    async def take_snapshot(self) -> int:
        """Write the messages kept in memory, and wait until they are written.

        Returns:
            The number of messages.

        Raises:
            BagError: The recorder is not in snapshot mode, or the bag cannot be written.
        """
        if self._collector.ring is None:
            raise BagError("There are no snapshots without the option snapshot_mode")
        count = self._collector.write_snapshot()
        await self._thread.flush()
        return count

    async def flush(self) -> None:
        """Wait until all messages received so far have been handed to the operating system.

        Raises:
            BagError: The bag cannot be written, or the recording has ended.
        """
        self._collector.hand_over()
        await self._thread.flush()

    def statistics(self) -> RecordingStatistics:
        """Return the counts so far."""
        sources = self._follower.sources
        total: Counter[str] = Counter()
        for each in sources.values():
            counts = each.topic.counts
            for name in ("received", "written", "dropped", "unwritten", "invalid"):
                total[name] += getattr(counts, name)
            total["lost"] += each.lost
        return RecordingStatistics(
            file=self._thread.file,
            is_paused=self.is_paused,
            topics={name: each.topic.counts.written for name, each in sources.items()},
            received=total["received"],
            written=total["written"],
            flushed=self._thread.flushed,
            lost=total["lost"],
            dropped=total["dropped"] + total["unwritten"],
            invalid=total["invalid"],
            queued_bytes=self._thread.queued_bytes,
        )

    def document(self) -> dict[str, Any]:
        """Return the counts so far, with those of missing messages in detail, as data for JSON.

        The service `~/get_report` returns it to other nodes.
        """
        return {**asdict(self.statistics()), "losses": self._losses()}

    def _losses(self) -> dict[str, dict[str, Any]]:
        return self._losses_later()()

    def _losses_later(self) -> Callable[[], dict[str, dict[str, Any]]]:
        """Return a function that counts the losses once all messages are written; the thread calls it then.

        The messages that did not arrive are counted now, as the subscriptions end before that.
        """
        sources = self._follower.sources
        counts = {name: each.topic.counts for name, each in sources.items()}
        return partial(losses_of, counts, {name: each.lost for name, each in sources.items()})

    # Tasks and callbacks

    async def _look(self, snapshot: GraphSnapshot, names: Collection[str]) -> None:
        await self._follower.look(snapshot, names)

    async def _check(self) -> None:
        """Log invalid messages; end the recording if no message arrives for `until_no_messages_sec`."""
        loop, limit = asyncio.get_running_loop(), self._options.until_no_messages_sec
        arrived, since = self._collector.arrived, loop.time()
        while True:
            await asyncio.sleep(CHECK_SEC)
            for name, source in self._follower.sources.items():
                topic = source.topic
                if topic.problem and self._lines.admits("messages that cannot be recorded"):
                    self._log.warning(f"A message on '{name}' cannot be recorded: {topic.problem}")
                topic.problem = ""
            if arrived != self._collector.arrived:
                arrived, since = self._collector.arrived, loop.time()
            elif limit and loop.time() - since >= limit:
                self._log.info(f"No message has arrived for {limit:g} s; stopping")
                self.stop()

    def _begin(self, source: Source) -> None:
        self._thread.add_topic(source.topic)
        self._collector.begin(source)

    def _report_split(self, closed: str, opened: str) -> None:
        name = self.node.get_fully_qualified_name()
        event = WriteSplitEvent(closed_file=closed, opened_file=opened, node_name=name)
        self._split_events.publish(event)

    async def _finish(self) -> None:
        """Take the messages that have arrived, and complete the bag."""
        await self._tasks.cancel()
        sources = self._follower.sources
        # Also after an error, so that the messages that have arrived are counted.
        for each in list(sources.values()):
            await self._collector.drain(each)
        losses = self._losses_later()
        self._follower.close()
        self._collector.hand_over()
        self._lines.close()
        await self._thread.close(losses)
