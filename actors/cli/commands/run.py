"""`callboard run`: replace this process by a script or an installed program.

Signals, output and exit code are therefore the program's own.
"""

from __future__ import annotations

import os
import re
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final, NoReturn

from actors.cli.broker_target import set_environment
from actors.cli.errors import USAGE, CommandError
from actors.cli.interrupts import raise_if_signalled
from actors.cli.parsing import Options, Parser, add_broker_options

if TYPE_CHECKING:
    from collections.abc import Sequence

_USAGE: Final = "callboard run SCRIPT.py [ARGS], or callboard run PACKAGE EXECUTABLE [ARGS]"


_IMPORTS_RCLPY: Final = re.compile(r"^\s*(import|from)\s+rclpy\b", re.MULTILINE)
EXAMPLES: Final = {
    "callboard run talker.py --ros-args -r chatter:=news": "a script, with a topic renamed",
    "callboard run my_package talker": "a console script of an installed package",
    "callboard run --ros py_pubsub talker": "a program written for ROS 2, without ROS",
    "callboard run --prefix 'gdb -ex run --args' my_package talker": "in a debugger",
}


def add_arguments(parser: Parser) -> None:
    """Describe the verb."""
    parser.usage = f"{_USAGE}\n       options of callboard's own stand before SCRIPT or PACKAGE"
    add_broker_options(parser)
    parser.add_argument(
        "--prefix", metavar="COMMAND", help="what to start it with, such as 'gdb -ex run --args'"
    )
    parser.add_argument(
        "--ros", action="store_true", help="let the program import callboard's rclpy and interface packages"
    )
    parser.add_argument(
        "--force", action="store_true", help="with --ros: even if ROS 2's own rclpy is installed"
    )
    parser.add_argument(
        "--no-broker", action="store_true", help="with --ros: start no broker, even if none answers"
    )
    parser.add_argument("program", metavar="SCRIPT", help="a Python file; or a package with console scripts")
    # argparse takes everything from the first positional on, options and `--` included.
    rest = parser.add_argument(
        "arguments", metavar="ARGS", nargs="...", help="for the program: --ros-args -r a:=b"
    )
    rest.required = False


def run(options: Options) -> int:
    """Become the program. Never returns; raises CommandError if there is no such program."""
    set_environment(options)
    prefix = _prefix(options.prefix)
    if options.ros:
        flags = ["--force"] * options.force + ["--no-broker"] * options.no_broker
        _become(
            *(*prefix, sys.executable, "-u", "-P", "-m", "actors.ros", *flags),
            *(options.program, *options.arguments),
        )
    if options.force or options.no_broker:
        raise CommandError(f"--{'force' if options.force else 'no-broker'} needs --ros", USAGE)
    from actors.tools.programs import NoProgramError, find_executable, find_script

    try:
        script = find_script(options.program)
        if script is not None:
            _warn_of_ros(script, [options.program])
            _become(*prefix, sys.executable, "-u", str(script), *options.arguments)
        executable = find_executable(options.program, options.arguments)
    except NoProgramError as error:
        raise CommandError(str(error)) from None
    _warn_of_ros(_file_of(executable.module), [options.program, executable.name])
    code = executable.command()
    _become(*prefix, sys.executable, "-u", "-P", "-c", code, *options.arguments[1:])


def _warn_of_ros(path: Path | None, words: Sequence[str]) -> None:
    """Warn that a program imports rclpy, if it cannot: Python's error would not say that there is --ros.

    Args:
        path: The program's file, or a folder with a `__main__.py`; None if it is not known.
        words: The program on the command line.
    """
    from importlib.util import find_spec

    from actors.cli.output import print_err
    from actors.regular_files import read_regular

    if path is None:
        return
    path = path / "__main__.py" if path.is_dir() else path
    try:
        text = read_regular(path).decode(errors="replace")
    except OSError:  # Python will say why, and is the one to read a pipe
        return
    here = any((path.parent / name).exists() for name in ("rclpy", "rclpy.py"))
    if _IMPORTS_RCLPY.search(text) and not here and find_spec("rclpy") is None:
        remedy = f"to run it with callboard's: callboard run --ros {shlex.join(words)}"
        print_err(f"WARNING: {path} imports rclpy, which is not installed; {remedy}")


def _file_of(module: str) -> Path | None:
    """Return the file of a module, without importing the packages above it."""
    from importlib.util import find_spec

    top, *rest = module.split(".")
    spec = find_spec(top) if top else None
    if spec is None or not rest:
        return None if spec is None or spec.origin is None else Path(spec.origin)
    folder = next(iter(spec.submodule_search_locations or ()), "")
    return Path(folder, *rest).with_suffix(".py")


def _prefix(text: str | None) -> list[str]:
    try:
        return shlex.split(text or "")
    except ValueError as error:
        raise CommandError(f"--prefix '{text}' is not a command: {error}", USAGE) from None


def _become(program: str, *arguments: str) -> NoReturn:
    sys.stdout.flush()
    raise_if_signalled()
    try:
        os.execvp(program, [program, *arguments])  # noqa: S606 - no shell is wanted
    except FileNotFoundError:
        raise CommandError(f"No command '{program}'") from None
