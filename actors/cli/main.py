"""`callboard VERB …`: find the verb, run it, and turn the result into an exit code.

`table.py` lists the verbs; only the module of the requested one is imported. Exit codes: 0 done, 1 failed,
2 wrong usage, 3 no usable broker, 124 timeout, 130 SIGINT, 143 SIGTERM; verbs that run until they are stopped
exit with 0 after a signal.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from actors.cli.interrupts import Interrupted, ignore_signals, record_signals, restore_handlers
from actors.cli.table import ALIASES, ELSEWHERE, VERBS, Group, Verb, find_verb, load

# Everything else is imported after the signal handlers are installed.
# ruff: noqa: PLC0415

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence


_HELP = ("-h", "--help", "help")


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code.

    Args:
        argv: The command line without the program's name. None for the process's; the command then also sets
            up the process's streams, signals and log.
    """
    own_process = argv is None
    arguments = sys.argv[1:] if argv is None else list(argv)
    if arguments[:1] == ["help"] and len(arguments) > 1:
        arguments = [*arguments[1:], "--help"]
    arguments = _as_ros(arguments)
    verb, words = find_verb(arguments)
    before = record_signals()
    try:
        return _guarded(verb, arguments, words, own_process=own_process)
    except KeyboardInterrupt as stop:
        number = stop.number if isinstance(stop, Interrupted) else 2
        return 0 if verb is not None and verb.stays else 128 + number
    except ImportError as error:
        return _report_clash(error)
    finally:
        if own_process:
            # The process ends now: a second Ctrl-C or a closed pipe must not add a traceback.
            ignore_signals()
            _discard_output()
        else:
            restore_handlers(before)


def _as_ros(arguments: list[str]) -> list[str]:
    """Return a command line without what only ROS 2 writes in front of a verb.

    Lines are always buffered here. The option for hidden names belongs to the verbs that list names; to
    others it is of use in ROS 2 for completion only.
    """
    if arguments[:1] == ["--use-python-default-buffering"]:
        arguments = arguments[1:]
    word, *rest = arguments or [""]
    hidden = f"--include-hidden-{word}s"
    if word in {"topic", "service"} and rest[:1] == [hidden]:
        rest = [*rest[1:], *([hidden] if rest[1:2] in (["list"], ["find"], ["type"]) else [])]
    return [ALIASES.get(word, word), *rest] if arguments else []


def _guarded(verb: Verb | None, arguments: list[str], words: int, *, own_process: bool) -> int:
    """Run the verb; turn exceptions into exit codes."""
    from actors.cli import errors
    from proto.errors import CallboardError

    try:
        if own_process:
            _set_up_streams()
        code = (
            _run_without_verb(arguments)
            if verb is None
            else _run(verb, arguments, words, own_process=own_process)
        )
        sys.stdout.flush()
        return code
    except SystemExit as stop:  # argparse
        return stop.code if isinstance(stop.code, int) else errors.FAILURE
    except BrokenPipeError:
        return errors.BROKEN_PIPE
    except CallboardError as error:
        return _report(str(error), errors.exit_code(error))
    except OSError as error:
        name = " ".join(["callboard", *arguments[: words if verb else 0]])
        return _report(f"{name}: {_system_text(error)}", errors.FAILURE)


def _run(verb: Verb, arguments: list[str], words: int, *, own_process: bool) -> int:
    from actors.cli.parsing import parser_of

    command = " ".join(arguments[:words])
    options = parser_of(command, verb).parse_args(arguments[words:])
    options.own_process = own_process
    code: int = load(command).run(options)
    return code


def _run_without_verb(arguments: list[str]) -> int:
    """Print help or the version, or raise the error for an unknown verb."""
    from actors.cli import errors

    word = arguments[0] if arguments else ""
    entry = VERBS.get(word)
    command, text, known = "callboard", usage(), dict[str, object](VERBS)
    if isinstance(entry, Group):
        command, text, known = f"callboard {word}", usage_of(word, entry), dict[str, object](entry.verbs)
        word = arguments[1] if len(arguments) > 1 else ""
    elif word == "--version":
        from importlib.metadata import version

        print(f"callboard {version('callboard')}")
        return errors.OK
    if word and word not in _HELP:
        raise _unknown(command, word, known)
    print(text, file=sys.stdout if word else sys.stderr)
    return errors.OK if word else errors.USAGE


def _unknown(command: str, word: str, known: Iterable[str]) -> Exception:
    from actors.cli.errors import USAGE, CommandError
    from actors.tools.suggestions import did_you_mean
    from proto.untrusted_text import escape

    if command == "callboard" and word in ELSEWHERE:
        return CommandError(f"callboard has no '{word}': {ELSEWHERE[word]}", USAGE)
    what = "option" if word.startswith("-") else "verb"
    hint = did_you_mean(word, known) or f"; see {command} --help"
    return CommandError(f"{command}: no {what} '{escape(word)}'{hint}", USAGE)


def usage() -> str:
    """Return the text of `callboard --help`."""
    return (
        "usage: callboard VERB [ARGUMENTS]\n\n"
        "Nodes, topics and services for asyncio, with a broker in between.\n\n"
        f"{_listed(VERBS)}\n\n"
        "  --version  print the version\n"
        "  --help     print this; `callboard VERB --help` describes a verb\n\n"
        "example: callboard demo"
    )


def usage_of(name: str, group: Group) -> str:
    """Return the text of `callboard topic --help`."""
    summary = f"{group.summary[0].upper()}{group.summary[1:]}."
    return (
        f"usage: callboard {name} VERB [ARGUMENTS]\n\n{summary}\n\n{_listed(group.verbs)}\n\n"
        f"`callboard {name} VERB --help` describes a verb.\n\n"
        f"example: callboard {name} {next(iter(group.verbs))}"
    )


def _listed(verbs: Mapping[str, Verb | Group]) -> str:
    width = max(map(len, verbs)) + 1
    return "\n".join(f"  {name:<{width}} {verb.summary}" for name, verb in verbs.items())


def _report_clash(error: ImportError) -> int:
    """Report that another package hides one of callboard's; raise the error if none does."""
    from actors.hidden_packages import hidden_package

    text = hidden_package(error)
    if not text:
        raise error
    print(f"callboard: {text}", file=sys.stderr)
    return 1


def _report(text: str, code: int) -> int:
    from contextlib import suppress

    from actors.cli.output import print_err

    with suppress(OSError):  # stderr is closed; the exit code still reports it
        print_err(text)
    return code


def _system_text(error: OSError) -> str:
    """Return the system's text, without its number, and the file names."""
    import os

    files = [os.fsdecode(each) for each in (error.filename, error.filename2) if isinstance(each, str | bytes)]
    return ": ".join([error.strerror or str(error) or type(error).__name__, *files])


def _set_up_streams() -> None:
    if None in (sys.stdin, sys.stdout, sys.stderr):  # the shell has closed it: >&-
        from proto.aio.process import open_streams

        open_streams()
    for number, name in enumerate(("stdout", "stderr"), 1):
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, "w", encoding="utf-8", closefd=False))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(line_buffering=True, errors="backslashreplace")


def _discard_output() -> None:
    """Discard output for a closed stdout, which would raise when the interpreter exits."""
    try:
        sys.stdout.flush()
    except (OSError, ValueError):
        import os

        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
