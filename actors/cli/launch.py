"""`callboard launch`: what a launch file describes, started, labelled, and stopped together."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import sys
from contextlib import AsyncExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actors import environment
from actors.cli.errors import BROKEN_PIPE, FAILURE, NO_BROKER, OK, USAGE, CommandError
from actors.cli.loop import run_async
from actors.cli.output import harmless, say
from actors.cli.place import missing_broker, place_of
from actors.launch.description import declared, described
from actors.launch.embedded import broker_answers, can_embed, embedded_broker
from actors.launch.errors import UnknownArgumentError
from actors.launch.files import SUFFIXES, Files
from actors.launch.output import Output
from actors.launch.plan import make_plan
from actors.launch.runner import Runner
from actors.launch.steps import Say, Start
from actors.logger import ROOT_NAME
from actors.tools.suggestions import did_you_mean
from broker.errors import AddressInUseError
from proto.errors import shown

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from actors.launch.actions import DeclareLaunchArgument
    from actors.launch.steps import Step
    from actors.tools.contexts import Place

LAST_OUTPUT_SEC: Final = 2.0
"""How long the last lines may take, when nobody reads."""


def run(options: argparse.Namespace) -> int:
    """Run what the file describes; or say what that is."""
    words = [options.file, *options.arguments]
    path, given = _file_of(words)
    arguments = dict(map(_argument, given))
    library = Files()
    description = library.description(str(path))
    if options.show_args:
        for line in _shown_arguments(declared(description.actions)):
            say(line)
        return OK
    if options.print_description:
        for line in described(description.actions):
            say(line)
        return OK
    place = place_of(options)
    try:
        steps = make_plan(
            description,
            library,
            arguments=arguments,
            environment=_environment(place),
            folder=str(path.parent),
        )
    except UnknownArgumentError as error:
        hint = did_you_mean(error.name, error.known) or "; see --show-args"
        raise CommandError(f"{error}{hint}", USAGE) from error
    if options.dry_run:
        for line in _shown_steps(steps):
            say(line)
        return OK
    return run_async(lambda: _launch(steps, place, options.stop_timeout))


# Which file, with what


def _file_of(words: Sequence[str]) -> tuple[Path, Sequence[str]]:
    """Return the launch file that the words name, and the words behind that."""
    first = Path(words[0])
    if first.is_file() or first.suffix or os.sep in words[0]:
        return first.absolute(), words[1:]
    if len(words) < 2 or ":=" in words[1]:
        raise CommandError(
            f"No launch file '{shown(words[0])}'; for a package write: callboard launch PACKAGE FILE"
        )
    return _file_in_package(words[0], words[1]), words[2:]


def _file_in_package(package: str, name: str) -> Path:
    from actors.tools.executables import find_package  # noqa: PLC0415 - takes time

    found = find_package(package)
    if found is None:
        raise CommandError(f"No launch file and no installed package '{shown(package)}'")
    folder = (found.share() or Path()) / "launch"
    path = folder / name
    if found.share() is not None and path.is_file():
        return path.absolute()
    there = folder.iterdir() if found.share() is not None and folder.is_dir() else ()
    files = sorted(each.name for each in there if each.suffix in SUFFIXES)
    hint = did_you_mean(name, files) or f"; there is: {', '.join(files) or 'none'}"
    raise CommandError(f"No launch file '{shown(name)}' in package '{package}'{hint}")


def _argument(word: str) -> tuple[str, str]:
    name, separator, value = word.partition(":=")
    if not name or not separator:
        raise CommandError(f"Malformed launch argument '{shown(word)}': expected name:=value", USAGE)
    return name, value


def _environment(place: Place) -> dict[str, str]:
    """Return what programs get: where the broker is, and what a terminal behind these pipes can do."""
    extra = {
        "CALLBOARD_URL": place.url,
        "CALLBOARD_DOMAIN": str(place.domain),
        "PYTHONUNBUFFERED": "1",
    }
    if environment.color_wish() is None and sys.stdout.isatty():
        extra["FORCE_COLOR"] = "1"
    return environment.environment_for(extra) or {}


# What it would do


def _shown_arguments(arguments: Iterable[DeclareLaunchArgument]) -> Iterator[str]:
    listed = list(arguments)
    yield "Arguments, as name:=value:" if listed else "The file has no arguments."
    for each in listed:
        value = each.default_value
        text = value if isinstance(value, str) else repr(value)
        facts = ["required" if value is None else f"default: {text}"]
        if each.choices is not None:
            facts.append(f"one of: {', '.join(each.choices)}")
        yield f"  {each.name} ({'; '.join(facts)})"
        if each.description:
            yield f"      {each.description}"


def _shown_steps(steps: Iterable[Step]) -> Iterator[str]:
    for step in steps:
        when = f"after {step.after_sec:g} s: " if step.after_sec else ""
        if isinstance(step, Start):
            process = step.process
            extra = "".join(f"{name}={value} " for name, value in process.own_environment.items())
            yield f"{when}[{process.label}] {extra}{process.shown}"
        elif isinstance(step, Say):
            yield f"{when}say: {step.text}"
        else:
            yield f"{when}end: {step.reason}"


# Doing it


async def _launch(steps: Sequence[Step], place: Place, stop_timeout_sec: float) -> int:
    """Run the steps to the end; return the exit code."""
    loop = asyncio.get_running_loop()
    unheard = False

    def when_unheard() -> None:
        nonlocal unheard
        unheard = True
        runner.stop("nobody reads the output")

    def in_thread() -> None:
        loop.call_soon_threadsafe(when_unheard)

    output = Output(sys.stdout.fileno(), in_thread)
    runner = Runner(steps, output.write, stop_timeout_sec=stop_timeout_sec)
    logs = _LaunchLog(output.write)
    logging.getLogger().addHandler(logs)
    try:
        async with AsyncExitStack() as stack:
            await _find_broker(place, stack)
            _stop_at_hangup(loop, lambda: runner.stop("the terminal is gone"))
            good = await runner.run()
    finally:
        logging.getLogger().removeHandler(logs)
        output.close(LAST_OUTPUT_SEC)
    if not good:
        return FAILURE
    return BROKEN_PIPE if unheard else OK


async def _find_broker(place: Place, stack: AsyncExitStack) -> None:
    """See to it that there is a broker: one that answers, or else one of this launch."""
    if await broker_answers(place.url, place.domain):
        return
    if len(place.urls) != 1 or not can_embed(place.urls[0]):
        raise CommandError(missing_broker(place), NO_BROKER)
    try:
        await stack.enter_async_context(embedded_broker(place.urls[0]))
    except AddressInUseError:
        if await broker_answers(place.url, place.domain):  # another launch was quicker
            return
        raise
    logging.getLogger(f"{ROOT_NAME}.launch").info("no broker at %s: this launch brings its own", place.url)


def _stop_at_hangup(loop: asyncio.AbstractEventLoop, stop: Callable[[], None]) -> None:
    """A closed terminal stops the launch like a signal; not under nohup."""
    number = getattr(signal, "SIGHUP", None)
    if number is not None and signal.getsignal(number) == signal.SIG_DFL:
        loop.add_signal_handler(number, stop)


class _LaunchLog(logging.Handler):
    """The launch's own lines among those of its processes: `[INFO] [talker-1]: process started …`."""

    def __init__(self, write: Callable[[bytes], None]) -> None:
        super().__init__()
        self._write = write

    def emit(self, record: logging.LogRecord) -> None:
        """Write a record."""
        level = {"WARNING": "WARN", "CRITICAL": "FATAL"}.get(record.levelname, record.levelname)
        name = record.name.removeprefix(f"{ROOT_NAME}.")
        text = harmless(record.getMessage())
        self._write(f"[{level}] [{name}]: {text}\n".encode(errors="backslashreplace"))
