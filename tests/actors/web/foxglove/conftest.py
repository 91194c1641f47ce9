"""Servers for Foxglove, and clients."""

from __future__ import annotations

from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

from actors.web.foxglove import parameters
from actors.web.options import WebOptions
from tests.actors.meeting import DEADLINE_SEC
from tests.actors.web.foxglove.peer import SDK, Peer
from tests.actors.web.site import Site

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from tests.actors.meeting import Meeting

TOKEN = "secret"


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the server wait for nodes that answer late, because the machine is busy or pauses."""
    monkeypatch.setattr(parameters, "NODE_ANSWER_SEC", DEADLINE_SEC)


@pytest.fixture
async def site(meeting: Meeting) -> AsyncIterator[Site]:
    """A server for Foxglove alone that allows control."""
    options = WebOptions(port=0, page=False, tools=("foxglove",), allow_control=True, token=TOKEN)
    async with AsyncExitStack() as stack:
        yield await Site(stack, meeting, options).open()


@pytest.fixture
async def peer(site: Site) -> AsyncIterator[Peer]:
    """A client that may control."""
    async with site.client.ws_connect(f"/?token={TOKEN}", protocols=[SDK]) as socket:
        yield Peer(socket)


@pytest.fixture
async def reader(site: Site) -> AsyncIterator[Peer]:
    """A client that may only read."""
    async with site.client.ws_connect("/", protocols=[SDK]) as socket:
        yield Peer(socket)
