"""A server for clients of rosbridge, and clients."""

from __future__ import annotations

from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

from actors.web.options import WebOptions
from tests.actors.web.rosbridge.bridge import Bridge

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from tests.actors.meeting import Meeting


@pytest.fixture
async def bridge(meeting: Meeting) -> AsyncIterator[Bridge]:
    """A server whose clients may control everything."""
    async with AsyncExitStack() as stack:
        options = WebOptions(port=0, page=False, tools=("rosbridge",), allow_control=True)
        yield await Bridge(stack, meeting, options).open()


@pytest.fixture
async def read_only(meeting: Meeting) -> AsyncIterator[Bridge]:
    """A server whose clients may only read."""
    async with AsyncExitStack() as stack:
        yield await Bridge(stack, meeting, WebOptions(port=0, page=False, tools=("rosbridge",))).open()
