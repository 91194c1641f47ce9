"""Puts what a mesh sends, in a thread: Zenoh's `put` blocks while the network is slower."""

from __future__ import annotations

import logging
import queue
import threading
from typing import TYPE_CHECKING, Any, Final

import zenoh

from broker.mesh.engine.zenoh_config import plain_text

if TYPE_CHECKING:
    from collections.abc import Callable

logger: Final = logging.getLogger("callboard.broker")

MAX_QUEUED_BYTES: Final = 16 * 1024 * 1024
"""Bytes that wait for the thread; others wait in the outbox, which drops what QoS allows to drop."""

OVERHEAD_BYTES: Final = 200
"""What a queued message takes besides its payload."""

MAX_PUBLISHERS: Final = 10_000
"""Keys that Zenoh keeps ready, about 2 KiB each: of topics and other brokers, also of those that are gone."""

STOP_SEC: Final = 5.0
"""How long `stop` waits for what is queued."""


class SendingThread:
    """A queue of messages, and the thread that puts them.

    Args:
        has_space: Called in the thread when there is space again after `full` was true.
        report: Called in the thread with the key of a message that could not be sent, and why.

    Attributes:
        sent: Messages that have been queued so far.
        failed: Those of them that could not be sent.
    """

    def __init__(self, has_space: Callable[[], None], report: Callable[[str, str], None]) -> None:
        self._has_space = has_space
        self._report = report
        self._queue: queue.SimpleQueue[tuple[str, Any, bytes | None] | None] = queue.SimpleQueue()
        self._queued_bytes = self._sent_bytes = 0
        """Written by the event loop only, and by the thread only."""
        self._was_full = False
        self._thread: threading.Thread | None = None
        self.sent = self.failed = 0

    def start(self, session: zenoh.Session) -> None:
        """Begin to put messages."""
        self._thread = threading.Thread(target=self._run, args=(session,), name="callboard-mesh", daemon=True)
        self._thread.start()

    @property
    def full(self) -> bool:
        """Whether so much waits for the thread that the outbox should keep the rest."""
        self._was_full = self.waiting_bytes > MAX_QUEUED_BYTES
        # If the thread has sent so much in between, it has seen that nobody waits, and calls nothing.
        return self._was_full and self.waiting_bytes >= MAX_QUEUED_BYTES // 2

    @property
    def waiting_bytes(self) -> int:
        """The size of what waits for the thread."""
        return self._queued_bytes - self._sent_bytes

    @property
    def bytes_sent(self) -> int:
        """The size of the messages that have been queued so far."""
        return self._queued_bytes - OVERHEAD_BYTES * self.sent

    def put(self, key: str, payload: Any, attachment: bytes | None = None) -> None:
        """Queue a message."""
        self.sent += 1
        self._queued_bytes += len(payload) + OVERHEAD_BYTES
        self._queue.put((key, payload, attachment))

    def stop(self) -> None:
        """Send what waits, within `STOP_SEC`; blocks."""
        self._queue.put(None)
        if self._thread is not None:
            self._thread.join(STOP_SEC)
            if self._thread.is_alive():
                text = "Mesh: stopped with %d bytes that other brokers did not take within %g s"
                logger.warning(text, self.waiting_bytes, STOP_SEC)

    def _run(self, session: zenoh.Session) -> None:
        publishers: dict[str, zenoh.Publisher] = {}
        while True:
            try:
                return self._send_all(session, publishers)
            except Exception:  # a bug: log it, and send the rest
                logger.exception("The mesh's sending thread has lost a message")

    def _send_all(self, session: zenoh.Session, publishers: dict[str, zenoh.Publisher]) -> None:
        while (item := self._queue.get()) is not None:
            key, payload, attachment = item
            try:
                publisher = publishers.get(key)
                if publisher is None:
                    if len(publishers) >= MAX_PUBLISHERS:
                        publishers.pop(next(iter(publishers))).undeclare()  # type: ignore[no-untyped-call]
                    publisher = publishers[key] = session.declare_publisher(
                        key,
                        congestion_control=zenoh.CongestionControl.BLOCK,
                        express=False,
                        allowed_destination=zenoh.Locality.REMOTE,
                    )
                publisher.put(bytes(payload), attachment=attachment)  # pyright: ignore[reportUnknownMemberType]
            except zenoh.ZError as error:
                self.failed += 1
                self._report(key, plain_text(error))
            finally:
                self._sent_bytes += len(payload) + OVERHEAD_BYTES
            if self._was_full and self.waiting_bytes < MAX_QUEUED_BYTES // 2:
                self._was_full = False
                self._has_space()
