"""Commands run in a thread, on a loop of their own, against a broker and nodes in the test's loop."""

from __future__ import annotations

import asyncio
import json
import os
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest

import actors
from actors.cli.main import main
from actors.endpoints.endpoint import endpoint_of
from broker import Broker, BrokerOptions
from tests.actors.meeting import BARE
from tests.seams.limits import be_patient

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Iterator


class Ended(NamedTuple):
    """How a command ended, and what it and its fellows have printed since the last one ended."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> Any:
        """The only document on stdout."""
        (line,) = self.out.splitlines()
        return json.loads(line)

    @property
    def documents(self) -> list[Any]:
        """The documents on stdout, one a line."""
        return [json.loads(line) for line in self.out.splitlines()]


class Desk:
    """A broker, and commands for it."""

    def __init__(self, url: str, capsys: pytest.CaptureFixture[str]) -> None:
        self.url = url
        self._capsys = capsys

    async def callboard(self, *arguments: str) -> Ended:
        """Run a command that ends by itself."""
        code = await asyncio.to_thread(main, [*arguments, "--url", self.url])
        captured = self._capsys.readouterr()
        return Ended(code, captured.out, captured.err)

    def start(self, *arguments: str) -> asyncio.Task[Ended]:
        """Run a command beside the test."""
        return asyncio.create_task(self.callboard(*arguments))

    def node(self, name: str = "fellow", **options: Any) -> actors.Node:
        """Make a node that meets the commands, by default without standard endpoints."""
        return actors.Node(name, url=self.url, **{**BARE, **options})

    async def matched(self, publisher: actors.Publisher[Any]) -> None:
        """Wait until a publisher has a subscription."""
        await endpoint_of(publisher).context.wait_until(
            lambda: publisher.get_subscription_count() > 0, "Matching", 20.0
        )


@pytest.fixture(autouse=True)
def _callboard_variables_are_put_back() -> Iterator[None]:
    """Verbs that start programs tell these by the environment where to go; the next test must not hear."""
    before = {name: value for name, value in os.environ.items() if name.startswith("CALLBOARD_")}
    yield
    for name in [name for name in os.environ if name.startswith("CALLBOARD_")]:
        del os.environ[name]
    os.environ.update(before)


@pytest.fixture
async def desk(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Desk]:
    """A broker in the test's loop, and commands that wait long for it on a busy machine."""
    be_patient(monkeypatch)
    async with Broker(BrokerOptions(port=0)) as running:
        yield Desk(running.url, capsys)
