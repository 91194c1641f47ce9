"""The node of the live view runs on an event loop of its own."""

from __future__ import annotations

import argparse
import asyncio
import sys
import threading
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Any

import pytest

from actors.cli.commands.top import live
from actors.cli.commands.top.app import TopApp
from actors.errors import BrokerUnreachable

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator

    from actors.node.node import Node
    from tests.actors.cli.conftest import Desk


def options(url: str) -> argparse.Namespace:
    """Return a command line's options."""
    return argparse.Namespace(
        url=url, domain=None, context=None, own_process=False, interval=1.0, filter="", include_hidden=False
    )


async def test_no_broker_is_an_error_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is raised before the screen opens, with a hint how to start a broker."""
    monkeypatch.setattr(live, "SWITCH_INTERVAL_S", sys.getswitchinterval())
    with pytest.raises(BrokerUnreachable, match="Start one"):
        await asyncio.to_thread(live.run, options("callboard://127.0.0.1:1"))
    assert "callboard-node" not in {thread.name for thread in threading.enumerate()}


async def test_the_view_ends_with_the_error_of_its_node(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    """A node that fails behind the screen ends the screen; its error reaches the command."""

    @asynccontextmanager
    async def failing_node(options: argparse.Namespace) -> AsyncGenerator[Node]:
        async with desk.node("viewer", on_error="stop") as node:

            def fail() -> None:
                raise ValueError("the node is broken")

            node.create_timer(0.01, fail)
            yield node

    class Headless(TopApp):
        async def run_async(self, **options: Any) -> None:
            await super().run_async(headless=True, **options)

    monkeypatch.setattr(live, "hidden_node", failing_node)
    monkeypatch.setattr(live, "TopApp", Headless)
    monkeypatch.setattr(live, "SWITCH_INTERVAL_S", sys.getswitchinterval())
    with pytest.raises(ValueError, match="the node is broken"):
        async with asyncio.timeout(20):
            await asyncio.to_thread(live.run, options(desk.url))
    assert "callboard-node" not in {thread.name for thread in threading.enumerate()}
