"""Computers on a network: network namespaces of Linux, and a switch that delays, loses and cuts.

The switch reads and writes Ethernet frames through TAP devices, so that it needs nothing of the kernel that
some kernels do not have, such as netem.
"""

from __future__ import annotations

import asyncio
import os
import random
import secrets
import shutil
import struct
import subprocess
import sys
from typing import TYPE_CHECKING, Final, Self

if TYPE_CHECKING:
    from types import TracebackType

TUN: Final = "/dev/net/tun"
SET_INTERFACE: Final = 0x400454CA
TAP_WITHOUT_HEADER: Final = 0x0002 | 0x1000
MAX_FRAME_BYTES: Final = 2048


class Computers:
    """Namespaces that reach each other through a switch in this event loop.

    Args:
        count: How many there are.
        delay_sec: How long the switch keeps a frame.
        loss: Which part of the frames it loses.

    Attributes:
        addresses: Their addresses.
        lost: Frames that the switch has lost, those to and from cut computers not included.
    """

    def __init__(self, count: int, *, delay_sec: float = 0.0, loss: float = 0.0) -> None:
        unique = f"cb{os.getpid():x}{secrets.token_hex(2)}"  # as interface: at most 15 bytes
        self._names = [f"{unique}{i}" for i in range(count)]
        self.addresses = [f"10.77.0.{i + 1}" for i in range(count)]
        self._delay_sec = delay_sec
        self._loss = loss
        self._random = random.Random(7)
        self._taps: list[int] = []
        self._cut: set[int] = set()
        self.lost = 0

    async def __aenter__(self) -> Self:
        """Create and connect them."""
        self._loop = asyncio.get_running_loop()
        try:
            for name, address in zip(self._names, self.addresses, strict=True):
                await self._add(name, address)
        except BaseException:
            await self.__aexit__(None, None, None)
            raise
        return self

    async def _add(self, name: str, address: str) -> None:
        import fcntl  # noqa: PLC0415 - not on Windows

        await _run("ip", "netns", "add", name)
        tap = os.open(TUN, os.O_RDWR | os.O_NONBLOCK)
        port = len(self._taps)
        self._taps.append(tap)
        fcntl.ioctl(tap, SET_INTERFACE, struct.pack("16sH22x", name.encode(), TAP_WITHOUT_HEADER))
        await _run("ip", "link", "set", name, "netns", name, "name", "eth")
        await _run("ip", "-n", name, "address", "add", f"{address}/24", "dev", "eth")
        for interface in ("lo", "eth"):
            await _run("ip", "-n", name, "link", "set", interface, "up")
        self._loop.add_reader(tap, self._forward, port)

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Remove them."""
        for tap in self._taps:
            self._loop.remove_reader(tap)
            os.close(tap)
        self._taps.clear()
        for name in self._names:
            await _run("ip", "netns", "delete", name, check=False)

    def command(self, computer: int) -> tuple[str, ...]:
        """Return the command that runs another on a computer."""
        return ("ip", "netns", "exec", self._names[computer])

    def cut(self, computer: int) -> None:
        """Cut the cable of a computer: frames vanish, and nobody is told."""
        self._cut.add(computer)

    def repair(self, computer: int) -> None:
        """Undo a cut."""
        self._cut.discard(computer)

    def _forward(self, source: int) -> None:
        try:
            frame = os.read(self._taps[source], MAX_FRAME_BYTES)
        except OSError:  # nothing to read, or the interface is not up yet
            return
        for target in range(len(self._taps)):  # each interface ignores frames to others
            if target == source or self._cut & {source, target}:
                continue
            if self._random.random() < self._loss:
                self.lost += 1
            elif self._delay_sec:
                self._loop.call_later(self._delay_sec, self._write, target, frame)
            else:
                self._write(target, frame)

    def _write(self, target: int, frame: bytes) -> None:
        try:
            os.write(self._taps[target], frame)
        except (OSError, IndexError):  # it has no space, or has been removed
            self.lost += 1


def reason_without_computers() -> str:
    """Return why there can be no computers here; "" if there can."""
    if sys.platform != "linux":
        return "network namespaces need Linux"
    if os.geteuid() != 0:
        return "network namespaces need root"
    if not shutil.which("ip"):
        return "network namespaces need the command ip"
    if not os.access(TUN, os.R_OK | os.W_OK):
        return f"the switch needs {TUN}"
    name = f"cb{os.getpid():x}{secrets.token_hex(2)}"
    for action in ("add", "delete"):
        ended = subprocess.run(["ip", "netns", action, name], check=False, capture_output=True, text=True)
        if ended.returncode:
            return f"network namespaces cannot be made: {ended.stderr.strip()}"
    return ""


async def _run(*command: str, check: bool = True) -> None:
    process = await asyncio.create_subprocess_exec(*command, stderr=asyncio.subprocess.PIPE)
    _, errors = await process.communicate()
    if check and process.returncode:
        raise RuntimeError(f"{' '.join(command)}: {errors.decode().strip()}")
