"""The thread that sends for a mesh, with a session that records what it does."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from broker.mesh import sending_thread
from broker.mesh.sending_thread import SendingThread

if TYPE_CHECKING:
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
