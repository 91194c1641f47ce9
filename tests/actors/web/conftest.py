"""A web server for a broker of the test."""

from __future__ import annotations

from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

from tests.actors.web.site import Site

if TYPE_CHECKING:
    from collections.abc import AsyncIterator

    from tests.actors.meeting import Meeting


@pytest.fixture
async def site(meeting: Meeting) -> AsyncIterator[Site]:
    """A web server with the default options, on a free port."""
    async with AsyncExitStack() as stack:
        yield await Site(stack, meeting).open()
