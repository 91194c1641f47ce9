"""Forked children neither keep nor disturb the connections and files of their parent."""

from __future__ import annotations

import asyncio
import os
import signal
from typing import TYPE_CHECKING

import pytest

import actors
from tests.integration.conftest import DEADLINE_SEC
from tests.waiting import until

if TYPE_CHECKING:
    from pathlib import Path

    from tests.integration.conftest import System

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")

CLOSER = """
import asyncio, gc, os, socket, sys
import actors
from broker import Broker, BrokerOptions

async def main():
    async with Broker(BrokerOptions(port=0)) as broker, actors.Node("one", url=broker.url) as node:
        await node.get_graph()
        child = os.fork()
        if child == 0:
            # They get the lowest free numbers, those of the connections if the child had closed them.
            files = [open(os.path.join(sys.argv[1], str(number)), "w") for number in range(32)]
            for sock in [each for each in gc.get_objects() if isinstance(each, socket.socket)]:
                sock.close()  # as the garbage collector does with the transports of a stopped loop
            for file in files:
                file.write("whole")
                file.close()
            os._exit(0)
        _, status = await asyncio.to_thread(os.waitpid, child, 0)
        print("child", os.waitstatus_to_exitcode(status), flush=True)
        await node.get_graph()
        async with actors.Node("two", url=broker.url) as other:
            names = await other.get_fully_qualified_node_names()
        print("both" if {"/one", "/two"} <= set(names) else names, flush=True)

asyncio.run(main())
"""

KEEPER = """
import asyncio, os, sys, time
from broker import Broker, BrokerOptions

async def main():
    async with Broker(BrokerOptions(port=int(sys.argv[1]), keepalive_sec=1000)) as broker:
        print("listens", flush=True)
        while not broker.stats().connections:
            await asyncio.sleep(0.01)
        child = os.fork()
        if child == 0:
            print("child", flush=True)
            time.sleep(3600)
        await asyncio.sleep(3600)

LOOP
"""

LOOPS = {
    "asyncio": "asyncio.run(main())",
    "uvloop": "import uvloop; uvloop.run(main())",
}


def _texts(folder: Path) -> list[str]:
    return [path.read_text() for path in folder.iterdir()]


async def test_a_child_closes_neither_its_own_files_nor_its_parents_connections(
    system: System, tmp_path: Path
) -> None:
    """Its copies of the sockets are closed, its files are complete, and the parent's connections work."""
    program = await system.python("-c", CLOSER, str(tmp_path))
    await program.wait_for_line("child 0")
    await program.wait_for_line("both")
    assert await program.wait_for_exit() == 0
    assert set(await asyncio.to_thread(_texts, tmp_path)) == {"whole"}


@pytest.mark.parametrize("loop", LOOPS)
async def test_a_child_does_not_keep_the_connections_of_its_killed_parents_broker(
    system: System, loop: str
) -> None:
    """When a process with an embedded broker is killed, nodes notice at once, and its port is free."""
    parent = await system.python("-c", KEEPER.replace("LOOP", LOOPS[loop]), str(system.port))
    await parent.wait_for_line("listens")
    async with actors.Node("node", url=system.url) as node:
        await node.get_graph()
        await parent.wait_for_line("child")
        parent.send_signal(signal.SIGKILL)
        await until(lambda: not node.connected, "notice the end", deadline_sec=DEADLINE_SEC)
        await system.broker()
        await until(lambda: node.connected, "connect again")
        await node.get_graph()
