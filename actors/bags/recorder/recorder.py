"""The node that records.

    async with Recorder("trip", Selection(topics=["/imu"])) as recorder:
        await recorder.wait()

Everything but the disk is on the event loop: `topic_follower.py` subscribes, `intake.py` takes messages and
counts them, and the thread of `writer_thread.py` converts and writes.
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
from actors.bags.recorder.errors import InvalidRecordingError
from actors.bags.recorder.intake import Intake, Source
from actors.bags.recorder.losses import losses_of
from actors.bags.recorder.options import MAX_CACHE_SIZE, RecorderOptions
from actors.bags.recorder.selection import Selection
from actors.bags.recorder.services import RecorderServices
from actors.bags.recorder.topic_follower import TopicFollower
from actors.bags.recorder.writer_thread import WriterThread
from actors.bags.writer import Writer
from actors.interfaces.rosbag2_interfaces.msg import WriteSplitEvent
from actors.logging.limited_lines import LimitedLines
from actors.node.node import Node
from proto.aio.tasks import cancel_and_wait

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import TracebackType

    from actors.graph.changes import GraphWatch
    from actors.node.options import NodeKeywords

NODE_NAME: Final = "bag_recorder"
CHECK_SEC: Final = 0.1
"""Time between two looks for messages, for `until_no_messages_sec`, and for invalid ones."""
ALL_TOPICS: Final = Selection(all_topics=True)
DEFAULTS: Final = RecorderOptions()


@dataclass(frozen=True, kw_only=True, slots=True)
class RecordingStatistics:
    """What a recorder has done so far.

    Attributes:
        file: The file that is being written.
        is_paused: Whether nothing is recorded now.
        topics: By topic, the messages in the bag.
        received: Messages that arrived while nothing was paused.
        written: Messages in the bag.
        flushed: Those that survive a kill of the process: all that are older than half a second.
        lost: Messages that did not arrive.
        dropped: Messages that arrived and found the memory full, or a bag that could not be written any more.
        invalid: Messages that are none of their topic's type.
        queued_bytes: What waits in memory for the disk.
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
    """Records topics into a bag, from `async with` to its end.

    Args:
        path: The folder of the bag, which must not exist.
        selection: Which topics; default: all that are not hidden.
        options: How.
        node_name: The name of the recorder's node.
        **keywords: Options of the node, such as `url`.

    Attributes:
        path: As given.
        node: The node. Other nodes control it by its services `~/pause`, `~/resume`, `~/toggle_paused`,
            `~/is_paused`, `~/split_bagfile`, `~/snapshot`, `~/stop` and `~/get_report`.

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
        self._tasks: list[asyncio.Task[None]] = []
        self._error: BaseException | None = None
        self._is_error_raised = False
        RecorderServices(self.node, self, has_snapshots=options.snapshot_mode)

    async def __aenter__(self) -> Self:
        """Open the bag, and subscribe to the topics that exist.

        Raises:
            BagExistsError: There is something at the path.
            BagWriteError: The bag cannot be made.
            MissingExtraError: The extra `bags` is not installed.
            ValueError: The bag's writer refuses an option.
            BrokerUnreachable: As for a node.
        """
        options, clock = self._options, self.node.get_clock()
        max_bytes = options.max_cache_size or MAX_CACHE_SIZE
        self._done = asyncio.Event()
        self._thread = WriterThread(
            self._open_bag,
            write_through=not options.max_cache_size,
            on_failed=self._failed,
            on_split=self._report_split,
        )
        self._intake = Intake(
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
            # Also when cancelled: the thread would keep the bag open.
            try:
                await self._thread.close(dict)
            finally:
                await self.node.__aexit__(type(error), error, error.__traceback__)
            raise
        watch = self.node.watch_graph()
        looked: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self._tasks = [
            asyncio.create_task(self._supervised(each))
            for each in (self._follow(watch, looked), self._check())
        ]
        try:
            if self.node.connected:
                await looked
        except BaseException as error:
            await self.__aexit__(type(error), error, error.__traceback__)
            raise
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Write what has arrived, and complete the bag.

        Raises:
            BagWriteError: The bag could not be written to its end, and `wait` has not said so.
        """
        try:
            await self._finish()
        finally:
            await self.node.__aexit__(kind, error, traceback)
        if self._error is not None and not self._is_error_raised:
            if kind is None:
                raise self._error
            self._log.error(str(self._error))

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

    # What its users call

    async def wait(self) -> None:
        """Wait until the recording ends: by `stop`, for lack of messages, or because of an error.

        Raises:
            BagWriteError: The bag cannot be written any more, such as on a full disk. What has been written
                is a bag nevertheless.
        """
        await self._done.wait()
        if self._error is not None:
            self._is_error_raised = True
            raise self._error

    def stop(self) -> None:
        """End the recording: `wait` returns."""
        self._done.set()

    @property
    def is_paused(self) -> bool:
        """Whether messages are left out now."""
        return self._intake.is_paused

    def pause(self) -> None:
        """Leave out messages from now on."""
        if not self._intake.is_paused:
            self._intake.is_paused = True
            self._log.info("Pausing recording")

    def resume(self) -> None:
        """Record messages again."""
        if self._intake.is_paused:
            self._intake.is_paused = False
            self._log.info("Resuming recording")

    def toggle_paused(self) -> None:
        """Pause, or resume if it is paused."""
        if self._intake.is_paused:
            self.resume()
        else:
            self.pause()

    async def split(self) -> None:
        """Go on with the next file.

        Raises:
            BagError: That is not possible.
        """
        self._intake.hand_over()
        await self._thread.split()

    async def take_snapshot(self) -> int:
        """Write the messages in memory, and wait until that is done.

        Returns:
            Their number.

        Raises:
            BagError: That is not possible.
            InvalidRecordingError: The recorder is not in snapshot mode.
        """
        if self._intake.ring is None:
            raise InvalidRecordingError("There are snapshots in snapshot mode only")
        count = self._intake.write_snapshot()
        await self._thread.flush()
        return count

    async def flush(self) -> None:
        """Wait until what has been received so far has been handed to the operating system.

        Raises:
            BagError: That is not possible.
        """
        self._intake.hand_over()
        await self._thread.flush()

    def statistics(self) -> RecordingStatistics:
        """Return what has been done so far."""
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
        """Return what has been done so far, and what is missing in the bag, as JSON has it.

        Other nodes get it from the service `~/get_report`.
        """
        return {**asdict(self.statistics()), "losses": self._losses()}

    def _losses(self) -> dict[str, dict[str, Any]]:
        return self._losses_later()()

    def _losses_later(self) -> Callable[[], dict[str, dict[str, Any]]]:
        """Return what counts the losses, for when everything is written: no messages arrive until then."""
        sources = self._follower.sources
        counts = {name: each.topic.counts for name, each in sources.items()}
        return partial(losses_of, counts, {name: each.lost for name, each in sources.items()})

    # What happens meanwhile

    async def _supervised(self, coroutine: Any) -> None:
        try:
            await coroutine
        except Exception as error:  # noqa: BLE001 - raised by `wait`, and by leaving
            self._failed(error)

    async def _follow(self, watch: GraphWatch, looked: asyncio.Future[None]) -> None:
        try:
            async for changes in watch.batches():
                snapshot = watch.snapshot
                names = {each.name for each in changes if each.name}
                await self._follower.look(snapshot, names)
                if not looked.done():
                    # The broker answers behind the subscriptions: it has them then.
                    await self.node.get_graph()
                    looked.set_result(None)
                    if self._options.no_discovery:
                        break
        except BaseException as error:
            if not looked.done():
                looked.set_exception(error)
            raise
        finally:
            watch.destroy()

    async def _check(self) -> None:
        """Say which messages cannot be written; end when none arrives for long enough."""
        loop, limit = asyncio.get_running_loop(), self._options.until_no_messages_sec
        arrived, since = self._intake.arrived, loop.time()
        while True:
            await asyncio.sleep(CHECK_SEC)
            for name, source in self._follower.sources.items():
                topic = source.topic
                if topic.problem and self._lines.admits("messages that cannot be written"):
                    self._log.warning(f"A message on '{name}' cannot be written: {topic.problem}")
                topic.problem = ""
            if arrived != self._intake.arrived:
                arrived, since = self._intake.arrived, loop.time()
            elif limit and loop.time() - since >= limit:
                self._log.info(f"No message has arrived for {limit:g} s: the recording ends")
                self.stop()

    def _begin(self, source: Source) -> None:
        self._thread.add_topic(source.topic)
        self._intake.begin(source)

    def _report_split(self, closed: str, opened: str) -> None:
        name = self.node.get_fully_qualified_name()
        event = WriteSplitEvent(closed_file=closed, opened_file=opened, node_name=name)
        self._split_events.publish(event)

    def _failed(self, error: BaseException) -> None:
        if self._error is None:
            self._error = error
            if not isinstance(error, BagError):
                self._log.error("Recording has failed", exc_info=error)
        self._done.set()

    async def _finish(self) -> None:
        """Take what has arrived, and complete the bag."""
        for task in self._tasks:
            await cancel_and_wait(task)
        sources = self._follower.sources
        # Also after an error: what has arrived is counted.
        for each in list(sources.values()):
            await self._intake.drain(each)
        losses = self._losses_later()
        self._follower.close()
        self._intake.hand_over()
        self._lines.close()
        await self._thread.close(losses)
