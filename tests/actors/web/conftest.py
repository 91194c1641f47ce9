"""A web server for a broker of the test."""

from __future__ import annotations

from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

from actors.web import observer
from actors.web.options import WebOptions
from tests.actors.meeting import DEADLINE_SEC
from tests.actors.web.site import Site

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from tests.actors.meeting import Meeting


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the server wait for a busy broker, at its start and for each user."""
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
