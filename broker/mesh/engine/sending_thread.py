"""Sends a mesh's messages in a thread, because Zenoh's `put` blocks while the network is slower."""

from __future__ import annotations

import logging
import queue
import threading
from typing import TYPE_CHECKING, Any, Final

import zenoh

from broker.mesh.engine.zenoh_config import plain_text

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

logger: Final = logging.getLogger("callboard.broker")

MAX_QUEUED_BYTES: Final = 16 * 1024 * 1024
"""Bytes that may wait for the thread. The rest waits in the outbox, where QoS still applies."""

OVERHEAD_BYTES: Final = 200
"""Memory of a queued message besides its payload."""

MAX_PUBLISHERS: Final = 10_000
"""Zenoh publishers kept, one for each key (a topic, or another broker), about 2 KiB each. Beyond it the
oldest is removed, which also limits keys of topics and brokers that are gone."""

STOP_SEC: Final = 5.0
"""How long `stop` waits until the queue is empty."""


class SendingThread:
    """A queue of messages, and the thread that sends them.

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
        """Total sizes. Each is written by one side only, the first by the event loop, the second by the
        thread, so that neither needs a lock."""
        self._was_full = False
        self._thread: threading.Thread | None = None
        self.sent = self.failed = 0

    def start(self, session: zenoh.Session, source: zenoh.SourceInfo | None = None) -> None:
        """Start the thread.

        Args:
            session: Sends the messages.
            source: What they name as their source.
        """
        options = {} if source is None else {"source_info": source}
        arguments = (session, options)
        self._thread = threading.Thread(target=self._run, args=arguments, name="callboard-mesh", daemon=True)
        self._thread.start()

    @property
    def full(self) -> bool:
        """Whether so much waits for the thread that the outbox should keep the rest."""
        self._was_full = self.waiting_bytes > MAX_QUEUED_BYTES
        # The thread may have sent half between the two lines. It has then not seen the flag, and will not
        # call `has_space`: so the queue must not count as full.
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
        """Send the queued messages, within `STOP_SEC`; blocks."""
        self._queue.put(None)
        if self._thread is not None:
            self._thread.join(STOP_SEC)
            if self._thread.is_alive():
                text = "Mesh: stopped with %d bytes that other brokers did not take within %g s"
                logger.warning(text, self.waiting_bytes, STOP_SEC)

    def _run(self, session: zenoh.Session, options: Mapping[str, Any]) -> None:
        publishers: dict[str, zenoh.Publisher] = {}
        while True:
            try:
                return self._send_all(session, publishers, options)
            except Exception:  # a bug: log it, and send the rest
                logger.exception("The mesh's sending thread has lost a message")

    def _send_all(
        self, session: zenoh.Session, publishers: dict[str, zenoh.Publisher], options: Mapping[str, Any]
    ) -> None:
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
                publisher.put(  # pyright: ignore[reportUnknownMemberType]
                    bytes(payload), attachment=attachment, **options
                )
            except zenoh.ZError as error:
                self.failed += 1
                self._report(key, plain_text(error))
            finally:
                self._sent_bytes += len(payload) + OVERHEAD_BYTES
            if self._was_full and self.waiting_bytes < MAX_QUEUED_BYTES // 2:
                self._was_full = False
                self._has_space()
