"""`callboard broker`: the daemon, as `python -m broker` runs it."""

from __future__ import annotations

import subprocess
import sys
from contextlib import AsyncExitStack, asynccontextmanager, suppress
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Final

from actors.cli.errors import USAGE, CommandError
from actors.cli.interrupts import raise_at_once
from broker.daemon import command

if TYPE_CHECKING:
    import argparse
    from collections.abc import AsyncGenerator
    from contextlib import AbstractAsyncContextManager

    from broker import Broker
    from broker.daemon.command import Beside
    from broker.options import DaemonOptions


EXAMPLES: Final = {
    "callboard broker": "listen on callboard://127.0.0.1:7411, until Ctrl-C",
    "callboard broker --host 0.0.0.0 --auth access.toml": "for other machines: for the users in that file",
    "callboard broker --http 127.0.0.1:7412": "with the page and metrics beside it",
    "callboard broker --http 0.0.0.0:7412 --auth access.toml": "where its users sign in with their tokens",
    "callboard broker --bridge ros2": "in one graph with the ROS 2 nodes of ROS_DOMAIN_ID",
    "callboard broker --config broker.toml": "with the options in a file",
}

CHECK_SEC: Final = 30.0
"""How long the import of ROS 2 may take before the start; half a second is usual."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the daemon's flags."""
    command.add_arguments(parser)


def run(options: argparse.Namespace) -> int:
    """Run the daemon until SIGINT or SIGTERM."""
    # The daemon would import these itself, when a signal already raises.
    import_module("broker.daemon.daemon")
    with suppress(ImportError):
        import_module("uvloop")
    raise_at_once()
    return command.run(options, _prepare)


def _prepare(options: DaemonOptions) -> Beside:
    """Check what shall run beside the broker; return what starts it.

    Raises:
        CommandError: The page cannot be served, or the bridge cannot be started; the exit code is 2.
    """
    from actors.cli.web_address import check_web

    starts: list[Beside] = []
    if options.http is not None:
        check_web(options.http, "--http")
        starts.append(partial(_page_beside, options, options.http))
    if options.bridge is not None:
        arguments: tuple[str, ...] = ("bridge", options.bridge)
        if options.bridge_config is not None:
            arguments += ("--config", str(options.bridge_config))
        _check_bridge(*arguments)
        starts.append(partial(_bridge_beside, options, arguments))
    return partial(_all_beside, starts)


@asynccontextmanager
async def _all_beside(starts: list[Beside], broker: Broker) -> AsyncGenerator[None]:
    async with AsyncExitStack() as stack:
        for start in starts:
            await stack.enter_async_context(start(broker))
        yield


def _page_beside(options: DaemonOptions, listen: str, broker: Broker) -> AbstractAsyncContextManager[None]:
    """Return the page's process, with the users and the certificate of the broker."""
    from actors.cli.beside import web_beside

    further = {
        "--token": options.http_token,
        "--tls-cert": broker.options.tls_cert,
        "--tls-key": broker.options.tls_key,
    }
    arguments = [word for flag, value in further.items() if value for word in (flag, str(value))]
    arguments += ["--allow-control"] * options.http_allow_control
    arguments += ["--read-without-token"] * options.http_read_without_token
    arguments += ["--users"] * (broker.options.auth is not None)
    return web_beside(
        options.http_url or broker.url, listen, *arguments, ca=_trusted(options.http_url, broker)
    )


def _check_bridge(*arguments: str) -> None:
    """Let a process like the bridge's say whether it can start: this one does not import rclpy.

    Raises:
        CommandError: It cannot, or it says nothing; the exit code is 2.
    """
    command_ = [sys.executable, "-m", "actors", *arguments, "--check"]
    try:
        done = subprocess.run(  # noqa: S603 - this program
            command_, capture_output=True, text=True, timeout=CHECK_SEC, check=False
        )
    except subprocess.TimeoutExpired:
        raise CommandError(f"--bridge: importing ROS 2 takes more than {CHECK_SEC:g} s", USAGE) from None
    if done.returncode:
        raise CommandError(f"--bridge: {done.stderr.strip()}", USAGE)


def _bridge_beside(
    options: DaemonOptions, arguments: tuple[str, ...], broker: Broker
) -> AbstractAsyncContextManager[None]:
    """Return the bridge's process, which is a user of the broker like others."""
    from actors.cli.beside import command_beside

    env = {"CALLBOARD_CA": _trusted(options.bridge_url, broker)}
    if options.bridge_token is not None:
        env["CALLBOARD_TOKEN_FILE"] = str(options.bridge_token)
    given = {name: value for name, value in env.items() if value}
    return command_beside("bridge", *arguments, "--url", options.bridge_url or broker.url, env=given)


def _trusted(url: str | None, broker: Broker) -> str:
    """Return the PEM file by which a process beside the broker knows it; "" for that of the environment."""
    from actors.config.environment import tls_files

    # Behind another URL there may be a proxy with its own certificate: then the environment knows better.
    return "" if url and tls_files().ca else str(broker.options.tls_cert or "")
