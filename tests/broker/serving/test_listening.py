"""Listening: of many brokers that try, one succeeds, and the others get a clear error."""

from __future__ import annotations

import asyncio
import errno
import fcntl
import os
import pathlib
import socket
import subprocess
import sys
from contextlib import AsyncExitStack, ExitStack
from typing import TYPE_CHECKING, Any

import pytest

from broker import AddressInUseError, Broker, BrokerOptions, ListenError
from broker.serving.listening import listen_unix
from proto.aio.process import new_event_loop
from proto.wire.url import parse_url
from tests.broker.rawclient import DEADLINE_SEC
from tests.fork_server.client import FORKED
from tests.seams.limits import set_limits

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

RACERS = 6
PLACES = 20


@pytest.mark.parametrize("new_loop", [asyncio.new_event_loop, new_event_loop])
@pytest.mark.parametrize("host", ["127.0.0.1", "localhost"])
def test_a_listener_between_bind_and_listen_wins(
    new_loop: Callable[[], asyncio.AbstractEventLoop], host: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """uvloop does not report this failure: the broker detects it, on each loop."""
    set_limits(monkeypatch, probe_sec=0.1)
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
                subprocess.Popen(
                    command,
                    executable=FORKED,
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    text=True,
                    bufsize=1,
                )
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


@pytest.mark.processes
def test_of_many_processes_one_gets_a_port() -> None:
    """All others report that it is in use."""
    with ExitStack() as stack:
        ports: list[str] = []
        for _ in range(PLACES):
            kept = stack.enter_context(socket.socket())  # bound, so that nobody else is given the port
            kept.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            kept.bind(("127.0.0.1", 0))
            ports.append(str(kept.getsockname()[1]))
        for said in zip(*_raced(ports), strict=True):
            assert sorted(said) == ["in use"] * (RACERS - 1) + ["listens"]


@pytest.mark.processes
def test_of_many_processes_one_gets_a_socket_file(tmp_path: Path) -> None:
    """Also in place of a stale one that each of them would remove; afterwards none is left."""
    paths = [tmp_path / f"{number}.sock" for number in range(PLACES)]
    for path in paths[::2]:
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as dead:
            dead.bind(str(path))
    for said in zip(*_raced([str(path) for path in paths]), strict=True):
        assert sorted(said) == ["in use"] * (RACERS - 1) + ["listens"]
    assert not any(path.exists() for path in paths)


async def test_a_locked_folder_delays_a_broker_only_briefly(tmp_path: Path) -> None:
    """After some tries it continues without the lock."""
    folder = os.open(tmp_path, os.O_RDONLY)
    try:
        fcntl.flock(folder, fcntl.LOCK_EX)
        path = tmp_path / "broker.sock"
        loop = asyncio.get_running_loop()
        server, _ = await listen_unix(loop, asyncio.BufferedProtocol, path, backlog=1, lock_tries=2)
        assert server.is_serving()
        server.close()
    finally:
        os.close(folder)


async def test_a_frozen_broker_keeps_its_socket_file(tmp_path: Path) -> None:
    """Even with a full backlog; the check of the file does not block."""
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


async def test_a_broker_removes_only_its_own_socket_file(tmp_path: Path) -> None:
    """A file that has replaced it stays when the broker stops."""
    path = tmp_path / "s"
    async with Broker(BrokerOptions(unix=path)):
        path.unlink()
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as other:
            other.bind(str(path))
    assert path.is_socket()


async def test_a_broker_stops_although_its_socket_file_cannot_be_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """It says so, and listens no more: the next broker replaces the file."""
    path = tmp_path / "s"

    def refuse(self: pathlib.Path, *, missing_ok: bool = False) -> None:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))

    async with Broker(BrokerOptions(unix=path)):
        monkeypatch.setattr(pathlib.Path, "unlink", refuse)
    monkeypatch.undo()
    assert f"Cannot remove {path}: Permission denied" in caplog.text
    async with Broker(BrokerOptions(unix=path)):
        pass
    assert not path.exists()


@pytest.mark.parametrize("new_loop", [asyncio.new_event_loop, new_event_loop])
@pytest.mark.parametrize("host", ["nosuch.invalid", "a..b"])
def test_a_host_that_cannot_be_resolved_is_named(
    new_loop: Callable[[], asyncio.AbstractEventLoop], host: str
) -> None:
    """The error says that the name is wrong, and what to use."""
    with asyncio.Runner(loop_factory=new_loop) as runner, pytest.raises(ListenError) as caught:
        runner.run(Broker(BrokerOptions(host=host)).__aenter__())
    assert f"the name '{host}' cannot be resolved" in str(caught.value)
    assert "--host" in str(caught.value)


@pytest.mark.parametrize("new_loop", [asyncio.new_event_loop, new_event_loop])
def test_an_address_of_another_machine_is_named(new_loop: Callable[[], asyncio.AbstractEventLoop]) -> None:
    """192.0.2.1 is reserved for documentation: no machine has it."""
    wanted = r"does not have the address '192.0.2.1'.*--host"
    with asyncio.Runner(loop_factory=new_loop) as runner, pytest.raises(ListenError, match=wanted):
        runner.run(Broker(BrokerOptions(host="192.0.2.1", port=0)).__aenter__())


@pytest.mark.parametrize("place", ["port", "socket file"])
async def test_an_address_in_use_by_a_broker_is_reported_as_such(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str
) -> None:
    """The error has the agent of the first broker."""
    set_limits(monkeypatch, probe_sec=DEADLINE_SEC)
    options = BrokerOptions(port=0) if place == "port" else BrokerOptions(unix=tmp_path / "s")
    async with Broker(options) as first:
        if place == "port":
            options = BrokerOptions(port=parse_url(first.url).port)
        with pytest.raises(
            AddressInUseError, match=r"a callboard broker \(callboard-broker/.* running there"
        ):
            await Broker(options).__aenter__()


@pytest.mark.parametrize("answer", [b"", b"HTTP/1.1 400 Bad Request\r\n\r\n", b"\xc6\0\0\0\1x"])
async def test_an_address_in_use_by_something_else_is_reported_as_such(
    monkeypatch: pytest.MonkeyPatch, answer: bytes
) -> None:
    """Whatever it answers, or if it answers nothing until the deadline."""
    set_limits(monkeypatch, probe_sec=0.1)

    ended = asyncio.Event()

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(answer)
        await reader.read()
        writer.close()
        ended.set()

    async with await asyncio.start_server(serve, "127.0.0.1", 0) as server:
        port = server.sockets[0].getsockname()[1]
        with pytest.raises(AddressInUseError, match="does not answer as a callboard broker"):
            await Broker(BrokerOptions(port=port)).__aenter__()
        await ended.wait()
