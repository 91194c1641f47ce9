"""The daemon: a broker with its URL file, its signals and its service manager."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import sys
from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING, Final

from broker.access.private_file import write_private
from broker.daemon.configuration import SETTINGS
from broker.daemon.idleness import Idleness
from broker.server import Broker
from proto.aio import process
from proto.aio.tasks import cancel_and_wait
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Callable, Generator
    from contextlib import AbstractAsyncContextManager
    from pathlib import Path

    from broker.daemon.configuration import Configuration
    from broker.daemon.service_manager import ServiceManager

logger: Final = logging.getLogger("callboard.broker")

STOP_RESERVE_SEC: Final = 5.0
"""Time that a stop may take beyond `drain_timeout_sec`, on a busy machine."""

MESH_SWITCH_SEC: Final = 0.0005
"""Longest time that the event loop of a broker in a mesh keeps the GIL.

Zenoh's threads need it for each message that they receive or send. With Python's 5 ms they could carry some
200 messages a second while the loop is busy, for instance with the endpoints of another broker."""


class Daemon:
    """A broker as a process of its own.

    Args:
        configuration: What it starts with.
        load: Reads the configuration again, for a reload.
        manager: The service manager that has started this process.
        beside: Entered with the broker while it listens.
    """

    def __init__(
        self,
        configuration: Configuration,
        load: Callable[[], Configuration],
        manager: ServiceManager,
        beside: Callable[[Broker], AbstractAsyncContextManager[object]] | None = None,
    ) -> None:
        self._load = load
        self._manager = manager
        self._beside = beside
        self._status = ""
        """The status line while it listens; "" before and after that."""
        self._options = configuration.daemon_options
        self._values = configuration.values()
        self._broker = Broker(configuration.broker_options, node_log_level=logging.INFO)

    async def serve(self) -> None:
        """Serve until SIGINT or SIGTERM cancels it, or it has been idle; SIGHUP reloads the configuration.

        Raises:
            As `Broker.__aenter__`.
        """
        task = asyncio.current_task()
        assert task is not None
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            process.add_signal_handler(loop, number, task.cancel)
        _handle_hangup(loop, stop=task.cancel, reload=self._reload)
        watchdog = loop.create_task(self._manager.keep_alive())
        try:
            async with self._broker as broker:
                # Here and not earlier: what exists now is skipped by the garbage collector from now on.
                process.configure_process()
                process.make_full_collections_rare()
                if broker.options.joins_mesh:
                    sys.setswitchinterval(MESH_SWITCH_SEC)
                _announce(broker.url)
                if self._options.json_logs:
                    logger.info("Listening on %s", broker.url)
                with _url_file(self._options.url_file, broker.url + "\n"):
                    self._status = f"Listening on {broker.url}"
                    self._manager.notify_ready(self._status)
                    try:
                        async with nullcontext() if self._beside is None else self._beside(broker):
                            await self._serve(broker)
                    finally:
                        self._status = ""
                        self._manager.notify_stopping(broker.options.drain_timeout_sec + STOP_RESERVE_SEC)
        finally:
            await cancel_and_wait(watchdog)

    async def _serve(self, broker: Broker) -> None:
        """Wait until cancelled, or until no client has been connected for as long as the options say."""
        limit = self._options.exit_when_idle
        if limit is None:
            await broker.serve_forever()
            return
        idleness = Idleness(limit, broker.stats())
        while True:
            await asyncio.sleep(idleness.period_sec)
            if idleness.is_over(broker.stats()):
                logger.info("No client has been connected for %g s: the broker ends", limit)
                return

    def _reload(self) -> None:
        """Apply the configuration again. If it is wrong, everything remains as it was."""
        if self._status:
            self._manager.notify_reloading()
        try:
            text = self._apply(self._load())
        except CallboardError as error:
            text = f"Reload failed, everything remains as it was: {error}"
            logger.error("%s", text)  # noqa: TRY400 - its text is complete
        if self._status:
            self._manager.notify_ready(f"{self._status}. {text}")

    def _apply(self, new: Configuration) -> str:
        """Apply the options that can change while the broker runs; return what happened."""
        # Compared with the values in use, not with the file before: an option that needs a restart is named
        # at each reload until then.
        values = new.values()
        changed = [each for name, each in SETTINGS.items() if values[name] != self._values[name]]
        self._broker.reload()  # first, as it may fail: then nothing has changed
        self._broker.reconfigure(new.broker_options)
        logging.getLogger().setLevel(new.daemon_options.log_level.upper())
        applied = [each.name for each in changed if each.reloads]
        self._values |= {name: values[name] for name in applied}
        options = self._broker.options
        files = {"the access rules": options.auth, "the certificate": options.tls_cert}
        read = [name for name, path in files.items() if path is not None]
        text = f"Reloaded: {', '.join(read + applied) or 'no option has changed'}"
        logger.info("%s", text)
        waiting = [each.name for each in changed if not each.reloads]
        if waiting:
            logger.warning("Needs a restart: %s", ", ".join(waiting))
        return text


def _announce(url: str) -> None:
    """Print where the broker listens: scripts wait for this line."""
    try:
        print(f"callboard broker listening on {url}", flush=True)  # noqa: T201
    except OSError as error:
        # The interpreter would try to write the line again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        reason = error.strerror or str(error)
        raise CallboardError(f"Cannot write to stdout: {reason}") from error


@contextmanager
def _url_file(path: Path | None, text: str) -> Generator[None]:
    """Write the file with the broker's URL, if one is wanted, and remove it at the end."""
    if path is None:
        yield
        return
    write_private(path, text)
    try:
        yield
    finally:
        _remove(path, text)


def _remove(path: Path, text: str) -> None:
    """Remove the URL's file, unless it is gone or another broker has written its own URL there."""
    try:
        if path.read_bytes() == text.encode():
            path.unlink()
    except FileNotFoundError:
        pass
    except OSError as error:
        logger.warning("Cannot remove %s: %s", path, error.strerror or error)


def _handle_hangup(
    loop: asyncio.AbstractEventLoop, *, stop: Callable[[], object], reload: Callable[[], object]
) -> None:
    """Let SIGHUP stop a broker that was started on a terminal, because the terminal is gone.

    Without a terminal SIGHUP requests a reload. If it is ignored (nohup), it stays ignored.
    """
    number = getattr(signal, "SIGHUP", None)  # not on Windows
    if number is None or signal.getsignal(number) is signal.SIG_IGN:
        return
    # Checked now: when the signal comes, the terminal is gone.
    loop.add_signal_handler(number, stop if _has_terminal() else reload)


def _has_terminal() -> bool:
    try:
        os.close(os.open("/dev/tty", os.O_RDWR | os.O_NOCTTY))
    except OSError:
        return False
    return True
