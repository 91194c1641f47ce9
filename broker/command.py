"""The daemon's command line: `python -m broker` and `callboard broker` are the same."""

from __future__ import annotations

import asyncio
import json
import logging
import os
import signal
import sys
import tempfile
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from broker.errors import UnprotectedError
from broker.options import BrokerOptions
from proto.aio import process
from proto.errors import CallboardError

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable

logger: Final = logging.getLogger("callboard.broker")

LEVELS = ("debug", "info", "warning", "error")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the daemon's flags: one for each option, and those of its output."""
    for option in fields(BrokerOptions):
        default: object = option.default
        if default is False:
            parser.add_argument(
                "--" + option.name.replace("_", "-"), action="store_true", help=option.metadata["help"]
            )
            continue
        kind: Callable[[str], object] = Path if default is None else type(default)
        suffix = "" if default is None else f" (default {default})"
        parser.add_argument(
            "--" + option.name.replace("_", "-"),
            type=kind,
            default=default,
            metavar="PATH" if default is None else type(default).__name__.upper(),
            help=option.metadata["help"] + suffix,
        )
    parser.add_argument(
        "--url-file", type=Path, metavar="PATH", help="write the URL it listens on to this file"
    )
    parser.add_argument("--log-level", choices=LEVELS, default="info", help="(default info)")
    parser.add_argument("--json-logs", action="store_true", help="log one JSON object per line")


def run(arguments: argparse.Namespace) -> int:
    """Run the daemon until a signal stops it; return the exit code."""
    _set_up_logging(arguments.log_level, json_lines=arguments.json_logs)
    process.raise_file_limit()
    try:
        options = BrokerOptions(**{f.name: getattr(arguments, f.name) for f in fields(BrokerOptions)})
        with asyncio.Runner(loop_factory=process.new_event_loop) as runner:
            runner.run(_serve(options, arguments.url_file, json_logs=arguments.json_logs))
    except CallboardError as error:
        if arguments.json_logs:
            logger.error("%s", error)  # noqa: TRY400 - its text is complete
        else:
            print(error, file=sys.stderr)  # noqa: T201 - for people
        return 2 if isinstance(error, UnprotectedError) else 1
    except (asyncio.CancelledError, KeyboardInterrupt):
        pass
    return 0


async def _serve(options: BrokerOptions, url_file: Path | None, *, json_logs: bool) -> None:
    from broker.server import Broker  # noqa: PLC0415 - --help needs no server

    task = asyncio.current_task()
    assert task is not None
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        process.add_signal_handler(loop, number, task.cancel)
    _handle_hangup(loop, task.cancel)
    async with Broker(options, node_log_level=logging.INFO) as broker:
        process.configure_process()
        _announce(broker.url)
        if json_logs:
            logger.info("Listening on %s", broker.url)
        url = broker.url + "\n"
        if url_file is not None:
            _write_atomically(url_file, url)
        try:
            await broker.serve_forever()
        finally:
            if url_file is not None:
                _remove(url_file, url)


def _announce(url: str) -> None:
    """Print where the broker listens: scripts wait for this line."""
    try:
        print(f"callboard broker listening on {url}", flush=True)  # noqa: T201
    except OSError as error:
        # The interpreter would try to write the line again at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        reason = error.strerror or str(error)
        raise CallboardError(f"Cannot write to stdout: {reason}") from error


def _remove(path: Path, text: str) -> None:
    """Remove the URL's file, unless it is gone or another broker has written its own URL there."""
    try:
        if path.read_bytes() == text.encode():
            path.unlink()
    except FileNotFoundError:
        pass
    except OSError as error:
        logger.warning("Cannot remove %s: %s", path, error.strerror or error)


def _handle_hangup(loop: asyncio.AbstractEventLoop, stop: Callable[[], object]) -> None:
    """Let SIGHUP stop a broker that was started on a terminal, because the terminal is gone.

    Without a terminal SIGHUP requests a reload, and there is nothing to reload yet. If it is ignored (nohup),
    it stays ignored.
    """
    number = getattr(signal, "SIGHUP", None)  # not on Windows
    if number is None or signal.getsignal(number) is signal.SIG_IGN:
        return
    if _has_terminal():  # checked now: when the signal comes the terminal may be gone
        loop.add_signal_handler(number, stop)
    else:
        loop.add_signal_handler(number, logger.info, "SIGHUP: there is nothing to reload")


def _has_terminal() -> bool:
    try:
        os.close(os.open("/dev/tty", os.O_RDWR | os.O_NOCTTY))
    except OSError:
        return False
    return True


def _write_atomically(path: Path, text: str) -> None:
    """Write a file so that readers see all of it or nothing."""
    written: Path | None = None
    try:
        with tempfile.NamedTemporaryFile("w", dir=path.parent, prefix=path.name, delete=False) as file:
            written = Path(file.name)
            file.write(text)
        written.replace(path)
    except OSError as error:
        if written is not None:
            written.unlink(missing_ok=True)
        reason = error.strerror or str(error)
        raise CallboardError(f"Cannot write the URL to {path}: {reason}") from error


class _JsonLines(logging.Formatter):
    """One JSON object per line."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the record as JSON: time (s since the epoch), level, logger, message."""
        fields_: dict[str, Any] = {
            "time": record.created,
            "level": record.levelname.lower(),
            "logger": record.name,
            "message": record.getMessage(),
        }
        if record.exc_info:
            fields_["exception"] = self.formatException(record.exc_info)
        return json.dumps(fields_)


def _set_up_logging(level: str, *, json_lines: bool) -> None:
    handler = logging.StreamHandler()
    plain = logging.Formatter("[%(levelname)s] [%(created).6f] [broker]: %(message)s")
    handler.setFormatter(_JsonLines() if json_lines else plain)
    logging.basicConfig(level=level.upper(), handlers=[handler])
