"""The daemon with a configuration file: the command line, reloads, the health check."""

from __future__ import annotations

import asyncio
import signal
import sys
import tomllib
from contextlib import asynccontextmanager
from dataclasses import fields
from typing import TYPE_CHECKING

import pytest

from broker import Broker, BrokerOptions
from broker.daemon.configuration import SETTINGS, load_configuration
from broker.daemon.daemon import MESH_SWITCH_SEC, Daemon
from broker.daemon.service_manager import ServiceManager
from broker.options import DaemonOptions
from broker.routing.router_limits import RouterLimits
from proto.aio.tasks import cancel_and_wait
from proto.wire.url import parse_url
from tests.broker import frame_makers as make
from tests.broker.daemon.test_command import end, first_line, started
from tests.broker.rawclient import link, until
from tests.seams.brokers import dispatcher_of

if TYPE_CHECKING:
    from asyncio.subprocess import Process
    from collections.abc import AsyncGenerator
    from pathlib import Path


async def line(process: Process, text: str) -> str:
    """Return the next line on stderr that contains a text."""
    assert process.stderr is not None
    async with asyncio.timeout(20):
        while True:
            raw = await process.stderr.readline()
            assert raw, f"no line with {text!r}"
            if text in raw.decode():
                return raw.decode().rstrip("\n")


@pytest.mark.processes
async def test_a_daemon_with_a_configuration_file(tmp_path: Path) -> None:
    """The file says where it listens, unless the command line does."""
    path = tmp_path / "broker.toml"
    path.write_text('unix = "s"\nport = 70000\n')
    async with started("--config", str(path)) as process:
        code, out, err = await end(process)
        assert (code, out) == (1, "")
        assert err == f"{path}: port must be an integer from 0 to 65535, not 70000\n"
    path.write_text('unix = "s"\njson_logs = true\n')
    async with started("--config", str(path), "--no-json-logs") as process:
        assert await first_line(process) == f"callboard+unix://{tmp_path / 's'}"
        process.terminate()
        assert (await end(process))[::2] == (0, "")


async def test_print_config_prints_and_starts_nothing(tmp_path: Path) -> None:
    """It prints all options that have a value, also those of the command line."""
    path = tmp_path / "broker.toml"
    path.write_text("max_endpoints = 7\n")
    async with started("--config", str(path), "--port", "9", "--print-config") as process:
        code, out, err = await end(process)
    assert (code, err) == (0, "")
    printed = tomllib.loads(out)
    assert (printed["port"], printed["max_endpoints"], printed["log_level"]) == (9, 7, "info")
    assert out.count("\n\n") == len(SETTINGS) - 1


async def test_sighup_applies_what_can_change_and_names_the_rest(tmp_path: Path) -> None:
    """Changed options are applied or need a restart; a wrong file changes nothing and says why once."""
    path = tmp_path / "broker.toml"
    path.write_text("port = 0\n")
    async with started("--config", str(path), session=True) as process:
        await first_line(process)

        async def reload(text: str, *said: str) -> None:
            path.write_text(text)
            process.send_signal(signal.SIGHUP)
            for each in said:
                assert (await line(process, "")).endswith(each)

        await reload("port = 0\n", "Reloaded: no option has changed")
        changes = "suspend_close_sec = 9\nmax_endpoints = 5\n"
        await reload(
            f"port = 7\n{changes}", "Reloaded: suspend_close_sec", "Needs a restart: port, max_endpoints"
        )
        await reload(
            f"prt = 7\n{changes}",
            f"Reload failed, everything remains as it was: {path}: there is no option 'prt';"
            " did you mean 'port'?",
        )
        # What needs a restart is named until it is the same again.
        await reload(changes, "Reloaded: no option has changed", "Needs a restart: port, max_endpoints")
        path.write_text('port = 0\nlog_level = "warning"\n')
        process.send_signal(signal.SIGHUP)
        path.unlink()
        process.send_signal(signal.SIGHUP)
        assert "Cannot read" in await line(process, "ERROR")
        process.terminate()
        assert (await end(process))[0] == 0


@pytest.mark.parametrize("answers", [True, False])
@pytest.mark.processes
async def test_the_health_check_says_whether_a_broker_answers(answers: bool, tmp_path: Path) -> None:
    """It exits with 0 next to a broker with the same options, and with 1 without one."""
    options = ("--unix", str(tmp_path / "s"))
    async with started(*options) as process:
        if answers:
            await first_line(process)
        else:
            process.kill()
            await process.wait()
        async with started(*options, "--healthcheck") as check:
            code, out, err = await end(check)
    assert (code, err) == (0 if answers else 1, "")
    assert out.startswith(f"callboard+unix://{tmp_path / 's'}: ")


async def test_new_limits_hold_for_links_that_exist() -> None:
    """A connected link gets the new limits at once; options that need a restart keep their values."""
    async with Broker(BrokerOptions(port=0, drain_timeout_sec=0.2)) as broker, link(broker, "/slow") as slow:
        slow.send(make.subscription(1))
        await slow.synchronise()
        port = parse_url(broker.url).port
        broker.reconfigure(BrokerOptions(port=1, max_link_bytes=65_536, drain_timeout_sec=0.2))
        assert (broker.options.port, broker.options.max_link_bytes) == (0, 65_536)
        assert parse_url(broker.url).port == port
        (held,) = dispatcher_of(broker).links
        assert held.channel.outbox.max_held_bytes == 65_536
        async with link(broker, "/new"):
            await until(lambda: len(dispatcher_of(broker).links) == 2)
            assert {each.channel.outbox.max_held_bytes for each in dispatcher_of(broker).links} == {65_536}


def test_what_a_router_keeps_needs_a_restart() -> None:
    """A router has its limits for as long as it lives, so a reload must not claim to change them."""
    without_option = {"max_keep_all_queue_bytes", "max_departed_queues"}
    kept = {each.name for each in fields(RouterLimits)} - without_option | {"max_queue_bytes"}
    assert [name for name in kept if SETTINGS[name].reloads] == []


def test_options_of_the_daemon_do_not_clash_with_those_of_the_broker() -> None:
    """Both are keys of the same file."""
    names = [*BrokerOptions.__dataclass_fields__, *DaemonOptions.__dataclass_fields__]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize(("mesh", "intervals"), [("tcp/127.0.0.1:1", [MESH_SWITCH_SEC]), (None, [])])
async def test_the_loop_of_a_broker_in_a_mesh_gives_zenohs_threads_their_turn(
    monkeypatch: pytest.MonkeyPatch, mesh: str | None, intervals: list[float]
) -> None:
    """Case 66: with Python's own interval they wait 5 ms for each message while the loop is busy."""
    set_intervals: list[float] = []
    monkeypatch.setattr(sys, "setswitchinterval", set_intervals.append)
    monkeypatch.setattr("proto.aio.process.configure_process", lambda: None)
    monkeypatch.setattr("proto.aio.process.make_full_collections_rare", lambda: None)
    listening = asyncio.Event()

    @asynccontextmanager
    async def beside(_broker: Broker) -> AsyncGenerator[None]:
        listening.set()
        yield

    configuration = load_configuration({"port": 0, "mesh": mesh})
    daemon = Daemon(configuration, lambda: configuration, ServiceManager({}), beside)
    serving = asyncio.create_task(daemon.serve())
    await until(listening.is_set)
    await cancel_and_wait(serving)
    assert set_intervals == intervals
