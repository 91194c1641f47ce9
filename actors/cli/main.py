"""`callboard VERB …`: finds the verb, runs it, and turns whatever happens into an exit code.

A verb is a module with `add_arguments(parser)` and `run(namespace) -> int`. Only the module of the verb that
is asked for is imported. Exit codes: 0 done, 1 failed, 2 wrong usage, 3 no broker, 124 timeout, 130 SIGINT,
143 SIGTERM; the verbs that run until they are stopped end with 0 then.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from actors.cli.interrupts import Interrupted, ignore_signals, note_signals, put_back

# Everything else is imported when signals are taken care of.
# ruff: noqa: PLC0415

if TYPE_CHECKING:
    from collections.abc import Sequence


class Verb(NamedTuple):
    """Where a verb's code is, and what it does."""

    module: str
    summary: str
    stays: bool = False
    """Runs until it is stopped, so that being stopped is no failure; sets up its own log."""


VERBS: Final = {
    "broker": Verb("actors.cli.broker", "run the broker that nodes meet at", stays=True),
    "demo": Verb("actors.cli.demo", "see five nodes talk, in this terminal", stays=True),
    "run": Verb("actors.cli.run", "run a script, or an installed program", stays=True),
    "topic": Verb("actors.cli.topic", "list topics, hear them, publish on them"),
    "service": Verb("actors.cli.service", "list services and call them"),
    "node": Verb("actors.cli.node", "list nodes"),
    "interface": Verb("actors.cli.interface", "show message types, generate their classes"),
    "bench": Verb("actors.cli.bench", "measure how fast callboard is on this machine"),
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
    before = note_signals()
    try:
        return _guarded(verb, arguments, own_process=own_process)
    except KeyboardInterrupt as stop:
        number = stop.number if isinstance(stop, Interrupted) else 2
        return 0 if verb is not None and verb.stays else 128 + number
    finally:
        if own_process:
            ignore_signals()
            _let_go_of_pipes()
        else:
            put_back(before)


def _guarded(verb: Verb | None, arguments: list[str], *, own_process: bool) -> int:
    """Run the verb; turn exceptions into exit codes."""
    from actors.cli import errors
    from proto.errors import CallboardError

    try:
        if own_process:
            _set_up_streams()
        code = _top(arguments) if verb is None else _run(verb, arguments, own_process=own_process)
        sys.stdout.flush()
        return code
    except SystemExit as stop:  # argparse
        return stop.code if isinstance(stop.code, int) else errors.FAILURE
    except BrokenPipeError:
        return errors.BROKEN_PIPE
    except CallboardError as error:
        return _complain(str(error), errors.exit_code(error))
    except OSError as error:
        return _complain(str(error), errors.FAILURE)


def _run(verb: Verb, arguments: list[str], *, own_process: bool) -> int:
    from importlib import import_module

    from actors.cli.parsing import Parser

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
    from actors.cli import errors

    if arguments and arguments[0] == "--version":
        from importlib.metadata import version

        print(f"callboard {version('callboard')}")
        return errors.OK
    if arguments and arguments[0] in {"-h", "--help", "help"}:
        print(usage())
        return errors.OK
    if not arguments:
        print(usage(), file=sys.stderr)
        return errors.USAGE
    from actors.cli.errors import CommandError
    from actors.cli.parsing import did_you_mean
    from proto.errors import shown

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
    from contextlib import suppress

    from actors.cli.output import note

    with suppress(OSError):  # nobody reads it; the exit code still says it
        note(text)
    return code


def _set_up_streams() -> None:
    import os

    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # the shell has closed it: >&-
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115, PTH123
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(line_buffering=True, errors="backslashreplace")


def _set_up_logging() -> None:
    from actors import environment
    from actors.cli import errors
    from actors.cli.errors import CommandError
    from actors.log_output import configure_logging
    from actors.logger import LoggingSeverity

    try:
        configure_logging(environment.log_level() or LoggingSeverity.WARN)
    except ValueError as error:
        raise CommandError(str(error), errors.USAGE) from None


def _let_go_of_pipes() -> None:
    """Whatever is left for a stream that nobody reads must not raise when the interpreter ends."""
    try:
        sys.stdout.flush()
    except (OSError, ValueError):
        import os

        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
