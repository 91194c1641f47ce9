"""How often the dialer tries again."""

from __future__ import annotations

import asyncio

import pytest

from actors import Node
from actors.errors import BrokerUnreachable
from actors.session.connector import FIRST_RETRY_SEC, LAST_RETRY_SEC
from tests.simulation.stage import Stage, play


@pytest.mark.parametrize("lasting", [True, False])
def test_after_a_session_that_lasted_it_begins_again_with_short_pauses(*, lasting: bool) -> None:
    """One that broke at once lets them go on growing: a broker that crashes at start is not stormed."""

    async def scene(stage: Stage) -> None:
        node = await stage.enter("node")
        await stage.crash_broker()
        await asyncio.sleep(60)  # the pauses have grown to their limit
        await stage.start_broker()
        await stage.until(lambda: node.connected)
        await asyncio.sleep(LAST_RETRY_SEC + 1 if lasting else 0.01)
        await stage.crash_broker()
        await stage.until(lambda: not node.connected)
        await stage.start_broker()
        took = await stage.until(lambda: node.connected)
        if lasting:
            assert took < 4 * FIRST_RETRY_SEC
        else:
            assert took > LAST_RETRY_SEC / 4

    play(scene)


async def test_another_program_that_has_the_port_is_named() -> None:
    """A broker cannot be started there, so nobody says how to."""

    async def close(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.read(1)
        writer.close()

    async with await asyncio.start_server(close, "127.0.0.1", 0) as server:
        url = f"callboard://127.0.0.1:{server.sockets[0].getsockname()[1]}"
        with pytest.raises(BrokerUnreachable) as caught:
            async with Node("node", url=url, connect_timeout_sec=1.0):
                pass
    assert str(caught.value) == f"No broker at {url}. Something listens at {url} and has not let this node in"


async def test_a_connection_aborted_while_it_connects_is_closed() -> None:
    """A node destroyed at that moment leaves no connection, although its body goes on."""
    received: asyncio.Queue[bytes] = asyncio.Queue()

    async def take(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        received.put_nowait(await reader.read())
        writer.close()

    async with await asyncio.start_server(take, "127.0.0.1", 0) as server:
        url = f"callboard://127.0.0.1:{server.sockets[0].getsockname()[1]}"
        node = Node("node", url=url, use_global_arguments=False)
        asyncio.get_running_loop().call_soon(node.destroy_node)
        async with node, asyncio.timeout(5):
            assert await received.get() == b""
