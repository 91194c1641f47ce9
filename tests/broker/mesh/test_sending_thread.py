"""The thread that sends for a mesh, with a session that records what it does."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any, cast

from broker.mesh.engine import sending_thread
from broker.mesh.engine.sending_thread import SendingThread

if TYPE_CHECKING:
    from collections.abc import Iterator

    import pytest


class RecordingSession:
    """Declares publishers that record what they send."""

    def __init__(self) -> None:
        self.declared: list[str] = []
        self.sent: list[tuple[str, bytes]] = []

    def declare_publisher(self, key: str, **options: Any) -> RecordingPublisher:
        """Session."""
        del options
        self.declared.append(key)
        return RecordingPublisher(self, key)


class RecordingPublisher:
    """A publisher of such a session."""

    def __init__(self, session: RecordingSession, key: str) -> None:
        self._session = session
        self._key = key

    def put(self, payload: bytes, attachment: bytes | None = None) -> None:
        """Publisher."""
        del attachment
        self._session.sent.append((self._key, payload))

    def undeclare(self) -> None:
        """Publisher."""
        self._session.declared.remove(self._key)


def test_keys_that_are_not_used_any_more_are_undeclared(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only so many stay declared, and everything is sent in order."""
    monkeypatch.setattr(sending_thread, "MAX_PUBLISHERS", 2)
    session = RecordingSession()
    thread = SendingThread(lambda: None, lambda _key, _reason: None)
    thread.start(cast("Any", session))
    keys = ["a", "b", "a", "c", "a"]
    for key in keys:
        thread.put(key, key.encode())
    thread.stop()
    assert session.sent == [(key, key.encode()) for key in keys]
    assert session.declared == ["c", "a"]


def test_a_queue_that_empties_while_somebody_looks_is_not_full(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody would be called when there is space."""
    sizes: Iterator[int] = iter((sending_thread.MAX_QUEUED_BYTES + 1, 0))
    monkeypatch.setattr(SendingThread, "waiting_bytes", property(lambda _: next(sizes)))
    assert not SendingThread(lambda: None, lambda _key, _reason: None).full


def test_a_thread_with_too_much_to_send_is_full() -> None:
    """The outbox keeps the rest, and drops of that what it may."""
    thread = SendingThread(lambda: None, lambda _key, _reason: None)
    thread.put("a", b"x")
    assert not thread.full
    thread.put("a", bytes(sending_thread.MAX_QUEUED_BYTES))
    assert thread.full


def test_what_could_not_be_sent_before_the_stop_is_logged(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Zenoh's `put` blocks while another broker takes nothing."""
    monkeypatch.setattr(sending_thread, "STOP_SEC", 0.001)
    taken = threading.Event()

    class Blocked(RecordingSession):
        def declare_publisher(self, key: str, **options: Any) -> RecordingPublisher:
            taken.wait(10)
            return super().declare_publisher(key, **options)

    thread = SendingThread(lambda: None, lambda _key, _reason: None)
    thread.start(cast("Any", Blocked()))
    thread.put("a", b"x")
    thread.stop()
    taken.set()
    text = "Mesh: stopped with 201 bytes that other brokers did not take within 0.001 s"
    assert [record.getMessage() for record in caplog.records] == [text]
