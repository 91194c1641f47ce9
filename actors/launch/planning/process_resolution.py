"""Resolves the options of an action into the specification of its process."""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, Final, NamedTuple, cast

from actors.config.ros_domain import ROS_DOMAIN, parse_ros_domain
from actors.launch.description.action import Action
from actors.launch.description.actions import EmitEvent, Shutdown
from actors.launch.description.conditions import to_bool
from actors.launch.description.lifecycle import LifecycleNode
from actors.launch.description.process_actions import (
    ExecuteProcess,
    Node,
    OutputMode,
    ProcessAction,
    RosBridge,
)
from actors.launch.description.substitutions import resolve, split_command
from actors.launch.errors import LaunchError
from actors.launch.planning.dependencies import dependencies
from actors.launch.planning.namespaces import prefix_namespace
from actors.launch.planning.node_arguments import full_name, ros_arguments
from actors.launch.planning.option_values import option_value, option_values
from actors.launch.planning.process_spec import LEAST_RESPAWN_DELAY_SEC, LifecycleSpec, ProcessSpec
from actors.launch.planning.settings import variables
from proto.limits import MAX_DOMAIN
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actors.launch.description.library import Library
    from actors.launch.description.substitutions import LaunchContext
    from actors.launch.planning.dependencies import KnownNodes
    from actors.runtime.programs import Factory

LAUNCH_PREFIX: Final = "launch-prefix"
LAUNCH_PREFIX_FILTER: Final = "launch-prefix-filter"
"""Launch arguments that every description has, as in ROS 2."""
MAX_NAME_CHARACTERS: Final = 200
"""Limit of the name of a process; name and number are its label."""


class _Program(NamedTuple):
    """A program.

    Attributes:
        name: The default name of its process.
        command: The command, or for a node in this process its arguments.
        typed: The command as users would type it.
        sources: Files and folders whose changes restart it with `--watch`.
        factory: Creates the node that runs in this process.
    """

    name: str
    command: Sequence[str]
    typed: Sequence[str]
    sources: Sequence[str] = ()
    factory: Factory | None = None


def make_spec(
    action: Node | ExecuteProcess | RosBridge, context: LaunchContext, *, number: int, nodes: KnownNodes
) -> ProcessSpec:
    """Return the specification of the process that an action starts.

    Args:
        action: The action.
        context: Where it is evaluated.
        number: The number of the process in its launch.
        nodes: The nodes that have been planned before it.

    Raises:
        LaunchError: An option is not valid.
        InvalidNameError: The name or namespace of the node is not valid.
    """
    namespace = context.namespace
    if isinstance(action, Node):
        program = _node(action, context)
        # Names in `depends_on` are relative to the node's own namespace.
        own = None if action.namespace is None else resolve(action.namespace, context)
        namespace = prefix_namespace(context.namespace, own)
    elif isinstance(action, RosBridge):
        program = _bridge(action, context)
    else:
        program = _process(action, context)
    name = _name(action, program, context)
    options = option_values(action, ProcessAction, context)
    prefix = _words(_prefix(options.pop("prefix"), program, context))
    extra = variables(action.additional_env, context)
    base = context.environment if action.env is None else variables(action.env, context)
    environment = _with_domain({**base, **extra}, context)
    end = ending(action.on_exit)
    # A program that dies at once would otherwise keep the machine busy.
    delay = max(options["respawn_delay_sec"], LEAST_RESPAWN_DELAY_SEC)
    options |= {
        "output": OutputMode(options["output"]),
        # As in ROS 2, where the Shutdown comes before the next start.
        "respawn": options["respawn"] and end is None,
        "respawn_delay_sec": delay,
        "respawn_max_delay_sec": max(options["respawn_max_delay_sec"], delay),
        "required": options["required"] or end is not None,
    }
    return ProcessSpec(
        label=f"{name}-{number}",
        name=name,
        node=full_name(action, context) if isinstance(action, Node) else None,
        command=(*prefix, *program.command),
        program=program.factory,
        shown=shlex.join((*prefix, *program.typed)),
        environment=environment,
        own_environment=extra if action.env is None else {**base, **extra},
        origin=action,
        depends_on=dependencies(action.depends_on, nodes, context, namespace),
        lifecycle=_lifecycle(action, context) if isinstance(action, LifecycleNode) else None,
        end_reason="" if end is None or end.reason == Shutdown().reason else resolve(end.reason, context),
        sources=tuple(program.sources),
        **options,
    )


def _with_domain(environment: dict[str, str], context: LaunchContext) -> dict[str, str]:
    """Return the environment of a process; with --ros, a ROS_DOMAIN_ID that the description sets counts.

    The launch gives all processes its own domain as CALLBOARD_DOMAIN, which overrides ROS_DOMAIN_ID.
    """
    text = environment.get(ROS_DOMAIN)
    if text is None or text == context.first_environment.get(ROS_DOMAIN):
        return environment
    if "--ros" not in context.library.run_command:
        return environment
    domain = parse_ros_domain(text) if text else 0
    if domain is None:
        raise LaunchError(f"{ROS_DOMAIN} must be an integer from 0 to {MAX_DOMAIN}, not '{escape(text)}'")
    return {**environment, "CALLBOARD_DOMAIN": str(domain)}


def _name(action: Node | ExecuteProcess | RosBridge, program: _Program, context: LaunchContext) -> str:
    given = action.name
    if isinstance(action, Node) and action.exec_name is not None:
        given = action.exec_name
    name = program.name if given is None else resolve(given, context)
    # It is the label of each line, and a part of the names of log files.
    if not 0 < len(name) <= MAX_NAME_CHARACTERS or not name.isprintable():
        limit = f"it has 1 to {MAX_NAME_CHARACTERS} printable characters"
        raise LaunchError(f"A process cannot have the name '{escape(name)}': {limit}")
    return name


def _lifecycle(action: LifecycleNode, context: LaunchContext) -> LifecycleSpec:
    return LifecycleSpec(
        autostart=("configure", "activate") if option_value(action, "autostart", context) else (),
        timeout_sec=option_value(action, "transition_timeout", context),
    )


def _node(action: Node, context: LaunchContext) -> _Program:
    programs = [each for each in (action.executable, action.script, action.node) if each is not None]
    if len(programs) != 1 or (action.package is not None and action.executable is None):
        raise LaunchError("A Node needs package= and executable=, or script=, or node=")
    library = context.library
    own = [resolve(each, context) for each in action.arguments]
    arguments = own + ros_arguments(action, context)
    if action.node is not None:
        return _embedded(action, action.node, arguments, library)
    if action.script is not None:
        path = str(PurePath(context.folder, resolve(action.script, context)))
        name, typed, command = PurePath(path).stem, [path], library.script(path)
        sources = library.sources(script=path)
    elif action.package is None:
        path = resolve(cast("Any", action.executable), context)
        name, typed, command, sources = PurePath(path).name, [path], library.python_program((path,)), ()
    else:
        package = resolve(action.package, context)
        name = resolve(cast("Any", action.executable), context)
        typed, command = [package, name], library.program(package, name)
        sources = library.sources(package=package)  # its modules, whichever of them the program uses
    # An executable alone is a program of the system; the others are what `callboard run` takes.
    if action.package is not None or action.script is not None:
        typed = [*library.run_command, *typed]
    if to_bool(action.shell, context):
        # Only the user's arguments are for the shell. The others have values that it must not expand.
        line = " ".join((shlex.join(command), *own, shlex.join(arguments[len(own) :])))
        return _Program(name, ["/bin/sh", "-c", line], [*typed, *arguments], sources)
    return _Program(name, [*command, *arguments], [*typed, *arguments], sources)


def _embedded(action: Node, node: Factory | str, arguments: Sequence[str], library: Library) -> _Program:
    """Return a node that runs in the launch's process."""
    # They belong to processes: setting them here would change them for the launch and all other nodes.
    for option in ("cwd", "env", "additional_env", "prefix", "shell"):
        if getattr(action, option):
            raise LaunchError(f"A Node with node= runs in the launch's process: {option}= is not for it")
    factory = library.factory(node) if isinstance(node, str) else node
    if not callable(factory):
        raise LaunchError(f"node= needs a class or a function that returns a new node, not {factory!r}")
    word = node if isinstance(node, str) else getattr(node, "__qualname__", type(node).__name__)
    return _Program(
        word.rpartition(":")[2].rpartition(".")[2], arguments, [word, *arguments], factory=factory
    )


def _process(action: ExecuteProcess, context: LaunchContext) -> _Program:
    command = [resolve(each, context) for each in action.cmd]
    if not command or not command[0]:
        raise LaunchError("ExecuteProcess needs a program: cmd=['echo', 'hello']")
    name = PurePath(command[0]).name
    if to_bool(action.shell, context):
        line = " ".join(command)
        command = ["/bin/sh", "-c", line]
        word = PurePath(next(iter(line.split()), "")).name
        # The first word may be anything, such as `FOO=1`. Users have not chosen it, so it is never an error.
        name = word if word.isprintable() and 0 < len(word) <= MAX_NAME_CHARACTERS else "sh"
        return _Program(name, command, command)
    return _Program(name, context.library.python_program(command), command)


def _bridge(action: RosBridge, context: LaunchContext) -> _Program:
    """Return `callboard bridge ros2`, which checks the values, and finds the broker in its environment."""
    own = None if action.namespace is None else resolve(action.namespace, context)
    path = None if action.config is None else str(PurePath(context.folder, resolve(action.config, context)))
    values = {
        "domain-id": option_value(action, "domain_id", context),
        "namespace": prefix_namespace(context.namespace, own),
        "config": path,
    }
    given = [(flag, str(value)) for flag, value in values.items() if value is not None]
    for flag, patterns in (("allow", action.allow), ("deny", action.deny)):
        given += [(flag, resolve(each, context)) for each in patterns]
    words = ("bridge", "ros2", *(f"--{flag}={value}" for flag, value in given))
    return _Program("callboard", (sys.executable, "-m", "actors", *words), ("callboard", *words))


def _prefix(own: str | None, program: _Program, context: LaunchContext) -> str:
    """Return the prefix of a process: its own, or that of the launch if it applies to the program."""
    if own is not None:
        return own
    pattern = context.launch_configurations.get(LAUNCH_PREFIX_FILTER, "")
    try:
        applies = re.match(pattern, program.name) is not None
    except re.error as error:
        raise LaunchError(f"{LAUNCH_PREFIX_FILTER} '{escape(pattern)}' is no pattern: {error}") from None
    # A node in the launch's process has no command that it could be put before.
    applies = applies and program.factory is None
    return context.launch_configurations.get(LAUNCH_PREFIX, "") if applies else ""


def _words(prefix: str) -> list[str]:
    try:
        return split_command(prefix)
    except ValueError as error:
        raise LaunchError(f"prefix '{escape(prefix)}' is not a command: {error}") from None


def ending(reaction: object) -> Shutdown | None:
    """Return the Shutdown if a reaction consists of it alone, which makes the process a required one."""
    listed = cast("Sequence[object]", reaction) if isinstance(reaction, list | tuple) else (reaction,)
    if len(listed) != 1 or (isinstance(listed[0], Action) and listed[0].condition is not None):
        return None
    # ROS 2's form is EmitEvent(event=Shutdown()).
    found = listed[0].event if isinstance(listed[0], EmitEvent) else listed[0]
    return found if isinstance(found, Shutdown) and found.condition is None else None
