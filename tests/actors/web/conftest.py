"""A web server for a broker of the test."""

from __future__ import annotations

from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

from actors.web.options import WebOptions
from tests.actors.web.site import Site

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from tests.actors.meeting import Meeting


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
