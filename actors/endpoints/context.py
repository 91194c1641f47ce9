"""What a node's parts share: its names, link, mailbox and logger, and what happens to a callback's error."""

from __future__ import annotations

import asyncio
from collections import deque
from typing import TYPE_CHECKING, Final

from actors.callbacks.callback_task import current_callback_task
from actors.callbacks.mailbox import Mailbox
from actors.callbacks.timing import SLOW_CALLBACK_SEC, Stopwatch
from actors.errors import NodeDestroyed, WaitTimeout, error_text
from proto import frames
from proto.names import full_node_name

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from actors.endpoints.events import EntityEvents
    from actors.endpoints.timer import Timer
    from actors.logging.logger import Logger
    from actors.session.link import Link
    from proto.publisher_queue import PublisherQueue

DEFAULT_CALL_TIMEOUT_SEC: Final = 60.0

DEPARTING_SLACK: Final = 64
"""Lanes of destroyed publishers that may have become empty, behind one that cannot, before somebody looks."""


class NodeContext:
    """The node as its parts see it. It is also the node's own endpoint on the link.

    Attributes:
        callback_errors: Callbacks that have raised so far.
        watch: Times the node's callbacks.
        stopping: Whether the node begins nothing new: it is on its way out.
        unread: Messages that had come when the node stopped, and were not taken.
        declared: Whether the broker of this session has answered the node's declaration.
        stop: Set by the node: ends it with an error.
        departing: What destroyed publishers have still to send.
    """

    def __init__(
        self,
        *,
        name: str,
        namespace: str,
        log: Logger,
        link: Link,
        default_call_timeout_sec: float,
        stop_on_error: bool,
        slow_callback_sec: float | None = SLOW_CALLBACK_SEC,
    ) -> None:
        self.id = 0
        self.name = name
        self.namespace = namespace
        self.full_name = full_node_name(namespace, name)
        self.log = log
        self.link = link
        self.mailbox = Mailbox()
        self.watch = Stopwatch(log.warning, slow_sec=slow_callback_sec)
        self.default_call_timeout_sec = default_call_timeout_sec
        self.callback_errors = 0
        self.destroyed = False
        self.stopping = False
        self.declared = False
        self.unread = 0
        self.entities: dict[Entity, None] = {}
        self.timers: dict[Timer, None] = {}
        self.departing: deque[PublisherQueue] = deque()
        self._most_departing = DEPARTING_SLACK
        self.stop: Callable[[Exception], None] = _ignore
        self._stop_on_error = stop_on_error
        link.add(self)
        link.handle(frames.Request, self._requested)
        link.handle(frames.Cancel, self._cancelled)
        link.handle(frames.Reply, self._replied)

    def _requested(self, frame: frames.Request) -> None:
        service = self.link.endpoints.get(frame.endpoint)
        if isinstance(service, Server):
            service.requested(frame.entries)

    def _cancelled(self, frame: frames.Cancel) -> None:
        service = self.link.endpoints.get(frame.endpoint)
        if isinstance(service, Server):
            service.cancelled(frame.calls)

    def _replied(self, frame: frames.Reply) -> None:
        client = self.link.endpoints.get(frame.endpoint)
        if isinstance(client, Caller):
            for entry in frame.entries:
                client.replied(entry)

    def departs(self, queue: PublisherQueue) -> None:
        """A publisher has been destroyed; the node does not end before its lane is empty."""
        while self.departing and self.departing[0].empty:
            self._departed(self.departing.popleft())
        if len(self.departing) >= self._most_departing:  # behind one that cannot leave others may have left
            queues, self.departing = self.departing, deque()
            for known in queues:
                if known.empty:
                    self._departed(known)
                else:
                    self.departing.append(known)
            self._most_departing = DEPARTING_SLACK + 2 * len(self.departing)
        self.departing.append(queue)

    def _departed(self, queue: PublisherQueue) -> None:
        self.link.publishers.pop(queue.publisher, None)  # no credit matters any more

    def report_unsent(self, queues: Iterable[PublisherQueue]) -> None:
        """Warn of what destroyed publishers have never sent, what exceeded their depth before included."""
        unsent = sum(queue.unsent for queue in queues if not queue.empty)
        if unsent:
            why = "no time was left" if self.link.connected else f"no link to a broker at {self.link.place}"
            self.log.warning(f"{unsent} published messages were never sent: {why}")

    def require_alive(self) -> None:
        """Raise NodeDestroyed if the node has been destroyed."""
        if self.destroyed:
            raise NodeDestroyed(f"Node '{self.full_name}' has been destroyed")

    def callback_failed(self, what: str, error: BaseException) -> None:
        """A callback raised: log it with its traceback, count it, and stop the node if it asked for that."""
        if self.mailbox.cancelling and isinstance(error, asyncio.CancelledError):
            return  # the node stops, and has done that itself
        self.callback_errors += 1
        self.log.error(f"{what} raised {type(error).__name__}: {error_text(error)}", exc_info=error)
        if self._stop_on_error and isinstance(error, Exception):
            self.stop(error)

    def require_loop(self) -> asyncio.AbstractEventLoop:
        """Return the loop the node runs on; RuntimeError if it does not run."""
        self.require_alive()
        if self.link.loop is None:
            raise RuntimeError(
                f"Node '{self.full_name}' is not running: use `async with node:` or actors.run()"
            )
        return self.link.loop

    async def wait_until(self, condition: Callable[[], bool], what: str, timeout_sec: float | None) -> None:
        """Wait until `condition` holds, looking whenever the link says that something has changed.

        Raises:
            WaitTimeout: It did not within `timeout_sec` (None: the node's default call timeout).
        """
        self.require_loop()
        limit = self.default_call_timeout_sec if timeout_sec is None else timeout_sec
        with in_flight():
            try:
                async with asyncio.timeout(limit):
                    while not condition():
                        await self.link.changed()
                        self.require_alive()
            except TimeoutError as error:
                raise WaitTimeout(f"{what} did not come true within {limit:g} s") from error

    def declaration(self) -> frames.Frame:
        """Endpoint: declare the node."""
        return frames.Node(self.id, self.full_name)

    def accepted(self, number: int) -> None:
        """Endpoint: the broker knows the node."""
        del number
        self.declared = True
        self.link.wake()

    def refused(self, code: int, text: str) -> None:
        """Endpoint: the broker will not have the node."""
        del code
        self.declared = True
        self.link.wake()
        self.log.error(f"The broker refused this node: {text}")

    def matched(self, peers: int, total: int) -> None:
        """Endpoint: nodes have no counterparts."""

    def notice(self, notice: frames.Notice) -> None:
        """Endpoint: a warning."""
        self.log.warning(notice.text)

    def link_lost(self) -> None:
        """Endpoint: the session has ended; the link declares the node again.

        A destroyed publisher that the broker had not accepted yet is declared again, too, and sends then.
        """
        self.declared = False
        self.report_unsent(queue for queue in self.departing if queue.publisher)
        self.departing = deque(queue for queue in self.departing if not queue.publisher)


class Entity:
    """A publisher, subscription, service or client of a node: what they have in common.

    Attributes:
        peers: How many counterparts it has now.
        events: What befalls it beside its messages; None for what has no events.
    """

    def __init__(self, context: NodeContext, events: EntityEvents | None = None) -> None:
        context.require_alive()
        self.id = 0
        self.context = context
        self.events = events
        self.peers = 0
        self.destroyed = False
        context.entities[self] = None

    def require_alive(self) -> None:
        """Raise NodeDestroyed if the entity or its node has been destroyed."""
        if self.destroyed:
            raise NodeDestroyed(f"This {type(self).__name__.lower()} has been destroyed")

    def retire(self) -> None:
        """The node stops: begin nothing new. What callbacks that still run may need goes on."""

    def destroy(self) -> None:
        """Take the entity out of service. A second call does nothing."""
        if self.destroyed:
            return
        self.destroyed = True
        self.context.entities.pop(self, None)
        if self.events is not None:
            self.events.stop()
        self.context.link.remove(self)
        self.context.link.wake()

    def declaration(self) -> frames.Frame:
        """Endpoint: return the frame that declares it."""
        raise NotImplementedError

    def accepted(self, number: int) -> None:
        """Endpoint: the broker knows it."""

    def refused(self, code: int, text: str) -> None:
        """Endpoint: the broker will not have it."""
        del code
        self.context.log.error(f"The broker refused a {type(self).__name__.lower()}: {text}")

    def matched(self, peers: int, total: int) -> None:
        """Endpoint: the number of counterparts."""
        self.peers = peers
        if self.events is not None:
            self.events.matched_now(peers, total)
        self.context.link.wake()

    def notice(self, notice: frames.Notice) -> None:
        """Endpoint: a warning."""
        if self.events is not None:
            self.events.notice(notice)
        else:
            self.context.log.warning(notice.text)

    def link_lost(self) -> None:
        """Endpoint: the session has ended."""
        self.peers = 0
        if self.events is not None:
            self.events.session_over()


class Server(Entity):
    """An entity that serves requests."""

    def requested(self, entries: tuple[frames.RequestEntry, ...]) -> None:
        """Requests came."""
        raise NotImplementedError

    def cancelled(self, calls: tuple[int, ...]) -> None:
        """Callers have given up."""
        raise NotImplementedError


class Caller(Entity):
    """An entity that makes calls."""

    def replied(self, entry: frames.ReplyEntry) -> None:
        """A call has ended."""
        raise NotImplementedError


class in_flight:  # noqa: N801 - reads as a statement
    """While inside, the running callback's turn has a callboard call in flight (see mailbox.py)."""

    __slots__ = ("_callback_task",)

    def __enter__(self) -> None:
        self._callback_task = current_callback_task.get()
        if self._callback_task is not None:
            self._callback_task.call_started()

    def __exit__(self, *_: object) -> None:
        if self._callback_task is not None:
            self._callback_task.call_ended()


def _ignore(error: Exception) -> None:
    del error
