"""`callboard launch`: what a launch file describes, started, labelled, and stopped together."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import sys
import traceback
from contextlib import contextmanager, nullcontext, redirect_stdout, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from actors.cli.broker_target import unknown_context
from actors.cli.commands.launch.reports import Reports
from actors.cli.errors import BROKEN_PIPE, FAILURE, OK, USAGE, CommandError, exit_code
from actors.cli.interrupts import raise_at_once
from actors.cli.loop import exit_asked_for, run_async
from actors.cli.output import print_out, print_warning
from actors.cli.web_address import DEFAULT_LISTEN, check_web
from actors.config import environment
from actors.config.context_errors import UnknownContextError
from actors.config.contexts import warn_of_ros_domain
from actors.launch.description.description import format_actions
from actors.launch.description.process_actions import ExecuteProcess, OutputMode
from actors.launch.description.substitutions import LaunchContext
from actors.launch.description.summaries import format_value, static_text
from actors.launch.engine.captured_output import captured_logs, captured_streams, launch_logs
from actors.launch.errors import UnknownArgumentError
from actors.launch.launching import Launch
from actors.launch.planning.declarations import all_declared
from actors.launch.planning.lifecycle import transition_label
from actors.launch.planning.process_resolution import LAUNCH_PREFIX, LAUNCH_PREFIX_FILTER
from actors.launch.planning.process_spec import STOP_TIMEOUT_SEC
from actors.launch.planning.steps import AddHandler, Call, ChangeStates, End, LogText, Start
from actors.launch.resources.files import SUFFIXES, Files
from actors.logging.severity import ROOT_NAME
from actors.runtime.loop_watch import watch_loop
from actors.tools.suggestions import did_you_mean
from proto.aio import process
from proto.errors import CallboardError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    import argparse
    from collections.abc import Callable, Collection, Generator, Iterable, Iterator, Sequence

    from actors.launch.description.actions import DeclareLaunchArgument
    from actors.launch.description.description import LaunchDescription
    from actors.launch.planning.steps import Step


OPEN_FILES: Final = 8192
"""Each of `MAX_PROCESSES` has a pidfd and up to two pipes, and an embedded broker has connections. No more,
because programs inherit the limit, and some close all files below it when they start."""


def run(options: argparse.Namespace) -> int:
    """Run what the file describes; or say what that is."""
    raise_at_once()  # until the loop runs: launch files, and commands in them, may take long
    if options.noninteractive == "-n":  # for one version: it was the dry run, and starts processes now
        print_warning("callboard launch: -n means --noninteractive, as in ROS 2; the dry run is --dry-run")
    if options.debug:
        logging.getLogger(ROOT_NAME).setLevel(logging.DEBUG)
    try:
        return _run_file(options)
    except CallboardError:
        if options.debug:
            traceback.print_exc()
        raise


def _run_file(options: argparse.Namespace) -> int:
    words = [options.file, *options.arguments]
    path, given = _file_of(words)
    arguments = dict(map(_argument, given)) | _prefix_arguments(options)
    library = _library(ros=options.ros, force=options.force)
    with _prints_to_stderr(json=options.json):
        description = library.description(str(path))
    if options.show_args:
        launch_context = LaunchContext(
            library=library,
            launch_configurations=arguments,
            environment=dict(os.environ),
            folder=str(path.parent),
            file=str(path),
        )
        for line in _shown_arguments(all_declared(description.actions, launch_context, library)):
            print_out(line)
        return OK
    if options.print_description:
        for line in format_actions(description.actions):
            print_out(line)
        return OK
    if options.web:
        if not options.dry_run:
            check_web(DEFAULT_LISTEN, "--web")
        description.add_action(_web())
    with _prints_to_stderr(json=options.json):
        launch = _planned(options, description, arguments, library)
    if options.dry_run:
        for line in _shown_steps(launch.plan()):
            print_out(line)
        return OK
    process.configure_process()
    loop_factory = _debug_loop if options.debug else process.new_event_loop
    process.raise_file_limit(OPEN_FILES)
    watched = library.launch_files if options.watch else None
    # What it embeds, nodes and the broker, runs as fast as in a process of its own.
    return run_async(
        lambda: _run(launch, library, watched, json=options.json, interactive=not options.noninteractive),
        loop_factory=loop_factory,
    )


def _debug_loop() -> asyncio.AbstractEventLoop:
    loop = process.new_event_loop()
    loop.set_debug(True)
    return loop


def _library(*, ros: bool, force: bool) -> Files:
    """Return the library of this machine; with --ros, of one whose Python files import ROS 2's names."""
    if not ros:
        return Files()
    from actors.ros.finder import RealPackageError, install
    from actors.ros.launch.library import ros_files

    try:
        install(force=force)
    except RealPackageError as error:
        raise CommandError(str(error), USAGE) from None
    return ros_files(force=force)


@contextmanager
def _prints_to_stderr(*, json: bool) -> Generator[None]:
    """With --json, redirect what launch files print to stderr."""
    with redirect_stdout(sys.stderr) if json else nullcontext():
        yield


def _planned(
    options: argparse.Namespace, description: LaunchDescription, arguments: dict[str, str], library: Files
) -> Launch:
    try:
        launch = Launch(
            description,
            arguments=arguments,
            url=options.url or None,
            domain=_domain(options),
            context=options.context or None,
            environment=_environment(json=options.json),
            library=library,
            output=OutputMode(options.output) if options.output else None,
            stop_timeout_sec=STOP_TIMEOUT_SEC if options.stop_timeout is None else options.stop_timeout,
            keep=options.watch,
            watch_graph=options.json,
        )
        warn_of_ros_domain(launch.target, print_warning)
        launch.plan()  # before the loop runs: a signal interrupts whatever a launch file does
    except UnknownArgumentError as error:
        hint = did_you_mean(error.name, error.known) or "; see --show-args"
        raise CommandError(f"{error}{hint}", USAGE) from error
    except UnknownContextError as error:
        raise unknown_context(error) from error
    return launch


def _domain(options: argparse.Namespace) -> int | None:
    """Return the chosen domain; with --ros ROS_DOMAIN_ID chooses it, too, unless a context is named."""
    if options.domain is None and options.context is None and options.ros:
        return environment.domain_id(ros=True)
    chosen: int | None = options.domain
    return chosen


def _web() -> ExecuteProcess:
    """Return the page as one more process, which is started again when it ends."""
    command = [sys.executable, "-m", "actors", "web", "--no-browser", "--listen", DEFAULT_LISTEN]
    return ExecuteProcess(cmd=command, name="web", respawn=True, respawn_backoff=2.0, output="screen")


# Which file, with what


def _file_of(words: Sequence[str]) -> tuple[Path, Sequence[str]]:
    """Return the launch file that the words name, and the words behind that."""
    first = Path(words[0])
    if first.is_file() or first.suffix or os.sep in words[0]:
        return first.absolute(), words[1:]
    if len(words) < 2 or ":=" in words[1]:
        raise CommandError(
            f"No launch file '{escape(words[0])}'; for a package write: callboard launch PACKAGE FILE"
        )
    return _file_in_package(words[0], words[1]), words[2:]


def _file_in_package(package: str, name: str) -> Path:
    from actors.tools.executables import find_package

    found = find_package(package)
    if found is None:
        raise CommandError(f"No launch file and no installed package '{escape(package)}'")
    share = found.share()
    folder = None if share is None else share if found.ros_share() else share / "launch"
    there = [] if folder is None else sorted(folder.rglob("*") if found.ros_share() else folder.glob("*"))
    for each in there:
        if each.is_file() and (each.name == name or (folder and each == folder / name)):
            return each.absolute()
    files = sorted(each.name for each in there if each.suffix in SUFFIXES and each.name != "package.xml")
    hint = did_you_mean(name, files) or f"; there is: {', '.join(files) or 'none'}"
    raise CommandError(f"No launch file '{escape(name)}' in package '{package}'{hint}")


def _argument(word: str) -> tuple[str, str]:
    name, separator, value = word.partition(":=")
    if not name or not separator:
        raise CommandError(f"Malformed launch argument '{escape(word)}': expected name:=value", USAGE)
    return name, value


def _prefix_arguments(options: argparse.Namespace) -> dict[str, str]:
    """Return the options for a prefix as the launch arguments that they are in ROS 2."""
    if options.launch_prefix_filter and not options.launch_prefix:
        raise CommandError("--launch-prefix-filter needs --launch-prefix", USAGE)
    given = {LAUNCH_PREFIX: options.launch_prefix, LAUNCH_PREFIX_FILTER: options.launch_prefix_filter}
    return {name: value for name, value in given.items() if value}


def _environment(*, json: bool) -> dict[str, str]:
    """Return what programs get: also what a terminal behind their pipes can do."""
    colors = environment.color_wish() is None and sys.stdout.isatty() and not json
    return {**os.environ, "FORCE_COLOR": "1"} if colors else dict(os.environ)


# What it would do


def _shown_arguments(arguments: Iterable[DeclareLaunchArgument]) -> Iterator[str]:
    listed = list(arguments)
    yield "Arguments, as name:=value:" if listed else "The file has no arguments."
    for each in listed:
        value = each.default_value
        text = static_text(value)
        text = format_value(value) if text is None else text or "''"
        facts = ["required" if value is None else f"default: {text}"]
        if each.choices is not None:
            facts.append(f"one of: {', '.join(each.choices)}")
        yield f"  {each.name} ({'; '.join(facts)})"
        if each.description:
            yield from (f"      {line}" for line in each.description.splitlines())


def _shown_steps(steps: Iterable[Step], indent: str = "") -> Iterator[str]:
    for step in steps:
        when = f"{indent}after {step.after_sec:g} s: " if step.after_sec else indent
        match step:
            case Start():
                yield from _shown_start(step, indent, when)
            case LogText():
                yield f"{when}{'warn' if step.warning else 'say'}: {step.text}"
            case End():
                yield f"{when}end: {step.reason}"
            case Call():
                yield f"{when}call {step.name}"
            case ChangeStates():
                yield f"{when}change the state of {step.what}: {_transitions(step.transitions)}"
            case AddHandler():
                yield f"{when}{'once' if step.once else 'whenever'} {step.what}:"
                yield from _shown_steps(step.preview, f"{indent}    ")
                if not step.preview:
                    yield f"{indent}    what a function says then"


def _shown_start(step: Start, indent: str, when: str) -> Iterator[str]:
    process = step.process
    extra = "".join(f"{name}={value} " for name, value in process.own_environment.items())
    waits = ", ".join(map(str, process.depends_on))
    when += f"when there is {waits}: " if waits else ""
    yield f"{when}[{process.label}] {extra}{process.shown}"
    if process.lifecycle is not None and process.lifecycle.autostart:
        yield f"{indent}    then: {_transitions(process.lifecycle.autostart)}"
    if step.on_exit is not None:
        yield from _shown_steps([step.on_exit], f"{indent}    ")


def _transitions(transitions: Iterable[int | str]) -> str:
    return ", ".join(map(transition_label, transitions))


# Doing it


async def _run(
    launch: Launch, library: Files, watched: Collection[str] | None, *, json: bool, interactive: bool
) -> int:
    """Run a launch to its end; return the exit code. With launch files to watch it restarts what changes."""
    loop = asyncio.get_running_loop()

    def on_closed() -> None:
        with suppress(RuntimeError):  # the loop has been closed
            loop.call_soon_threadsafe(partial(launch.stop, "nobody reads the output", escalate=False))

    reports = Reports(library.open_log_folder, json=json, on_closed=on_closed, interactive=interactive)
    launch.listen(reports)
    code = FAILURE
    try:
        with (
            launch_logs(launch.notify),
            captured_logs(),
            captured_streams(reports.printed),
            watch_loop(_warn_past_loop),
        ):
            _stop_at_hangup(loop, lambda: launch.stop("the terminal is gone", escalate=False))
            good = await (launch.run() if watched is None else _run_watched(launch, watched))
        code = OK if good else FAILURE
    except asyncio.CancelledError:
        if not launch.failed:
            code = exit_asked_for() or OK
            raise
    except CallboardError as error:
        code = exit_code(error)
        raise
    finally:
        reports.close(code)
    return BROKEN_PIPE if code == OK and reports.closed else code


def _warn_past_loop(text: str) -> None:
    """Write a warning to stderr at once: the loop, which writes what is logged, is blocked."""
    lines = (escape(line) for line in f"[WARN] [launch]: {text}".splitlines())
    with suppress(OSError):
        os.write(2, "".join(f"{line}\n" for line in lines).encode())


async def _run_watched(launch: Launch, launch_files: Collection[str]) -> bool:
    from actors.launch.engine.watching import SourceWatch

    watch = SourceWatch(
        launch.plan(), launch_files=launch_files, restart=launch.restart, notify=launch.notify
    )
    launch.listen(watch.on_event)
    async with watch.running():
        return await launch.run()


def _stop_at_hangup(loop: asyncio.AbstractEventLoop, stop: Callable[[], None]) -> None:
    """A closed terminal stops the launch like a signal; not under nohup."""
    number = getattr(signal, "SIGHUP", None)
    if number is not None and signal.getsignal(number) == signal.SIG_DFL:
        loop.add_signal_handler(number, stop)
