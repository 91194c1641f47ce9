"""callboard's nodes of programs that run in other threads, and what these programs know of matches.

In ROS 2 the endpoints of one process match when they are made, and a program may look at once. Here the
broker matches them: the first look after something was made or destroyed waits for its answer.
"""

from __future__ import annotations

import asyncio
import weakref
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from actors.errors import BrokerUnreachable, WaitTimeout
from actors.node.node import Node
from actors.session.thread_channel import ThreadChannel
from actors.threads.errors import ThreadStopped, TooManyCalls

if TYPE_CHECKING:
    from actors.threads.node_thread import NodeThread

SETTLE_SEC: Final = 5.0
"""How long a look waits for a broker, which is given up after 3 s of silence. Then it sees what is known."""


class ThreadNode(Node):
    """A node whose program runs in other threads than its own. Arguments are those of `Node`."""

    def __init__(self, node_name: str, **options: Any) -> None:
        super().__init__(node_name, **options)
        self._context.link.channel_class = ThreadChannel
        _nodes.add(self)

    @property
    def changes(self) -> int:
        """How many endpoints have been made and destroyed so far."""
        return self._context.link.changes

    async def round_trip(self) -> None:
        """Wait until the broker has handled what was sent, if there is a session."""
        link = self._context.link
        if link.loop is asyncio.get_running_loop():  # not before it runs, nor in a process that was forked
            link.flush()
            with suppress(BrokerUnreachable):
                await link.round_trip()


_nodes: Final[weakref.WeakSet[ThreadNode]] = weakref.WeakSet()
_settled: tuple[int, ...] = ()
"""The changes of all nodes when the broker was asked last."""


def settle(thread: NodeThread) -> None:
    """Wait until the broker has matched what this process has made and destroyed; in any other thread."""
    global _settled  # noqa: PLW0603 - of the process, as the nodes
    changes = tuple(each.changes for each in tuple(_nodes))
    if changes == _settled:
        return
    _settled = changes
    with suppress(WaitTimeout, ThreadStopped, TooManyCalls):
        thread.call(_round_trips, SETTLE_SEC)


async def _round_trips() -> None:
    # Twice: what a frame of one node causes at another has arrived there with its second answer.
    for _ in range(2):
        await asyncio.gather(*(each.round_trip() for each in tuple(_nodes)))
