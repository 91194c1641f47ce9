"""A broker in a thread, and a context whose nodes live in the process's thread."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

from actors.ros.rclpy.context import Context
from actors.threads import NodeThread
from broker import Broker, BrokerOptions
from tests.seams.limits import be_patient

if TYPE_CHECKING:
    from collections.abc import Iterator


@pytest.fixture(autouse=True)
def _plain_message_classes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the message classes as they are: other tests of this process expect callboard's."""
    monkeypatch.setattr("actors.ros.message_classes.adopt_all", lambda is_ours: None)


@pytest.fixture
def context(monkeypatch: pytest.MonkeyPatch) -> Iterator[Context]:
    """A context that runs, with a broker of its own."""
    be_patient(monkeypatch)
    with NodeThread("broker") as thread:
        monkeypatch.setenv("CALLBOARD_URL", thread.enter(Broker(BrokerOptions(port=0))).url)
        with running_context() as context:
            yield context


def running_context(*args: str) -> Context:
    """Return a context that runs, with command-line arguments."""
    context = Context()
    context.init(list(args), initialize_logging=False)
    return context
