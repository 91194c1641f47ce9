"""`callboard broker`: the daemon behind it, and its end."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import ssl
import subprocess
import sys
from typing import TYPE_CHECKING

import aiohttp
import pytest

from actors.cli import web_address
from actors.cli.main import main
from proto.extras import install_command
from tests.certificates import Authority
from tests.fork_server.client import FORKED
from tests.ports import held_port

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path


@pytest.fixture
def address() -> Iterator[str]:
    """A place for the page."""
    with held_port() as port:
        yield f"127.0.0.1:{port}"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
@pytest.mark.processes
async def test_a_signal_ends_the_broker_cleanly(number: signal.Signals) -> None:
    """It says where it listens; stopped, it ends with 0 and without a traceback."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "actors", "broker", "--port", "0"),
        executable=FORKED,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    assert process.stdout is not None
    async with asyncio.timeout(50):
        assert (await process.stdout.readline()).startswith(b"callboard broker listening on callboard://127.")
        process.send_signal(number)
        _, err = await process.communicate()
    assert process.returncode == 0
    assert b"Traceback" not in err


def test_wrong_flags_are_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    """The daemon's flags go through the command line's parser."""
    assert main(["broker", "--prt", "1"]) == 2
    assert capsys.readouterr().err == (
        "callboard broker: unrecognized arguments: --prt; see callboard broker --help\n"
    )


@pytest.mark.processes
async def test_the_page_is_served_beside_the_broker_and_ends_with_it(address: str) -> None:
    """After a crash it is started again."""
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "actors", "broker", "--port", "0", "--http", address),
        executable=FORKED,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    assert process.stdout is not None
    assert process.stderr is not None
    async with asyncio.timeout(50), aiohttp.ClientSession() as client:
        assert (await process.stdout.readline()).startswith(b"callboard broker listening on ")
        assert await process.stdout.readline() == f"callboard web listening on http://{address}/\n".encode()
        started = await process.stderr.readline()
        os.kill(int(started.rsplit(maxsplit=1)[1]), signal.SIGKILL)
        assert await process.stdout.readline() == f"callboard web listening on http://{address}/\n".encode()
        async with client.get(f"http://{address}/readyz") as response:
            assert response.status == 200
        process.send_signal(signal.SIGTERM)
        _, err = await process.communicate()
    assert process.returncode == 0
    assert b"Traceback" not in err
    with socket.create_server(("127.0.0.1", int(address.rsplit(":", 1)[1]))):
        pass  # nobody listens there any more


@pytest.mark.processes
async def test_the_page_trusts_the_certificate_of_its_own_broker(
    address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the options in a file, and in an environment that trusts another authority."""
    own, other = Authority(tmp_path), Authority(tmp_path, "other")
    pair = own.issue("127.0.0.1")
    monkeypatch.setenv("CALLBOARD_CA", str(other.ca))
    (tmp_path / "web.token").write_text("t" * 32)
    options = {"tls_cert": pair.certificate.name, "tls_key": pair.key.name, "http": address}
    options |= {"http_token": "web.token"}
    file = tmp_path / "broker.toml"
    text = "".join(f'{key} = "{value}"\n' for key, value in options.items())
    file.write_text(f"port = 0\nhttp_allow_control = true\n{text}")
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "actors", "broker", "--config", file),
        executable=FORKED,
        stdout=asyncio.subprocess.PIPE,
    )
    assert process.stdout is not None
    async with asyncio.timeout(50), aiohttp.ClientSession() as client:
        assert (await process.stdout.readline()).startswith(b"callboard broker listening on callboards://")
        line = f"callboard web listening on https://{address}/#token={'t' * 32}\n"
        assert await process.stdout.readline() == line.encode()
        trusted = ssl.create_default_context(cafile=own.ca)
        async with client.get(f"https://{address}/readyz", ssl=trusted) as response:
            assert response.status == 200
        process.send_signal(signal.SIGTERM)
        assert await process.wait() == 0


@pytest.mark.processes
@pytest.mark.parametrize(("flags", "status"), [((), 401), (("--http-read-without-token",), 200)])
async def test_who_may_read_the_page_of_a_guarded_broker(
    address: str, tmp_path: Path, flags: tuple[str, ...], status: int
) -> None:
    """Whoever has the token, or everybody on this machine if the broker's owner says so."""
    process = await asyncio.create_subprocess_exec(
        *(
            sys.executable,
            "-m",
            "actors",
            "broker",
            "--unix",
            str(tmp_path / "socket"),
            "--http",
            address,
            *flags,
        ),
        executable=FORKED,
        stdout=asyncio.subprocess.PIPE,
    )
    assert process.stdout is not None
    async with asyncio.timeout(50), aiohttp.ClientSession() as client:
        for start in (b"callboard broker listening on callboard+unix://", b"callboard web listening on "):
            assert (await process.stdout.readline()).startswith(start)
        async with client.get(f"http://{address}/api/topics") as response:
            assert response.status == status
        process.send_signal(signal.SIGTERM)
        assert await process.wait() == 0


@pytest.mark.processes
@pytest.mark.parametrize(
    ("option", "value", "what"), [("http", "127.0.0.1:7412", "page"), ("bridge", "ros2", "bridge")]
)
def test_python_m_broker_has_no_process_beside_it(option: str, value: str, what: str) -> None:
    """It says which program has; in a process, whose logging it sets up."""
    command = [sys.executable, "-m", "broker", "--port", "0", f"--{option}", value]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1
    assert done.stderr == f"{option}: python -m broker has no {what}; start it with `callboard broker`\n"


def test_the_page_needs_a_free_address(capsys: pytest.CaptureFixture[str]) -> None:
    """Checked before the broker listens."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"127.0.0.1:{server.getsockname()[1]}"
        assert main(["broker", "--port", "0", "--http", address]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err == f"--http: cannot listen on {address}: Address already in use\n"


@pytest.mark.processes
def test_a_broker_with_the_page_is_never_idle(address: str) -> None:
    """It does not start with an option that would do nothing; in a process, whose logging it sets up."""
    command = [sys.executable, "-m", "actors", "broker", "--port", "0"]
    command += ["--http", address, "--exit-when-idle", "10"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1
    assert done.stderr == "exit_when_idle cannot be used with http: the page stays connected\n"


def test_the_page_needs_a_name_that_is_known(capsys: pytest.CaptureFixture[str]) -> None:
    """The error is that of the resolver."""
    assert main(["broker", "--port", "0", "--http", "robot..local:7412"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("--http: cannot listen on robot..local:7412: ")
    assert "Unknown error" not in error


@pytest.mark.parametrize("address", ["7412", "127.0.0.1:", "127.0.0.1:65536", ":80"])
def test_the_address_of_the_page_is_checked(address: str, capsys: pytest.CaptureFixture[str]) -> None:
    """One line says how it looks."""
    assert main(["broker", "--port", "0", "--http", address]) == 2
    assert "HOST:PORT" in capsys.readouterr().err


def test_the_page_needs_its_packages(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """One line says how to install them."""

    def find_nothing(_: str) -> None:
        """Find no package."""

    monkeypatch.setattr(web_address, "find_spec", find_nothing)
    assert main(["broker", "--port", "0", "--http", "127.0.0.1:0"]) == 2
    assert capsys.readouterr().err == f"The page needs more packages: {install_command('web')}\n"


def test_control_of_the_page_needs_the_page(capsys: pytest.CaptureFixture[str]) -> None:
    """A flag without effect would mislead."""
    assert main(["broker", "--http-allow-control"]) == 1
    assert capsys.readouterr().err == "http_allow_control needs http, the address of the page\n"


@pytest.fixture
def without_ros(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets processes of this test find no ROS 2."""
    (tmp_path / "rclpy.py").write_text("raise ImportError(\"No module named 'rclpy'\")\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)


@pytest.mark.processes
@pytest.mark.usefixtures("without_ros")
def test_the_bridge_needs_ros(capsys: pytest.CaptureFixture[str]) -> None:
    """One sentence says how to get it, before the broker listens."""
    assert main(["broker", "--port", "0", "--bridge", "ros2"]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith(
        "--bridge: the bridge needs ROS 2's rclpy (No module named 'rclpy'): source "
    )
    assert "pip install '.[ros2]'" in captured.err
    assert captured.err.count("\n") == 1


@pytest.mark.processes
@pytest.mark.usefixtures("without_ros")
def test_the_options_of_the_bridge_are_checked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Before the broker listens; the error names the file."""
    path = tmp_path / "bridge.toml"
    path.write_text("allw = ['/a']")
    assert main(["broker", "--port", "0", "--bridge", "ros2", "--bridge-config", str(path)]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err == f"--bridge: {path}: there is no option 'allw'; did you mean 'allow'?\n"


def test_there_is_one_kind_of_bridge(capsys: pytest.CaptureFixture[str]) -> None:
    """The error names it."""
    assert main(["broker", "--bridge", "ros3"]) == 2
    assert capsys.readouterr().err == "callboard broker: no --bridge 'ros3'; did you mean 'ros2'?\n"
