"""The daemon's command line: `python -m broker` and `callboard broker` are the same."""

from __future__ import annotations

import argparse
import asyncio
import json
import logging
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from broker.daemon.configuration import SETTINGS, Configuration, Setting, load_configuration
from broker.errors import ConfigurationError, UnprotectedError
from proto.aio import process
from proto.errors import CallboardError
from proto.wire.url import BrokerUrl

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractAsyncContextManager

    from broker.options import BrokerOptions, DaemonOptions
    from broker.server import Broker

    Beside = Callable[[Broker], AbstractAsyncContextManager[object]]
    """Returns what is entered with the broker while it listens, in its event loop."""

logger: Final = logging.getLogger("callboard.broker")

_LABELS: Final = {logging.WARNING: "WARN", logging.CRITICAL: "FATAL"}
EXTRA: Final = {
    "config": "TOML file of options (docs/how-to/deploy.md); the command line takes precedence over it",
    "print-config": "print the configuration as such a file, with the source of each value, and exit",
    "healthcheck": "exit with 0 if a broker answers at the address of these options, with 1 if none does",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the daemon's flags: one for each option, and those about the configuration as a whole."""
    for setting in SETTINGS.values():
        _add_setting(parser, setting)
    parser.add_argument("--config", type=Path, metavar="PATH", help=EXTRA["config"])
    for name in ("print-config", "healthcheck"):
        parser.add_argument(f"--{name}", action="store_true", help=EXTRA[name])


def _add_setting(parser: argparse.ArgumentParser, setting: Setting) -> None:
    """Add the flag of an option. If it is not used, the parsed command line does not have the option."""
    further: dict[str, Any] = {"type": setting.kind, "metavar": setting.kind.__name__.upper()}
    if setting.kind is bool:
        further = {"action": argparse.BooleanOptionalAction}
    elif setting.choices:
        further = {"choices": setting.choices}
    suffix = f" (default {setting.default})" if setting.default not in {None, False} else ""
    parser.add_argument(setting.flag, default=argparse.SUPPRESS, help=setting.help + suffix, **further)


def run(
    arguments: argparse.Namespace, prepare_beside: Callable[[DaemonOptions], Beside] | None = None
) -> int:
    """Run the daemon until a signal stops it; return the exit code.

    Args:
        arguments: The parsed command line.
        prepare_beside: Checks the options of what shall run beside the broker before anything listens, if
            there is anything.

    Raises:
        As `prepare_beside`.
    """
    given = {name: value for name, value in vars(arguments).items() if name in SETTINGS}
    # Errors of the configuration file are written before the file can say how to log.
    json_logs = bool(given.get("json_logs"))

    def load() -> Configuration:
        return load_configuration(given, arguments.config)

    try:
        configuration = load()
        if arguments.print_config:
            print(configuration.to_toml(), end="")  # noqa: T201
            return 0
        if arguments.healthcheck:
            return _check_health(configuration.broker_options)
        if prepare_beside is None:
            _require_nothing_beside(configuration.daemon_options)
    except CallboardError as error:
        if json_logs:
            _set_up_logging(json_lines=True)
        return _report(error, json_lines=json_logs)
    options, beside = configuration.daemon_options, None
    if options.beside and prepare_beside is not None:
        beside = prepare_beside(options)
    json_logs = options.json_logs
    _set_up_logging(options.log_level, json_lines=json_logs)
    try:
        _serve(configuration, load, beside)
    except CallboardError as error:
        return _report(error, json_lines=json_logs)
    except (asyncio.CancelledError, KeyboardInterrupt):
        pass
    return 0


def _require_nothing_beside(options: DaemonOptions) -> None:
    """Raise ConfigurationError if the options want a process beside the broker."""
    for name, what in options.beside.items():
        raise ConfigurationError(f"{name}: python -m broker has no {what}; start it with `callboard broker`")


def _report(error: CallboardError, *, json_lines: bool) -> int:
    """Write the error that ends the daemon; return the exit code."""
    if json_lines:
        logger.error("%s", error)
    else:
        print(error, file=sys.stderr)  # noqa: T201 - without a log line's prefix
    # An open broker is a mistake in the command line, as a usage error is.
    return 2 if isinstance(error, UnprotectedError) else 1


def _serve(
    configuration: Configuration,
    load: Callable[[], Configuration],
    beside: Beside | None,
) -> None:
    from broker.daemon.daemon import Daemon  # noqa: PLC0415 - --help needs no server
    from broker.daemon.service_manager import ServiceManager  # noqa: PLC0415

    process.raise_file_limit()
    with asyncio.Runner(loop_factory=process.new_event_loop) as runner:
        runner.run(Daemon(configuration, load, ServiceManager(os.environ), beside).serve())


def _check_health(options: BrokerOptions) -> int:
    """Return 0 if a broker answers where one with these options listens, and 1 if not."""
    from broker.serving.probe import find_broker  # noqa: PLC0415 - --help needs no network

    url = BrokerUrl(options.host, options.port, tls=options.tls_cert is not None)
    if options.unix:
        url = BrokerUrl("", 0, str(options.unix))
    agent = asyncio.run(find_broker(url))
    print(f"{url}: {agent or 'no callboard broker answers'}")  # noqa: T201
    return 0 if agent else 1


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


class _RosLines(logging.Formatter):
    """Lines as nodes write them."""

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802
        """Return the line, without an exception."""
        label = _LABELS.get(record.levelno, record.levelname)
        return f"[{label}] [{record.created:.9f}] [broker]: {record.message}"


def _set_up_logging(level: str = "info", *, json_lines: bool) -> None:
    handler = logging.StreamHandler()
    handler.setFormatter(_JsonLines() if json_lines else _RosLines())
    logging.basicConfig(level=level.upper(), handlers=[handler], force=True)
