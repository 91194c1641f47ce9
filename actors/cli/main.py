"""`callboard VERB …`: finds the verb, runs it, and turns whatever happens into an exit code.

A verb is a module with `add_arguments(parser)` and `run(namespace) -> int`. Only the module of the verb that
is asked for is imported. Exit codes: 0 done, 1 failed, 2 wrong usage, 3 no broker, 124 timeout, 130 SIGINT,
143 SIGTERM; the verbs that run until they are stopped end with 0 then.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from importlib import import_module
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.cli import errors
from actors.cli.errors import CommandError, Interrupted
from proto.errors import CallboardError

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import FrameType


class Verb(NamedTuple):
    """Where a verb's code is, and what it does."""

    module: str
    summary: str
    stays: bool = False
    """Runs until it is stopped, so that being stopped is no failure; sets up its own log."""


VERBS: Final = {
    "broker": Verb("broker.command", "run the broker that nodes meet at", stays=True),
    "demo": Verb("actors.cli.demo", "see five nodes talk, in this terminal", stays=True),
    "run": Verb("actors.cli.run", "run a script, or an installed program", stays=True),
    "topic": Verb("actors.cli.topic", "list topics, hear them, publish on them"),
    "service": Verb("actors.cli.service", "list services and call them"),
    "node": Verb("actors.cli.node", "list nodes"),
    "interface": Verb("actors.cli.interface", "show message types, generate their classes"),
}


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Args:
        argv: The command line without the program's name. None takes the process's, and makes its streams,
            signals and log the command's.
    """
    own_process = argv is None
    arguments = sys.argv[1:] if argv is None else list(argv)
    verb = VERBS.get(arguments[0]) if arguments else None
    before = _catch_signals()
    try:
        if own_process:
            _set_up_streams()
        code = _top(arguments) if verb is None else _run(verb, arguments, own_process=own_process)
        _flush()
    except SystemExit as stop:  # argparse
        code = stop.code if isinstance(stop.code, int) else errors.FAILURE
    except (Interrupted, KeyboardInterrupt) as stop:
        number = stop.number if isinstance(stop, Interrupted) else signal.SIGINT
        code = errors.OK if verb is not None and verb.stays else errors.SIGNALLED + number
    except BrokenPipeError:
        code = errors.BROKEN_PIPE
    except CallboardError as error:
        code = _complain(str(error), errors.exit_code(error))
    except OSError as error:
        code = _complain(str(error), errors.FAILURE)
    finally:
        _restore_signals(None if own_process else before)
    if own_process:
        _let_go_of_pipes()
    return code


def _run(verb: Verb, arguments: list[str], *, own_process: bool) -> int:
    from actors.cli.parsing import Parser  # noqa: PLC0415 - argparse takes time

    module: Any = import_module(verb.module)
    parser = Parser(
        prog=f"callboard {arguments[0]}", description=f"{verb.summary[0].upper()}{verb.summary[1:]}."
    )
    module.add_arguments(parser)
    namespace = parser.parse_args(arguments[1:])
    if own_process and not verb.stays:
        _set_up_logging()
    code: int = module.run(namespace)
    return code


def _top(arguments: list[str]) -> int:
    """What needs no verb."""
    if arguments and arguments[0] == "--version":
        from importlib.metadata import version  # noqa: PLC0415 - takes time

        print(f"callboard {version('callboard')}")
        return errors.OK
    if arguments and arguments[0] in {"-h", "--help", "help"}:
        print(usage())
        return errors.OK
    if not arguments:
        print(usage(), file=sys.stderr)
        return errors.USAGE
    from actors.cli.parsing import did_you_mean  # noqa: PLC0415 - argparse takes time
    from proto.errors import shown  # noqa: PLC0415

    hint = did_you_mean(arguments[0], VERBS) or "; see callboard --help"
    what = "option" if arguments[0].startswith("-") else "verb"
    raise CommandError(f"callboard: no {what} '{shown(arguments[0])}'{hint}", errors.USAGE)


def usage() -> str:
    """Return the text of `callboard --help`."""
    verbs = "\n".join(f"  {name:<10} {verb.summary}" for name, verb in VERBS.items())
    return (
        "usage: callboard VERB [ARGUMENTS]\n\n"
        "Nodes, topics and services for asyncio, with a broker in between.\n\n"
        f"{verbs}\n\n"
        "  --version  print the version\n"
        "  --help     print this; `callboard VERB --help` says more about a verb"
    )


def _complain(text: str, code: int) -> int:
    from actors.cli.output import note  # noqa: PLC0415 - needed in trouble only

    note(text)
    return code


def _set_up_streams() -> None:
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(line_buffering=True, errors="backslashreplace")


def _set_up_logging() -> None:
    from actors import environment  # noqa: PLC0415
    from actors.log_output import configure_logging  # noqa: PLC0415 - `--help` needs no log
    from actors.logger import LoggingSeverity  # noqa: PLC0415

    try:
        configure_logging(environment.log_level() or LoggingSeverity.WARN)
    except ValueError as error:
        raise CommandError(f"CALLBOARD_LOG_LEVEL: {error}", errors.USAGE) from None


def _flush() -> None:
    if sys.stdout is not None:  # pyright: ignore[reportUnnecessaryComparison] - None where it is closed
        sys.stdout.flush()


def _let_go_of_pipes() -> None:
    """Whatever is left for a stream that nobody reads must not raise when the interpreter ends."""
    try:
        _flush()
    except (OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _catch_signals() -> dict[int, Any]:
    """Until a loop takes over, a signal raises; only the main thread may say so."""
    if threading.current_thread() is not threading.main_thread():
        return {}
    return {number: signal.signal(number, _interrupt) for number in (signal.SIGINT, signal.SIGTERM)}


def _interrupt(number: int, frame: FrameType | None) -> None:
    del frame
    raise Interrupted(number)


def _restore_signals(before: dict[int, Any] | None) -> None:
    """Put handlers back; None: the process ends, and is not to be disturbed any more."""
    if before is None:
        before = dict.fromkeys((signal.SIGINT, signal.SIGTERM), signal.SIG_IGN)
    for number, handler in before.items():
        signal.signal(number, handler)
