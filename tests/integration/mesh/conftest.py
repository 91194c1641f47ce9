"""What tests of meshes share."""

from __future__ import annotations

from contextlib import AsyncExitStack
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import AsyncIterator


@pytest.fixture
async def stack() -> AsyncIterator[AsyncExitStack]:
    """Leaves stations at the end, before their brokers are killed."""
    async with AsyncExitStack() as entered:
        yield entered
