"""What the daemon reports to systemd."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from broker.daemon.service_manager import ServiceManager
from tests.broker.daemon.test_command import end, first_line, started
from tests.broker.rawclient import until

if TYPE_CHECKING:
    from collections.abc import Generator


@contextmanager
def systemd(address: str) -> Generator[socket.socket]:
    """Listen as systemd does."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sock:
        sock.bind("\0" + address[1:] if address.startswith("@") else address)
        sock.settimeout(20)
        yield sock


def received(sock: socket.socket) -> dict[str, str]:
    """Return the next notification as a table."""
    return dict(line.split("=", 1) for line in sock.recv(4096).decode().splitlines())


def discard_received(sock: socket.socket) -> None:
    """Discard the notifications that have been sent already."""
    sock.setblocking(False)
    with suppress(BlockingIOError):
        while True:
            sock.recv(4096)


def address_in(folder: Path, *, abstract: bool) -> str:
    """Return an address of a notification socket that no other test uses."""
    return f"@callboard-{os.getpid()}-{folder.name}" if abstract else str(folder / "notify")


@pytest.mark.parametrize("abstract", [False, True])
def test_notifications_reach_both_kinds_of_sockets(abstract: bool, tmp_path: Path) -> None:
    """Ready, reloading with the time of the monotonic clock, stopping with the time that it takes."""
    address = address_in(tmp_path, abstract=abstract)
    with systemd(address) as sock:
        manager = ServiceManager({"NOTIFY_SOCKET": address})
        manager.notify_ready("Listening\nSTOPPING=1")  # a status is one line
        assert received(sock) == {"READY": "1", "STATUS": "Listening STOPPING=1"}
        before = time.monotonic_ns() // 1000
        manager.notify_reloading()
        reloading = received(sock)
        assert reloading["RELOADING"] == "1"
        assert before <= int(reloading["MONOTONIC_USEC"]) <= time.monotonic_ns() // 1000
        manager.notify_stopping(2.5)
        stopping = received(sock)
        assert (stopping["STOPPING"], stopping["EXTEND_TIMEOUT_USEC"]) == ("1", "2500000")


def test_a_lost_service_manager_is_one_warning(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    """A broker goes on without it."""
    ServiceManager({"NOTIFY_SOCKET": str(tmp_path / "gone")}).notify_ready("x")
    assert [each.message for each in caplog.records] == [
        "Cannot notify the service manager: No such file or directory"
    ]


@pytest.mark.parametrize(
    ("environ", "seconds"),
    [
        ({"WATCHDOG_USEC": "500000"}, 0.5),
        ({"WATCHDOG_USEC": "500000", "WATCHDOG_PID": str(os.getpid())}, 0.5),
        ({"WATCHDOG_USEC": "500000", "WATCHDOG_PID": "1"}, None),  # it watches another process
        ({"WATCHDOG_USEC": "0"}, None),
        ({"WATCHDOG_USEC": "soon"}, None),
        ({}, None),
    ],
)
def test_the_watchdog_is_asked_for_by_the_environment(environ: dict[str, str], seconds: float | None) -> None:
    """Its period counts if it is a number and for this process."""
    assert ServiceManager({"NOTIFY_SOCKET": "@x", **environ}).watchdog_sec == seconds
    assert ServiceManager(environ).watchdog_sec is None


async def test_the_watchdog_is_reset_twice_in_its_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Between two signs of life half of its time passes."""
    pauses: list[float] = []

    async def pause(seconds: float) -> None:
        pauses.append(seconds)
        if len(pauses) == 2:
            raise asyncio.CancelledError

    monkeypatch.setattr(asyncio, "sleep", pause)
    address = address_in(tmp_path, abstract=False)
    with systemd(address) as sock:
        manager = ServiceManager({"NOTIFY_SOCKET": address, "WATCHDOG_USEC": "30000000"})
        with pytest.raises(asyncio.CancelledError):
            await manager.keep_alive()
        assert [received(sock), received(sock)] == [{"WATCHDOG": "1"}] * 2
    assert pauses == [15.0, 15.0]


async def test_without_a_watchdog_there_are_no_signs_of_life() -> None:
    """The task ends at once."""
    async with asyncio.timeout(5):
        await ServiceManager({"NOTIFY_SOCKET": "@x"}).keep_alive()


async def test_a_daemon_reports_its_life(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is ready when it listens, alive, ready again after a reload, and stopping before it waits."""
    address = address_in(tmp_path, abstract=False)
    monkeypatch.setenv("NOTIFY_SOCKET", address)
    with systemd(address) as sock:
        async with started("--port", "0", session=True) as process:
            url = await first_line(process)
            assert received(sock) == {"READY": "1", "STATUS": f"Listening on {url}"}
            process.send_signal(signal.SIGHUP)
            assert received(sock)["RELOADING"] == "1"
            ready = received(sock)
            assert ready["READY"] == "1"
            assert ready["STATUS"] == f"Listening on {url}. Reloaded: no option has changed"
            process.terminate()
            assert received(sock)["EXTEND_TIMEOUT_USEC"] == "10000000"
            assert (await end(process))[0] == 0


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc to know that it is frozen")
async def test_a_frozen_daemon_misses_its_watchdog(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Signs of life come while the loop turns, and none while the process does not."""
    address = address_in(tmp_path, abstract=False)
    monkeypatch.setenv("NOTIFY_SOCKET", address)
    monkeypatch.setenv("WATCHDOG_USEC", "100000")
    with systemd(address) as sock:
        async with started("--port", "0", session=True) as process:
            for _ in range(4):
                assert received(sock).keys() & {"WATCHDOG", "READY"}
            process.send_signal(signal.SIGSTOP)
            status = Path(f"/proc/{process.pid}/stat")
            await until(lambda: status.read_text().rpartition(")")[2].split()[0] == "T")
            discard_received(sock)
            sock.settimeout(0.3)
            with pytest.raises(TimeoutError):
                received(sock)
            process.send_signal(signal.SIGCONT)
            sock.settimeout(20)
            assert received(sock) == {"WATCHDOG": "1"}
