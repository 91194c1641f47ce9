"""Listening: of many who try, one gets the place, and the others are told."""

from __future__ import annotations

import asyncio
import fcntl
import os
import socket
import subprocess
import sys
from contextlib import AsyncExitStack, ExitStack
from typing import TYPE_CHECKING, Any

import pytest

from broker import AddressInUseError, Broker, BrokerOptions
from broker.listening import listen_unix
from proto.aio.process import new_event_loop

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

RACERS = 6
PLACES = 20


@pytest.mark.parametrize("new_loop", [asyncio.new_event_loop, new_event_loop])
@pytest.mark.parametrize("host", ["127.0.0.1", "localhost"])
def test_who_listens_between_binding_and_listening_wins(
    new_loop: Callable[[], asyncio.AbstractEventLoop], host: str
) -> None:
    """uvloop keeps this failure to itself: the broker finds it out, on each loop."""
    with asyncio.Runner(loop_factory=new_loop) as runner, socket.socket() as rival:
        rival.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        rival.bind(("127.0.0.1", 0))
        loop = runner.get_loop()
        create = loop.create_server

        async def create_server(*args: Any, **options: Any) -> asyncio.Server:
            server = await create(*args, **options)
            rival.listen()
            return server

        loop.create_server = create_server  # type: ignore[method-assign]

        async def start() -> None:
            async with Broker(BrokerOptions(host=host, port=rival.getsockname()[1])):
                pass

        with pytest.raises(AddressInUseError, match="it is in use"):
            runner.run(start())


def _raced(places: list[str]) -> list[list[str]]:
    """Let processes race for places; return what each of them says of each."""
    command = [sys.executable, "-m", "tests.broker.racer", *places]
    with ExitStack() as stack:
        racers = [
            stack.enter_context(
                subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1)
            )
            for _ in range(RACERS)
        ]
        said: list[list[str]] = []
        for racer in racers:
            assert racer.stdout is not None
            assert racer.stdout.readline() == "ready\n"
        for racer in racers:
            assert racer.stdin is not None
            racer.stdin.write("go\n")
        for racer in racers:
            assert racer.stdout is not None
            said.append([racer.stdout.readline().strip() for _ in places])
        for racer in racers:
            racer.communicate("stop\n")
        return said


def test_of_many_processes_one_gets_a_port() -> None:
    """The others are told that it is in use; nobody fails in another way."""
    with ExitStack() as stack:
        ports: list[str] = []
        for _ in range(PLACES):
            kept = stack.enter_context(socket.socket())  # bound, so that nobody else is given the port
            kept.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            kept.bind(("127.0.0.1", 0))
            ports.append(str(kept.getsockname()[1]))
        for said in zip(*_raced(ports), strict=True):
            assert sorted(said) == ["in use"] * (RACERS - 1) + ["listens"]


def test_of_many_processes_one_gets_a_socket_file(tmp_path: Path) -> None:
    """Also where a dead broker has left one, which each of them would take away; afterwards none is left."""
    paths = [tmp_path / f"{number}.sock" for number in range(PLACES)]
    for path in paths[::2]:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as dead:
            dead.bind(str(path))
    for said in zip(*_raced([str(path) for path in paths]), strict=True):
        assert sorted(said) == ["in use"] * (RACERS - 1) + ["listens"]
    assert not any(path.exists() for path in paths)


async def test_a_folder_that_somebody_keeps_locked_holds_up_nobody(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """After some tries it goes without the lock."""
    monkeypatch.setattr("broker.listening.LOCK_TRIES", 2)
    folder = os.open(tmp_path, os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        path = tmp_path / "broker.sock"
        server = await listen_unix(asyncio.get_running_loop(), asyncio.BufferedProtocol, path, backlog=1)
        assert server.is_serving()
        server.close()
    finally:
        os.close(folder)


async def test_a_broker_that_takes_no_connections_has_its_place_all_the_same(tmp_path: Path) -> None:
    """Frozen, with as many waiting as there is room for: the look at its file waits for nobody."""
    path = tmp_path / "s"
    async with AsyncExitStack() as stack:
        frozen = stack.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM))
        frozen.bind(str(path))
        frozen.listen(0)
        while True:
            waiting = stack.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM))
            waiting.setblocking(False)
            try:
                waiting.connect(str(path))
            except BlockingIOError:
                break
        with pytest.raises(AddressInUseError):
            await stack.enter_async_context(Broker(BrokerOptions(unix=path)))
    assert path.exists()
