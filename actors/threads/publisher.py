"""Publishing from any thread."""

from __future__ import annotations

import asyncio
import threading
import time
from collections import deque
from typing import TYPE_CHECKING, Final, Generic, TypeVar

from actors.endpoints.endpoint import endpoint_of
from actors.endpoints.publisher import queue_limits
from actors.errors import NodeDestroyed, PublisherFull
from actors.interfaces.codec import codec_for
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.message import Message
from actors.qos.profile import HistoryPolicy
from actors.time.timeout import DEFAULT_TIMEOUT

if TYPE_CHECKING:
    from actors.endpoints.publisher.publisher import Publisher
    from actors.threads.loop_thread import LoopThread
    from actors.time.timeout import Timeout

T = TypeVar("T", bound=Message)

QUEUED_MESSAGES: Final = 10_000
"""Messages that may wait for the loop: more than a thread publishes while it keeps the GIL, about 5 ms."""
QUEUED_BYTES: Final = 64 * 1024 * 1024
"""Bytes of messages that may wait for the loop. A single message may be larger."""
LOCK_SEC: Final = 0.01
"""How long the loop waits for the lock: longer than a running thread holds it."""
RETRY_SEC: Final = 0.001
"""Seconds after which the loop tries to get the lock again."""


class ThreadPublisher(Generic[T]):
    """Publishes from any thread. Made by `NodeThread.publisher`.

    Messages wait in a queue of their own until the loop hands all of them over at once. When it is full, the
    oldest message is dropped, or `publish` raises PublisherFull if the publisher is KEEP_ALL.

    `published` = messages handed to the publisher + `dropped` + `queued`.

    Attributes:
        topic_name: The full name of the topic.
        published: Messages that `publish` has accepted.
    """

    def __init__(self, thread: LoopThread, publisher: Publisher[T], limit: int) -> None:
        if limit < 1:
            raise ValueError(f"limit must be at least 1, not {limit}")
        self.topic_name = publisher.topic_name
        self.published = 0
        self._overflowed = 0
        """Messages dropped because the queue was full."""
        self._refused = 0
        """Messages that the publisher has refused; only the loop changes it."""
        self._reported = 0
        """How many of `dropped` have been added to the node's diagnostics."""
        self._thread = thread
        self._publisher = publisher
        # Endpoint and codec are looked up once, because `publish` is the hot path.
        self._endpoint = endpoint_of(publisher)
        self._codec = codec_for(publisher.msg_type)
        self._keep_all = publisher.qos_profile.resolved().history == HistoryPolicy.KEEP_ALL
        self._limit = limit
        self._lock = threading.RLock()  # knows whether this thread has it
        # Encoded messages: the calling thread pays for encoding, sees its errors, and may change the
        # message afterwards.
        self._queue: deque[bytes] = deque()
        self._queued_bytes = 0
        self._posted = False
        """Whether `_hand_over` is about to be called."""

    @property
    def queued(self) -> int:
        """Messages that wait for the loop."""
        return len(self._queue)

    @property
    def dropped(self) -> int:
        """Messages dropped here because the queue was full, or the publisher was destroyed meanwhile."""
        return self._overflowed + self._refused

    @property
    def crowded(self) -> bool:
        """Whether to call `ready` before the next message: KEEP_ALL readers are slow. Never with KEEP_LAST.

        More than that would be accepted, but large messages find no space in shared memory then. Without a
        broker this is False, since nobody knows how long `ready` would take.
        """
        endpoint = self._endpoint
        return (self._keep_all and endpoint.accepted_now) and (
            endpoint.queued + len(self._queue) >= queue_limits.READY_MESSAGES
            or endpoint.queue.pending_bytes + self._queued_bytes >= queue_limits.READY_BYTES
        )

    def publish(self, msg: T | bytes) -> None:
        """Send a message as `Publisher.publish` does, from any thread. Never blocks.

        The message is encoded and checked in the calling thread; it may be changed afterwards. The messages
        of one thread stay in order. The loop is woken once for all messages that wait.

        Args:
            msg: The message, or one that is already encoded.

        Raises:
            TypeError, InvalidMessageError, NodeDestroyed: As for `Publisher.publish`.
            PublisherFull: KEEP_ALL only: the readers are slow and the queue is full. Call `ready()` first.
            ThreadStopped: The node's thread has ended.
        """
        endpoint = self._endpoint
        endpoint.require_alive()
        self._thread.require_running()
        if isinstance(msg, bytes):
            # Checks that the bytes are a message of this type. A subscriber would otherwise find out, far
            # away.
            self._codec.decode(msg)
            data = msg
        else:
            data = self._codec.encode(msg)
        link = endpoint.context.link
        if len(data) > link.largest:
            link.require_fits(f"A message on '{self.topic_name}'", len(data))
        # A thread that blocks gets the lock without the GIL, and then each message costs a switch of threads.
        try:
            while not self._lock.acquire(blocking=False):
                time.sleep(0)
            queue, size = self._queue, len(data)
            if self._keep_all or len(queue) >= self._limit or self._queued_bytes + size > QUEUED_BYTES:
                self._make_space(size)
            # One wake-up of the loop for all messages that wait. Waking it is a system call, which takes
            # longer than the rest of this method.
            if not self._posted:
                link.left.append(self)  # first: the loop may run at once
                try:
                    self._thread.post(self._hand_over)
                except BaseException:
                    link.left.pop()
                    raise
                # Only after `post` has returned: if it raises, the next message must try again, and this
                # one was not accepted.
                self._posted = True
            queue.append(data)
            self._queued_bytes += size
            self.published += 1
        finally:
            try:  # noqa: SIM105 - `suppress` takes longer, and this is the hot path
                self._lock.release()
            except RuntimeError:  # Ctrl-C before this thread had it
                pass

    def _make_space(self, size: int) -> None:
        """Drop the oldest messages until one of this size fits, or raise PublisherFull."""
        queue, endpoint = self._queue, self._endpoint
        # A single message above the size limit passes if nothing else waits; otherwise it could never be
        # sent.
        full = len(queue) >= self._limit or (queue and self._queued_bytes + size > QUEUED_BYTES)
        # What waits here will wait in the publisher's own queue next, so that both count against its limit.
        if self._keep_all:
            waiting = endpoint.queued + len(queue)
            if full or not queue_limits.left(endpoint.queue, waiting):
                raise PublisherFull(f"'{self.topic_name}': {waiting} messages wait; call ready()")
        while full:
            self._queued_bytes -= len(queue.popleft())
            self._overflowed += 1
            full = queue and self._queued_bytes + size > QUEUED_BYTES

    def _hand_over(self) -> None:
        """Give everything that waits to the publisher; in the loop."""
        # A thread that has the lock may be in a signal handler that waits for the loop.
        if not self._lock.acquire(timeout=LOCK_SEC):
            asyncio.get_running_loop().call_later(RETRY_SEC, self._hand_over)
            return
        try:
            # Swapped under the lock and sent after it: encoding and sending must not keep other threads
            # waiting.
            queue, self._queue = self._queue, deque()
            self._queued_bytes = 0
            self._posted = False
        finally:
            self._lock.release()
        for data in queue:
            try:
                self._publisher.publish_encoded(data)
            except PublisherFull:  # `publish` has checked this; others have published since
                # `publish` has accepted this message, so that it must not be lost: the queue goes over its
                # limit by it.
                self._endpoint.collect_encoded(data)
            except (NodeDestroyed, InvalidMessageError):  # has been destroyed, or has another broker now
                self._refused += 1
        self._endpoint.context.link.left.pop()
        # Added to the endpoint here because only the loop's thread may change its counters.
        dropped = self.dropped
        self._endpoint.overflowed += dropped - self._reported
        self._reported = dropped

    def ready(self, timeout_sec: Timeout = DEFAULT_TIMEOUT) -> None:
        """Block until there is space, as `Publisher.ready` does.

        Args:
            timeout_sec: Seconds to wait at most; None for no limit.

        Raises:
            WaitTimeout, PublisherRefused, NodeDestroyed: As for `Publisher.ready`.
            ThreadStopped: The node's thread has ended, or ends meanwhile.
            RuntimeError: This is the loop's own thread.
        """
        self._thread.call(self._publisher.ready(timeout_sec), None)

    def flush(self, timeout_sec: Timeout = DEFAULT_TIMEOUT) -> None:
        """Block until everything published so far has reached the broker.

        Args:
            timeout_sec: Seconds to wait at most; None for no limit.

        Raises:
            WaitTimeout, BrokerUnreachable, PublisherRefused, NodeDestroyed: As for `Publisher.flush`.
            ThreadStopped: The node's thread has ended, or ends meanwhile.
            RuntimeError: This is the loop's own thread.
        """
        self._thread.call(self._publisher.flush(timeout_sec), None)
