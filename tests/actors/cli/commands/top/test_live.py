"""The node that looks lives on a loop of its own."""

from __future__ import annotations

import argparse
import asyncio
import threading
from typing import TYPE_CHECKING

import pytest

from actors.cli.commands.top.live import NodeThread
from actors.errors import BrokerUnreachable
from actors.interfaces.std_msgs.msg import String

if TYPE_CHECKING:
    from tests.actors.cli.conftest import Desk


def options(url: str) -> argparse.Namespace:
    """Return a command line's options."""
    return argparse.Namespace(url=url, domain=None, context=None, own_process=False)


async def test_a_lookout_sees_and_hears_from_another_thread(desk: Desk) -> None:
    """And leaves the graph when it is left; its thread has ended then."""
    async with desk.node("talker") as talker:
        publisher = talker.create_publisher(String, "chatter", 10)
        await talker.get_graph()
        async with NodeThread(options(desk.url)) as source:
            assert source.target == desk.url
            look = await source.look()
            assert look.snapshot.nodes() == ["/talker"]
            reader = await source.listen("/chatter", look.snapshot)
            await desk.matched(publisher)
            publisher.publish(String(data="hello"))
            async with asyncio.timeout(20):
                while not (received := await reader.take()).messages:
                    pass
            assert received.messages[0].text == "data: hello"
        assert (await talker.get_graph()).nodes() == ["/talker"]
    assert "callboard-node" not in {thread.name for thread in threading.enumerate()}


async def test_no_broker_is_an_error_at_once() -> None:
    """Raised where it is waited for, with what starts one."""
    with pytest.raises(BrokerUnreachable, match="Start one"):
        async with NodeThread(options("callboard://127.0.0.1:1")):
            pass
