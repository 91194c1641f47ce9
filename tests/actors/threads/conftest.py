"""A broker in a thread of its own, for tests without a loop."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import pytest

import actors
from actors.threads import NodeThread
from broker import Broker, BrokerOptions
from tests.actors.meeting import BARE
from tests.seams.limits import be_patient

if TYPE_CHECKING:
    from collections.abc import Iterator


class Host:
    """A thread with a broker; makes nodes for it."""

    def __init__(self, thread: NodeThread) -> None:
        self.thread = thread
        self.url = thread.enter(Broker(BrokerOptions(port=0))).url

    def node(self, name: str, **options: Any) -> actors.Node:
        """Make a node, which is not entered."""
        every: dict[str, Any] = {"url": self.url, "use_global_arguments": False, **BARE}
        return actors.Node(name, **(every | options))


@pytest.fixture
def host(monkeypatch: pytest.MonkeyPatch) -> Iterator[Host]:
    """A broker in a thread; no thread outlives the test."""
    be_patient(monkeypatch)
    before = set(threading.enumerate())
    with NodeThread("host") as thread:
        yield Host(thread)
    assert set(threading.enumerate()) <= before
