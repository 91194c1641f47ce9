"""Shared memory where there is little of it, and between users: messages arrive all the same, as bytes."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final

import pytest

from tests.integration.conftest import NO_KEEPALIVE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.integration.conftest import System

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="arenas are memfds")

MIB: Final = 1024 * 1024
CGROUP_BYTES: Final = 56 * MIB
OTHER_USER: Final = 54321

TALKER = """
import asyncio, os, resource, signal, sys
import actors
from actors.interfaces.std_msgs.msg import UInt8MultiArray

async def main():
    async with actors.Node("talker") as node:
        publisher = node.create_publisher(UInt8MultiArray, "t", actors.QoSProfile(depth=10))
        await publisher.wait_for_subscriptions()
        print("matched", flush=True)
        number = 0
        while number < 400:
            publisher.publish(UInt8MultiArray(data=bytes([number % 251]) * 1_000_000))
            number += 1
            if number == 50:
                shared = node.diagnostics().shared_memory
                print("after 50:", bool(shared.sent), bool(shared.full), shared.problem, flush=True)
            await asyncio.sleep(0.001)
        await publisher.flush()
        shared = node.diagnostics().shared_memory
        print("at the end:", bool(shared.sent), bool(shared.full), shared.problem, flush=True)

{}
actors.run(main)
"""

READER = """
import actors
from actors.interfaces.std_msgs.msg import UInt8MultiArray

class Reader(actors.Node):
    def __init__(self):
        super().__init__("reader")
        self.count = 0
        self.create_subscription(UInt8MultiArray, "t", self.on_message, actors.QoSProfile(depth=100))

    def on_message(self, message):
        data = bytes(message.data)
        assert data == data[:1] * 1_000_000
        self.count += 1
        if self.count == 10:
            print("reading", self.diagnostics().shared_memory.received, flush=True)

{}
actors.run(Reader)
"""

LIMIT_FILES = "resource.setrlimit(resource.RLIMIT_FSIZE, (8 * 2**20, 8 * 2**20))"
OTHER = f"""
import asyncio, os
import actors
from actors.interfaces.std_msgs.msg import UInt8MultiArray
from proto.aio import arena

async def exchange(node, topic):
    got = asyncio.Event()
    node.create_subscription(UInt8MultiArray, topic, lambda _: got.set(), 10)
    publisher = node.create_publisher(UInt8MultiArray, topic, 10)
    await publisher.wait_for_subscriptions()
    for _ in range(3):
        got.clear()
        publisher.publish(UInt8MultiArray(data=bytes(200_000)))
        await got.wait()
    return node.diagnostics().shared_memory

async def main():
    async with actors.Node("root") as node:  # loads all modules, which the other user may not be able to read
        assert (await exchange(node, "root")).sent
    os.setgid({OTHER_USER})
    os.setuid({OTHER_USER})
    if HONEST:
        arena.host_identity.cache_clear()
    async with actors.Node("other") as node:
        shared = await exchange(node, "other")
        print("other:", shared.sent, shared.received, shared.problem, flush=True)

actors.run(main)
"""


async def test_a_limit_of_file_sizes_turns_it_off(system: System) -> None:
    """It holds for memory files, too: the node says so, and sends bytes."""
    await system.broker()
    reader = await system.python("-c", READER.format(""))
    talker = await system.python("-c", TALKER.format(LIMIT_FILES))
    assert await talker.wait_for_line("after 50:") == "after 50: False False no shared memory: File too large"
    assert await reader.wait_for_line("reading") == "reading 0"
    assert await talker.wait_for_exit() == 0
    await reader.stop()


@pytest.fixture
def cgroup() -> Iterator[Path]:
    """Make a control group with little memory."""
    top = Path("/sys/fs/cgroup/memory")
    limit = "memory.limit_in_bytes"
    if not top.is_dir():
        top, limit = Path("/sys/fs/cgroup"), "memory.max"
    group = top / f"callboard-test-{os.getpid()}"
    try:
        group.mkdir()
    except OSError:
        pytest.skip("no right to make control groups")
    try:
        if not (group / limit).exists():
            pytest.skip("this control group has no limit of memory")
        (group / limit).write_text(str(CGROUP_BYTES))
        yield group
    finally:
        group.rmdir()


async def test_a_small_container_is_not_filled(system: System, cgroup: Path) -> None:
    """A reader that is frozen holds memory of the publisher's container, which the kernel would end."""
    await system.broker(*NO_KEEPALIVE)
    reader = await system.python("-c", READER.format(""))
    enter = f"open({str(cgroup / 'cgroup.procs')!r}, 'w').write(str(os.getpid()))"
    talker = await system.python("-c", TALKER.format(enter))
    assert int((await reader.wait_for_line("reading")).split()[1]) > 0
    reader.send_signal(signal.SIGSTOP)
    assert await talker.wait_for_line("at the end:") == "at the end: True True "
    reader.send_signal(signal.SIGCONT)
    assert await talker.wait_for_exit() == 0
    await reader.stop()


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs root")
@pytest.mark.parametrize(("honest", "problem"), [(True, ""), (False, "Permission denied")])
async def test_another_user_gets_bytes(system: System, problem: str, *, honest: bool) -> None:
    """Also one that claims to be the broker's user: the kernel does not let it read the broker's secret."""
    await system.broker()
    other = await system.python("-c", OTHER.replace("HONEST", str(honest)))
    line = await other.wait_for_line("other:")
    assert line.startswith("other: 0 0")
    assert problem in line
    assert await other.wait_for_exit() == 0
