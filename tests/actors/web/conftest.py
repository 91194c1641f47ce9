"""A web server for a broker of the test."""

from __future__ import annotations

from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

from actors.web import node_watch, observer, probes
from actors.web.options import WebOptions
from actors.web.routes import lifecycle, operations, parameters
from tests.actors.meeting import DEADLINE_SEC
from tests.actors.web.site import Site

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from tests.actors.meeting import Meeting


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the server wait for brokers and nodes that answer late, because the machine is busy or pauses."""
    for module in (probes, operations):
        monkeypatch.setattr(module, "BROKER_ANSWER_SEC", DEADLINE_SEC)
    for module in (node_watch, lifecycle, parameters):
        monkeypatch.setattr(module, "NODE_ANSWER_SEC", DEADLINE_SEC)
    monkeypatch.setattr(observer, "CONNECT_SEC", DEADLINE_SEC)


@pytest.fixture
async def site(meeting: Meeting) -> AsyncIterator[Site]:
    """A web server with the default options, on a free port."""
    async with AsyncExitStack() as stack:
        yield await Site(stack, meeting).open()


@pytest.fixture
async def control(meeting: Meeting) -> AsyncIterator[Site]:
    """A web server that allows control, and a client with its token."""
    async with AsyncExitStack() as stack:
        site = await Site(stack, meeting, WebOptions(port=0, allow_control=True, token="secret")).open()
        site.client.headers["Authorization"] = "Bearer secret"
        yield site
