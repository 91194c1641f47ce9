"""`callboard run`: a script, or an installed program, in place of this process.

Signals, output and exit code are the program's own, since it is this process from then on.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Final, NoReturn

from actors.cli.errors import CommandError
from actors.cli.interrupts import raise_if_noted
from actors.cli.parsing import add_broker_options, did_you_mean

if TYPE_CHECKING:
    import argparse
    from importlib.metadata import EntryPoint

_USAGE: Final = "callboard run SCRIPT.py [ARGS], or callboard run PACKAGE EXECUTABLE [ARGS]"


EXAMPLES: Final = {
    "callboard run talker.py --ros-args -r chatter:=news": "a script, with a topic renamed",
    "callboard run my_package talker": "a console script of an installed package",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the verb."""
    parser.usage = f"{_USAGE}\n       options of callboard's own stand before SCRIPT or PACKAGE"
    add_broker_options(parser)
    parser.add_argument("program", metavar="SCRIPT", help="a Python file; or a package with console scripts")
    # argparse takes everything from the first positional on, options and `--` included.
    rest = parser.add_argument(
        "arguments", metavar="ARGS", nargs="...", help="for the program: --ros-args -r a:=b"
    )
    rest.required = False


def run(options: argparse.Namespace) -> int:
    """Become the program. Returns never; raises CommandError if there is no such program."""
    _tell_children(options)
    path = Path(options.program)
    if path.is_file() or (path / "__main__.py").is_file():
        _become("-u", str(path), *options.arguments)
    if path.suffix == ".py" or os.sep in options.program:
        raise CommandError(f"No script '{path}'{_similar_file(path)}")
    script = _console_script(options.program, options.arguments)
    _become("-u", "-P", "-c", _starter(script), *options.arguments[1:])


def _tell_children(options: argparse.Namespace) -> None:
    """Give --url and --domain to the program, as its environment."""
    if options.url is not None:
        from proto.url import parse_urls  # noqa: PLC0415 - rarely needed

        parse_urls(options.url)
        os.environ["CALLBOARD_URL"] = options.url
    if options.domain is not None:
        os.environ["CALLBOARD_DOMAIN"] = str(options.domain)


def _become(*arguments: str) -> NoReturn:
    sys.stdout.flush()
    raise_if_noted()
    os.execv(sys.executable, [sys.executable, *arguments])  # noqa: S606 - no shell is wanted


def _similar_file(path: Path) -> str:
    folder = path.parent
    files = [str(each) for each in folder.glob("*.py")] if folder.is_dir() else []
    return did_you_mean(str(path), files)


def _console_script(package: str, arguments: list[str]) -> EntryPoint:
    from importlib.metadata import PackageNotFoundError, distribution  # noqa: PLC0415 - takes time

    try:
        scripts = {
            each.name: each for each in distribution(package).entry_points if each.group == "console_scripts"
        }
    except (PackageNotFoundError, ValueError):
        hint = f"; did you mean './{package}.py'?" if Path(f"{package}.py").is_file() else f"; write {_USAGE}"
        raise CommandError(f"No script and no installed package '{package}'{hint}") from None
    if not scripts:
        raise CommandError(f"Package '{package}' has no console scripts to run")
    listed = ", ".join(sorted(scripts))
    if not arguments:
        raise CommandError(f"Which program of '{package}'? There is: {listed}")
    if arguments[0] not in scripts:
        hint = did_you_mean(arguments[0], scripts) or f"; there is: {listed}"
        raise CommandError(f"No program '{arguments[0]}' in package '{package}'{hint}")
    return scripts[arguments[0]]


def _starter(script: EntryPoint) -> str:
    """Return what an installed console script consists of."""
    top = script.attr.partition(".")[0]
    return (
        f"import sys; from {script.module} import {top}; "
        f"sys.argv[0] = {script.name!r}; sys.exit({script.attr}())"
    )
