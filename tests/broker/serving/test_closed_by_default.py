"""A broker that other machines reach asks who comes, or says why it does not start."""

from __future__ import annotations

import socket
import stat
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest

from broker import Broker, BrokerOptions, UnprotectedError
from proto.aio.process import new_event_loop
from tests.broker.rawclient import RawClient, hello, link
from tests.system import change_user

if TYPE_CHECKING:
    from pathlib import Path

HOSTS = ["0.0.0.0", ""] + (["::"] if socket.has_ipv6 else [])


@pytest.mark.parametrize("host", HOSTS)
async def test_an_open_broker_is_refused(host: str) -> None:
    """Every address but loopback needs rules, or an explicit `insecure`; the error names both ways out."""
    with pytest.raises(UnprotectedError, match=r"--auth FILE.*--insecure"):
        await Broker(BrokerOptions(host=host, port=0)).__aenter__()


@pytest.mark.processes
def test_the_daemon_loop_refuses_as_well(tmp_path: Path) -> None:
    """uvloop reports addresses in its own way; the command ends with code 2 and the text."""
    command = [sys.executable, "-m", "broker", "--host", "0.0.0.0", "--port", "0"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=30, check=False)
    assert done.returncode == 2
    assert "--insecure" in done.stderr
    assert not done.stdout
    assert new_event_loop is not None


async def test_insecure_lets_everybody_in() -> None:
    """The second way out."""
    async with Broker(BrokerOptions(host="0.0.0.0", port=0, insecure=True)) as broker:
        port = int(broker.url.rpartition(":")[2])
        assert port


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "127.0.0.2"])
async def test_loopback_needs_nothing(host: str) -> None:
    """Every address of the loopback device, by number or name."""
    async with Broker(BrokerOptions(host=host, port=0)) as broker, link(broker, "/n"):
        pass


async def test_a_socket_file_is_for_its_owner(tmp_path: Path) -> None:
    """Only the owner may connect to it, unless the broker is insecure."""
    path = tmp_path / "s"
    async with Broker(BrokerOptions(unix=path)):
        assert stat.S_IMODE(path.stat().st_mode) == 0o600
    async with Broker(BrokerOptions(unix=path, insecure=True)):
        assert stat.S_IMODE(path.stat().st_mode) & 0o100


async def test_another_user_at_the_socket_file_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whatever the mode of the file, the other end's user counts."""
    async with Broker(BrokerOptions(unix=tmp_path / "s")) as broker:
        change_user(monkeypatch)
        async with RawClient().connected(broker) as client:
            client.send(hello())
            await client.gone()
        assert broker.stats().endpoints == 0
