"""`python -m broker` as a process: its one line, its signals, its exit codes."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import pty
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from proto.wire import frames
from proto.wire.url import parse_url
from tests.broker.rawclient import GREETING_BYTES, read_frame, until
from tests.fork_server.client import FORKED

if TYPE_CHECKING:
    from asyncio.subprocess import Process
    from collections.abc import AsyncIterator

pytestmark = pytest.mark.processes

PREFIX = "callboard broker listening on "


@contextlib.asynccontextmanager
async def started(*arguments: str, session: bool = False) -> AsyncIterator[Process]:
    """Run the daemon; it is dead afterwards."""
    pipe = asyncio.subprocess.PIPE
    process = await asyncio.create_subprocess_exec(
        *(sys.executable, "-m", "broker", *arguments),
        executable=FORKED,
        stdout=pipe,
        stderr=pipe,
        start_new_session=session,
    )
    try:
        yield process
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        await process.communicate()


async def first_line(process: Process) -> str:
    """Return the URL from the line on stdout."""
    assert process.stdout is not None
    async with asyncio.timeout(20):
        line = (await process.stdout.readline()).decode()
    assert line.startswith(PREFIX), line
    return line.removeprefix(PREFIX).strip()


async def end(process: Process) -> tuple[int | None, str, str]:
    """Wait for the exit; return code, and the rest of stdout and stderr."""
    async with asyncio.timeout(20):
        out, err = await process.communicate()
    return process.returncode, out.decode(), err.decode()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
async def test_it_says_where_it_listens_and_stops_cleanly(number: signal.Signals) -> None:
    """It prints one line with a working URL; a signal ends it with 0, GOODBYE and no traceback."""
    async with started("--port", "0") as process:
        url = parse_url(await first_line(process))
        reader, writer = await asyncio.open_connection(url.host, url.port)
        writer.write(GREETING_BYTES)
        assert isinstance(await read_frame(reader), frames.Welcome)
        process.send_signal(number)
        while not isinstance(await read_frame(reader), frames.Goodbye):
            pass
        writer.close()
        code, out, err = await end(process)
        assert (code, out) == (0, "")
        assert "Traceback" not in err


async def test_its_log_looks_as_that_of_nodes(tmp_path: Path) -> None:
    """Lines have nine digits after the second, and ROS 2's names of levels."""
    config = tmp_path / "broker.toml"
    config.write_text("port = 0\n")
    async with started("--config", str(config), session=True) as process:
        await first_line(process)
        config.write_text("port = 0\nmax_endpoints = 7\n")
        process.send_signal(signal.SIGHUP)
        assert process.stderr is not None
        async with asyncio.timeout(20):
            lines = b"".join([await process.stderr.readline(), await process.stderr.readline()])
    assert re.fullmatch(
        rb"\[INFO\] \[\d+\.\d{9}\] \[broker\]: Reloaded: .*\n"
        rb"\[WARN\] \[\d+\.\d{9}\] \[broker\]: Needs a restart: max_endpoints\n",
        lines,
    ), lines


async def test_a_second_signal_stops_at_once() -> None:
    """A client that does not leave is not waited for again."""
    async with started("--port", "0", "--drain-timeout-sec", "3000") as process:
        url = parse_url(await first_line(process))
        reader, writer = await asyncio.open_connection(url.host, url.port)
        writer.write(GREETING_BYTES)
        await read_frame(reader)
        process.send_signal(signal.SIGTERM)
        while not isinstance(await read_frame(reader), frames.Ping):
            pass
        process.send_signal(signal.SIGTERM)
        code, _, err = await end(process)
        writer.close()
        assert code == 0
        assert "Traceback" not in err


async def test_a_port_in_use_is_one_plain_line() -> None:
    """The second broker says what is wrong and what to do, with exit 1."""
    async with started("--port", "0") as first:
        port = parse_url(await first_line(first)).port
        async with started("--port", str(port)) as second:
            code, out, err = await end(second)
    assert (code, out) == (1, "")
    assert len(err.splitlines()) == 1
    assert f"callboard://127.0.0.1:{port}" in err
    assert "--port" in err


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_behind_stdout_is_one_plain_line() -> None:
    """Case 42: without a line that says where it listens the broker is useless: it exits with 1."""
    command_line = [sys.executable, "-m", "broker", "--port", "0"]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(command_line, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == "Cannot write to stdout: No space left on device\n"


async def test_the_url_file_lives_as_long_as_the_broker(tmp_path: Path) -> None:
    """It has the bare URL, and is removed at the exit."""
    path = tmp_path / "url"
    async with started("--port", "0", "--url-file", str(path)) as process:
        url = await first_line(process)
        await until(path.exists)
        assert path.read_text().strip() == url
        process.terminate()
        assert (await end(process))[0] == 0
    assert os.listdir(tmp_path) == []  # noqa: PTH208 - tells of a forgotten temporary file as well


async def test_a_broker_removes_only_its_own_url_file(tmp_path: Path) -> None:
    """What another broker has written there since stays."""
    path = tmp_path / "url"
    async with started("--port", "0", "--url-file", str(path)) as process:
        await first_line(process)
        await until(path.exists)
        path.write_text("callboard://127.0.0.1:1\n")
        process.terminate()
        assert (await end(process))[0] == 0
    assert path.read_text() == "callboard://127.0.0.1:1\n"


async def test_a_unix_socket_has_a_url_too(tmp_path: Path) -> None:
    """With --unix the line has the socket's URL, and the socket is removed at the exit."""
    path = tmp_path / "s"
    async with started("--unix", str(path)) as process:
        assert await first_line(process) == f"callboard+unix://{path}"
        process.terminate()
        assert (await end(process))[0] == 0
    assert os.listdir(tmp_path) == []  # noqa: PTH208 - tells of a forgotten temporary file as well


@pytest.mark.parametrize(
    ("arguments", "code"), [(["--port", "x"], 2), (["--nonsense"], 2), (["--port", "70000"], 1)]
)
async def test_a_wrong_argument_is_no_traceback(arguments: list[str], code: int) -> None:
    """Usage errors exit with 2, options out of range with one line."""
    async with started(*arguments) as process:
        result, out, err = await end(process)
    assert (result, out) == (code, "")
    assert "Traceback" not in err


async def test_json_logs_are_one_object_per_line() -> None:
    """From the first line on, a log collector can read each line."""
    async with started("--port", "0", "--json-logs") as process:
        url = await first_line(process)
        reader, writer = await asyncio.open_connection(parse_url(url).host, parse_url(url).port)
        writer.write(b"GET / HTTP/1.1\r\n\r\n")
        await reader.read()
        writer.close()
        process.terminate()
        _, _, err = await end(process)
    first, second = [json.loads(line) for line in err.splitlines()]
    assert (first["level"], first["message"]) == ("info", f"Listening on {url}")
    assert (second["level"], second["logger"]) == ("warning", "callboard.broker")


async def test_with_json_logs_an_error_at_the_start_is_an_object_too() -> None:
    """An error that keeps it from listening is a JSON object as well."""
    async with started("--host", "a..b", "--json-logs") as process:
        code, _, err = await end(process)
    assert code == 1
    assert "cannot be resolved" in json.loads(err)["message"]


async def test_sighup_without_a_terminal_does_not_stop_it() -> None:
    """It requests a reload: the broker logs that nothing has changed, and continues."""
    async with started("--port", "0", session=True) as process:
        await first_line(process)
        process.send_signal(signal.SIGHUP)
        assert process.stderr is not None
        async with asyncio.timeout(20):
            assert b"Reloaded: no option has changed" in await process.stderr.readline()
        process.terminate()
        assert (await end(process))[0] == 0


async def test_sighup_reads_the_access_rules_again(tmp_path: Path) -> None:
    """A good file is read, a bad one is named in one line; either way the broker continues."""
    file = tmp_path / "access.toml"
    file.write_text("[users.a]\n")
    async with started("--port", "0", "--auth", str(file), session=True) as process:
        await first_line(process)
        assert process.stderr is not None
        async with asyncio.timeout(20):
            process.send_signal(signal.SIGHUP)
            assert b"Reloaded: the access rules" in await process.stderr.readline()
            file.write_text("")
            process.send_signal(signal.SIGHUP)
            line = await process.stderr.readline()
            assert b"[ERROR]" in line
            assert b"everything remains as it was" in line
            assert b"has no users" in line
        process.terminate()
        assert (await end(process))[0] == 0


async def test_sighup_on_a_terminal_stops_it() -> None:
    """The terminal is closed: the broker stops cleanly."""
    window, inside = pty.openpty()
    with open(window, "rb", buffering=0), open(inside, "rb", buffering=0):  # noqa: ASYNC230, PTH123
        on_terminal = (
            "import fcntl, runpy, sys, termios; fcntl.ioctl(0, termios.TIOCSCTTY, 0);"
            "sys.argv[1:] = ['--port', '0']; runpy.run_module('broker', run_name='__main__')"
        )
        pipe = asyncio.subprocess.PIPE
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-c", on_terminal),
            executable=FORKED,
            stdin=inside,
            stdout=pipe,
            stderr=pipe,
            start_new_session=True,
        )
        try:
            await first_line(process)
            process.send_signal(signal.SIGHUP)
            assert (await end(process))[0] == 0
        finally:
            with contextlib.suppress(ProcessLookupError):
                process.kill()
