"""Publishers in ROS 2 that lose nothing while they come and go.

A publisher of ROS 2 reaches those only that DDS has connected it to, which takes some 50 ms, and what it has
just sent is lost if it goes at once. Programs that publish one message live no longer than that.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Final

from actors.bridges.ros2.errors import RosError

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable

    from actors.bridges.counters import Counts
    from actors.bridges.ros2.endpoints import RosPublisher

MATCH_SEC: Final = 1.0
"""How long messages wait for DDS to connect a new publisher; somebody listens, or there would be none."""
LINGER_SEC: Final = 0.5
"""How long a publisher stays when its original has gone: until what it has sent has arrived."""
FIRST_LOOK_SEC: Final = 0.005
LAST_LOOK_SEC: Final = 0.05
"""Between two looks whether it is connected: the delay doubles, from the first to the last."""
MAX_WAITING: Final = 100
"""Messages that wait for that; the oldest one goes first."""
MAX_WAITING_BYTES: Final = 8 * 1024 * 1024
"""The same in bytes; a single message, such as a latched map, may have any size."""


class PatientPublisher:
    """A publisher that is connected before it sends, and stays a moment when it should go.

    Args:
        publisher: The publisher.
        counts: Counts what is dropped.
        loop: The loop.
    """

    def __init__(self, publisher: RosPublisher, counts: Counts, loop: asyncio.AbstractEventLoop) -> None:
        self._publisher = publisher
        self._counts = counts
        self._loop = loop
        self._waiting: deque[bytes] | None = deque()
        """What waits until DDS has connected it; None afterwards."""
        self._waiting_bytes = 0
        self._limit = 0.0
        self._look_sec = FIRST_LOOK_SEC
        self._used_at = loop.time()
        """When it was made, or sent last."""
        self._timer: asyncio.TimerHandle | None = None

    def publish(self, data: bytes, stamp_ns: int) -> None:
        """Publish a message.

        Args:
            data: The message in CDR.
            stamp_ns: Its source's time, which ROS 2 does not take.

        Raises:
            RosError: ROS 2 refuses it.
        """
        del stamp_ns
        self._used_at = self._loop.time()
        if self._waiting is None:
            self._publisher.publish(data)
            return
        if not self._waiting and self._publisher.subscription_count():
            self._waiting = None
            self._publisher.publish(data)
            return
        size = self._waiting_bytes + len(data)
        if len(self._waiting) >= MAX_WAITING or (self._waiting and size > MAX_WAITING_BYTES):
            self._counts.drop("too much waited until DDS connected its publisher")
            return
        self._waiting.append(data)
        self._waiting_bytes = size
        if self._timer is None:
            self._limit = self._used_at + MATCH_SEC
            self._timer = self._loop.call_later(self._look_sec, self._look)

    def _look(self) -> None:
        self._timer = None
        if not self._publisher.subscription_count() and self._loop.time() < self._limit:
            self._look_sec = min(2 * self._look_sec, LAST_LOOK_SEC)
            self._timer = self._loop.call_later(self._look_sec, self._look)
            return
        waiting, self._waiting = self._waiting or (), None
        for data in waiting:
            try:
                self._publisher.publish(data)
            except RosError as error:
                self._counts.drop("refused", str(error))
        self._used_at = self._loop.time()

    def leave(self, left: Callable[[], None]) -> float:
        """Go as soon as nothing of it is on its way any more.

        Args:
            left: Called when it has gone, unless that is at once.

        Returns:
            In how many seconds it will have gone; 0 if it has.
        """
        if self._loop.time() - self._used_at >= LINGER_SEC:
            self.destroy()
            return 0.0
        self._loop.call_later(LINGER_SEC, self._end, left)
        return LINGER_SEC

    def _end(self, left: Callable[[], None]) -> None:
        self.destroy()
        left()

    def destroy(self) -> None:
        """Go at once; what waits is dropped, and counted."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        if self._waiting:
            self._counts.drop("DDS did not connect its publisher", count=len(self._waiting))
        self._waiting = None
        self._publisher.destroy()
