"""A node's log on the topic `/rosout`.

Lines may come from any thread. They are collected until the loop turn ends, or, if nobody subscribes, until a
moment after those before, and are then encoded together. They leave as the messages of a latched publisher
do, so that the broker has the last ones for late joiners.
"""

from __future__ import annotations

import threading
from contextlib import contextmanager
from dataclasses import replace
from typing import TYPE_CHECKING, Final

from actors.endpoints.publisher.endpoint import PublisherEndpoint
from actors.interfaces.builtin_interfaces.msg import Time
from actors.interfaces.codec import codec_for
from actors.interfaces.errors import InvalidMessageError
from actors.interfaces.rcl_interfaces.msg import Log
from actors.logging.output import full_text, stamp_ns
from actors.logging.severity import ROOT_NAME
from actors.logging.sinks import add_sink
from actors.qos.profile import qos_from

if TYPE_CHECKING:
    import asyncio
    import logging
    from collections.abc import Generator

    from actors.arguments.remapping import Remapper
    from actors.diagnostics.records import PublisherDiagnostics
    from actors.endpoints.context import NodeContext
    from actors.qos.profile import QoSProfile
    from proto.wire import frames

TOPIC: Final = "/rosout"
MAX_LINES: Final = 10_000
"""Lines that wait for the end of the loop turn or for the first session; beyond it the oldest are dropped."""
MAX_WAITING_CHARACTERS: Final = 16 * 1024 * 1024
"""Characters of the messages that wait; beyond it the oldest lines are dropped."""
QUIET_SEC: Final = 0.1
"""The shortest time between publications while nobody subscribes. A frame for each line would cost ten times
as much as the log call. A line after a silence leaves at once: what a service logs is at the broker when its
caller has the response, and reads the log. A subscription that appears meanwhile gets the rest at once."""
QUIET_LINES: Final = 500
"""Number of collected lines that are published without waiting for the end of `QUIET_SEC`."""
MAX_CHARACTERS: Final = 16_384
"""Characters of a line that are published: many times a long traceback. A line is printed whole."""
MAX_NAME: Final = 1024
"""Characters of a logger's, file's or function's name that are published."""

_codec: Final = codec_for(Log)


class Rosout(PublisherEndpoint):
    """The publisher of one node's log.

    Args:
        context: The node.
        names: Remaps the topic.
        domain: The node's domain.
        qos: The topic's; a profile or a depth.

    Attributes:
        target: The graph and the topic. Nodes of one name in a process publish a line once, as in ROS 2.
    """

    standard = True

    def __init__(self, context: NodeContext, names: Remapper, *, domain: int, qos: QoSProfile | int) -> None:
        self._lines: list[Log] = []
        self._characters = 0
        """Characters of their messages."""
        self._overflow = 0
        """Lines dropped before they were published."""
        self._flush_due = False
        self._lock = threading.RLock()
        """Protects the four above. A garbage collection inside may log, so it is reentrant."""
        self._timer: asyncio.TimerHandle | None = None
        self._quiet_until = 0.0
        """Until then lines are collected while nobody subscribes; in the loop's time."""
        self._thread = 0
        """The thread of the node's loop, from the first session on."""
        self._silent = False
        """Whether what the node's thread logs now is not published, because publishing causes it."""
        topic = names.resolve_topic(TOPIC)
        self.target = (context.link.broker_urls, domain, topic)
        super().__init__(context, Log, topic, qos_from(qos), None)
        self._remove_sink = add_sink(context.log.name, self)

    def accept(self, record: logging.LogRecord) -> None:
        """Publish a record at the end of the loop turn. From any thread."""
        here = threading.get_ident() == self._thread
        # Otherwise a warning about this publisher would be published by it, warn again, and so on for ever.
        if here and self._silent:
            return
        # Outside the lock, as it takes the longest. It also copies what it needs: the record may change
        # afterwards.
        line = _line(record)
        with self._lock:
            if self.refusal or self.destroyed:
                self._overflow += 1
                return
            self._characters += len(line.msg)
            while len(self._lines) >= MAX_LINES or self._characters > MAX_WAITING_CHARACTERS:
                self._characters -= len(self._lines.pop(0).msg)
                self._overflow += 1
            self._lines.append(line)
            loop = self.context.link.loop
            # A flush that is due in `QUIET_SEC` is brought forward once, when `QUIET_LINES` are there.
            due = self._flush_due and (self.peers or len(self._lines) != QUIET_LINES)
            if due or loop is None or loop.is_closed():
                return  # without a loop, the first session flushes
            self._flush_due = True
        if here:
            self._flush_soon()
            return
        left = self.context.link.left
        left.append(self)  # first: the loop may run at once
        try:
            loop.call_soon_threadsafe(self._flush_left)
        except RuntimeError:  # it has been closed meanwhile
            left.pop()

    def _flush_left(self) -> None:
        self._flush_soon()
        self.context.link.left.pop()

    def _flush_soon(self) -> None:
        """Flush at the end of this loop turn, or later if nobody subscribes. In the loop's thread."""
        link = self.context.link
        if self.peers or len(self._lines) >= QUIET_LINES:
            link.flush_later(self)
        elif self._timer is None and link.loop is not None and not self.destroyed:
            if link.loop.time() < self._quiet_until:
                self._timer = link.loop.call_at(self._quiet_until, self._flush_now)
            else:
                self._flush_now()

    def _flush_now(self) -> None:
        link = self.context.link
        self._timer = None
        if link.loop is not None:
            self._quiet_until = link.loop.time() + QUIET_SEC
        link.flush_later(self)

    def matched(self, peers: int, total: int) -> None:
        """Send what has been collected to the first subscription."""
        super().matched(peers, total)
        self.context.link.flush_later(self)

    def flush_turn(self) -> None:
        """Encode the lines, and put them into the publisher queue."""
        with self._lock:
            # Swapped under the lock, encoded after it: threads that log must not wait for that.
            lines, self._lines, self._characters = self._lines, [], 0
            self._flush_due = False
            if self.destroyed:  # another thread was late, and the broker knows this publisher no more
                self._overflow += len(lines)
                return
        if lines:
            with self._silently():
                for line in lines:
                    self._add(line)
        super().flush_turn()

    def _add(self, line: Log) -> None:
        try:
            data = _codec.encode(line)
        except InvalidMessageError:  # a stamp after 2038, say
            with self._lock:
                self._overflow += 1
            return
        if self._batch.add(data):
            super().flush_turn()

    @contextmanager
    def _silently(self) -> Generator[None]:
        """Do not publish what the node's thread logs inside."""
        before, self._silent = self._silent, True
        try:
            yield
        finally:
            self._silent = before

    def declaration(self) -> frames.Frame:
        """Declare the publisher, in the loop's thread."""
        # Here, and not in the constructor: a node may be made in another thread than the one it runs in.
        self._thread = threading.get_ident()
        return super().declaration()

    def accepted(self, number: int) -> None:
        """Send what has been collected. An error about that is not published."""
        with self._silently():
            super().accepted(number)

    def refused(self, code: int, text: str) -> None:
        """Drop what has been collected. The log line about that is not published."""
        with self._silently():
            super().refused(code, text)

    def destroy(self) -> None:
        """Accept no further lines, and send those that were accepted."""
        # First, so that what the rest of this logs does not come back here.
        self._remove_sink()
        if self._timer is not None:
            self._timer.cancel()
        super().destroy()

    def diagnostics(self) -> PublisherDiagnostics:
        """Return its state and counts, with the lines that wait here or were dropped here."""
        found = super().diagnostics()
        with self._lock:
            waiting, overflow = len(self._lines), self._overflow
        return replace(
            found,
            published=found.published + waiting + overflow,
            dropped=found.dropped + overflow,
            queued=found.queued + waiting,
        )


def _line(record: logging.LogRecord) -> Log:
    seconds, nanoseconds = divmod(stamp_ns(record), 1_000_000_000)
    return Log(
        stamp=Time(sec=seconds, nanosec=nanoseconds),
        level=record.levelno,
        name=_text(record.name.removeprefix(ROOT_NAME + "."), MAX_NAME),
        msg=_text(full_text(record), MAX_CHARACTERS),
        file=_text(record.pathname, MAX_NAME),
        function=_text(record.funcName or "", MAX_NAME),
        line=record.lineno or 0,
    )


def _text(text: str, most: int) -> str:
    """Return a string that fits into a message: cut, and with lone surrogates escaped."""
    if len(text) > most:
        text = f"{text[:most]}… and {len(text) - most} more characters"
    return text if text.isascii() else text.encode(errors="backslashreplace").decode()
