"""Wakes the asyncio loop when a message, request or response has arrived in ROS 2.

rclpy's executors walk all of their endpoints at each wake-up, or need a thread. Here ROS 2's threads write to
an eventfd of the endpoint, in C and without Python's lock, and the loop waits for it as for a socket. So the
cost of a message does not depend on the number of endpoints.
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Final

from actors.bridges.ros2.errors import RosError
from actors.bridges.ros2.importing import ARRIVAL_FUNCTIONS
from proto.aio.process import raise_file_limit
from proto.wire.codes import EntryKind

if TYPE_CHECKING:
    import asyncio
    from collections.abc import Callable, Mapping

    from actors.bridges.ros2.importing import Ros

MAX_TAKES_PER_TURN: Final = 16
"""Messages taken from one endpoint in one turn of the loop: more than the default depth, and 16 of 1 MiB take
no longer than a callback of a node may."""

RETRY_SEC: Final = 1.0
"""Pause after ROS 2 has refused to hand over what has arrived, so that a lasting fault is no busy loop."""

_FUNCTIONS: Final[Mapping[EntryKind, str]] = dict(
    zip((EntryKind.SUBSCRIPTION, EntryKind.SERVICE, EntryKind.CLIENT), ARRIVAL_FUNCTIONS, strict=True)
)


class Arrivals:
    """The endpoints of ROS 2 that an asyncio loop waits for.

    Attributes:
        ros: ROS 2.
        loop: The loop.
        on_error: Called with each exception of an endpoint's callback, and with what ROS 2 raises; the
            endpoint goes on with what arrives next.
    """

    def __init__(
        self, ros: Ros, loop: asyncio.AbstractEventLoop, on_error: Callable[[Exception], None]
    ) -> None:
        self.ros = ros
        self.loop = loop
        self.on_error = on_error
        raise_file_limit(None)  # each endpoint has a file descriptor

    def watch(self, handle: Any, kind: EntryKind, take: Callable[[int], bool]) -> Watch:
        """Call a function when something has arrived at an endpoint, also for what has arrived before.

        Args:
            handle: rclpy's handle of the endpoint.
            kind: SUBSCRIPTION, SERVICE or CLIENT.
            take: Gets the number of arrivals since its last call, takes up to `MAX_TAKES_PER_TURN`, and
                returns whether there may be more. Then it is called again in the next turn of the loop, and
                after an exception when `RETRY_SEC` have passed.

        Returns:
            The watch. Close it before the endpoint is destroyed.

        Raises:
            RosError: There are too many open files, or ROS 2 refuses.
        """
        return Watch(self, handle, kind, take)


class Watch:
    """One endpoint that a loop waits for; `Arrivals.watch` makes it."""

    def __init__(self, arrivals: Arrivals, handle: Any, kind: EntryKind, take: Callable[[int], bool]) -> None:
        self._set_callback = getattr(arrivals.ros.rcl, _FUNCTIONS[kind])
        self._loop = loop = arrivals.loop
        self._on_error = arrivals.on_error
        self._handle = handle
        self._take = take
        self._again: asyncio.Handle | None = None
        self._count = 0
        try:
            self._fd = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        except OSError as error:
            raise RosError(
                f"the bridge cannot open a file for another endpoint of ROS 2 ({error.strerror}): raise the "
                "limit of open files (ulimit -n)"
            ) from error
        loop.add_reader(self._fd, self._arrived)
        with handle:
            code = self._set_callback(handle.pointer, arrivals.ros.eventfd_write, self._fd)
        if code:
            self.close()
            raise RosError(f"{_FUNCTIONS[kind]} failed with code {code}")
        # rmw_fastrtps counts what has arrived before, and sets the callback afterwards: what arrives in
        # between would wake nobody until the next message.
        self._again = loop.call_soon(self._run)

    def close(self) -> None:
        """Stop; ROS 2's threads do not write to the file descriptor any more."""
        if self._fd < 0:
            return
        with self._handle:
            self._set_callback(self._handle.pointer, None, None)
        self._loop.remove_reader(self._fd)
        os.close(self._fd)
        self._fd = -1
        if self._again is not None:
            self._again.cancel()

    def _arrived(self) -> None:
        self._count += os.eventfd_read(self._fd)
        if self._again is None:
            self._run()

    def _run(self) -> None:
        self._again = None
        count, self._count = self._count, 0
        try:
            has_more = self._take(count)
        except Exception as error:  # noqa: BLE001 - of rclpy, which does not list what it raises
            self._on_error(error)
            if self._fd >= 0:
                self._again = self._loop.call_later(RETRY_SEC, self._run)
        else:
            if has_more and self._fd >= 0:
                self._count += max(0, count - MAX_TAKES_PER_TURN)
                self._again = self._loop.call_soon(self._run)
