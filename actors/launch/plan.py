"""The plan of a launch: what a description comes to, with these arguments and this environment.

No I/O and no clock: a `Library` says what files and packages there are, and each step says when it is due.
Whatever is wrong with a description is found here, before anything has been started.
"""

from __future__ import annotations

import math
import shlex
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, Final, cast

from actors.launch.actions import (
    Action,
    DeclareLaunchArgument,
    ExecuteProcess,
    GroupAction,
    IncludeLaunchDescription,
    Launched,
    LogInfo,
    Node,
    Setting,
    Shutdown,
    TimerAction,
)
from actors.launch.conditions import truth
from actors.launch.description import LaunchDescription, declared
from actors.launch.errors import LaunchError, UnknownArgumentError
from actors.launch.ros_arguments import ros_arguments
from actors.launch.settings import apply_setting
from actors.launch.steps import LEAST_RESPAWN_DELAY_SEC, End, ProcessSpec, Say, Start
from actors.launch.substitutions import Scope, resolve
from proto.errors import shown

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from actors.launch.library import Library
    from actors.launch.steps import Step

MAX_PROCESSES: Final = 1000
"""A description that comes to more is a mistake."""
MAX_INCLUDES: Final = 32
"""Files within files."""


def make_plan(
    description: LaunchDescription,
    library: Library,
    *,
    arguments: Mapping[str, str],
    environment: Mapping[str, str],
    folder: str,
) -> list[Step]:
    """Return the steps that a description comes to, in order; those that are for later among them.

    Args:
        description: What is to be done.
        library: Knows files and packages.
        arguments: The launch arguments that were given.
        environment: What programs get.
        folder: Of the description's file.

    Raises:
        UnknownArgumentError: Nobody declares or uses an argument that was given.
        LaunchError: Something else is wrong.
        InvalidNameError: A node cannot have the name or namespace.
    """
    plan = _Plan(library)
    scope = Scope(
        library=library,
        configurations=dict(arguments),
        environment=dict(environment),
        folder=folder,
        file=description.file,
    )
    plan.add(description.actions, scope, 0.0)
    known = plan.declared | {each.name for each in declared(description.actions)}
    for name in arguments:
        # What a file declares that is not included now is not known.
        if name not in known | scope.used and not plan.skipped:
            raise UnknownArgumentError(name, tuple(sorted(known)))
    return plan.steps


class _Plan:
    """A plan in the making."""

    def __init__(self, library: Library) -> None:
        self.steps: list[Step] = []
        self.declared: set[str] = set()
        self.skipped = False
        self._library = library
        self._includes = 0
        self._processes = 0

    def add(self, actions: Iterable[Action], scope: Scope, after_sec: float) -> None:
        """Add what actions come to. What they set stays set in the scope."""
        for action in actions:
            if action.condition is None or action.condition.holds(scope):
                self._add(action, scope, after_sec)
            elif isinstance(action, GroupAction | TimerAction | IncludeLaunchDescription):
                self.skipped = True

    def _add(self, action: Action, scope: Scope, after_sec: float) -> None:
        match action:
            case Node():
                self._start(self._node(action, scope), after_sec)
            case ExecuteProcess():
                self._start(self._process(action, scope), after_sec)
            case DeclareLaunchArgument():
                self._declare(action, scope)
            case LogInfo():
                self.steps.append(Say(text=resolve(action.msg, scope), after_sec=after_sec))
            case GroupAction():
                self._group(action, scope, after_sec)
            case Setting():
                apply_setting(action, scope)
            case IncludeLaunchDescription():
                self._include(action, scope, after_sec)
            case TimerAction():
                later = after_sec + _seconds("period", action.period, scope)
                self.add(action.actions, scope.inner(), later)
            case Shutdown():
                self.steps.append(End(reason=resolve(action.reason, scope), after_sec=after_sec))
            case _:
                raise LaunchError(f"{type(action).__name__} is no action that can be carried out")

    def _declare(self, action: DeclareLaunchArgument, scope: Scope) -> None:
        name = action.name
        self.declared.add(name)
        if name not in scope.configurations:
            if action.default_value is None:
                about = f" ({action.description})" if action.description else ""
                raise LaunchError(f"Launch argument '{name}'{about} is required: give {name}:=…")
            scope.configurations[name] = resolve(action.default_value, scope)
        value = scope.configurations[name]
        if action.choices is not None and value not in action.choices:
            raise LaunchError(
                f"Launch argument '{name}' must be one of {', '.join(action.choices)}, not '{shown(value)}'"
            )

    def _group(self, action: GroupAction, scope: Scope, after_sec: float) -> None:
        inner = scope.inner() if action.scoped else scope
        for name, value in action.launch_configurations.items():
            inner.configurations[name] = resolve(value, inner)
        self.add(action.actions, inner, after_sec)

    def _include(self, action: IncludeLaunchDescription, scope: Scope, after_sec: float) -> None:
        path = str(PurePath(scope.folder, resolve(action.path, scope)))
        if self._includes == MAX_INCLUDES:
            raise LaunchError(f"{path} is {MAX_INCLUDES} files deep; does one include itself?")
        given = cast("Any", action.launch_arguments)
        inner = scope.inner()
        for name, value in dict(given).items():
            inner.configurations[name] = resolve(value, scope)
        inner.folder, inner.file = str(PurePath(path).parent), path
        self._includes += 1
        self.add(self._library.description(path).actions, inner, after_sec)
        self._includes -= 1

    def _node(self, action: Node, scope: Scope) -> ProcessSpec:
        ways = [each for each in (action.executable, action.script) if each is not None]
        if len(ways) != 1 or (action.package is None) is not (action.executable is None):
            raise LaunchError("A Node needs package= and executable=, or script=")
        arguments = [resolve(each, scope) for each in action.arguments] + ros_arguments(action, scope)
        if action.script is not None:
            path = str(PurePath(scope.folder, resolve(action.script, scope)))
            command, typed = self._library.script(path), [path]
            program = PurePath(path).stem
        else:
            names = resolve(cast("Any", action.package), scope), resolve(ways[0], scope)
            command, typed = self._library.program(*names), list(names)
            program = names[1]
        typed = ["callboard", "run", *typed, *arguments]
        label = program if action.name is None else resolve(action.name, scope)
        return self._spec(action, scope, label, [*command, *arguments], typed)

    def _process(self, action: ExecuteProcess, scope: Scope) -> ProcessSpec:
        command = [resolve(each, scope) for each in action.cmd]
        if not command:
            raise LaunchError("ExecuteProcess needs a program: cmd=['echo', 'hello']")
        name = PurePath(command[0]).name if action.name is None else resolve(action.name, scope)
        return self._spec(action, scope, name, command, command)

    def _spec(
        self, action: Launched, scope: Scope, name: str, command: Sequence[str], typed: Sequence[str]
    ) -> ProcessSpec:
        if not name or not name.isprintable():
            raise LaunchError(f"A process cannot have the name '{shown(name)}'")
        output = resolve(action.output, scope)
        if output != "screen":
            raise LaunchError(f"{name}: output can be 'screen' only, not '{shown(output)}'")
        self._processes += 1
        if self._processes > MAX_PROCESSES:
            raise LaunchError(f"The description comes to more than {MAX_PROCESSES} processes")
        prefix = _words(resolve(action.prefix, scope))
        extra = {key: resolve(value, scope) for key, value in action.additional_env.items()}
        base = (
            scope.environment
            if action.env is None
            else {key: resolve(value, scope) for key, value in action.env.items()}
        )
        delay = _seconds("respawn_delay", action.respawn_delay, scope)
        return ProcessSpec(
            label=f"{name}-{self._processes}",
            name=name,
            command=(*prefix, *command),
            shown=shlex.join((*prefix, *typed)),
            cwd=None if action.cwd is None else resolve(action.cwd, scope),
            environment={**base, **extra},
            own_environment=extra if action.env is None else {**base, **extra},
            respawn=_yes(action.respawn, scope),
            respawn_delay_sec=max(delay, LEAST_RESPAWN_DELAY_SEC),
            respawn_max_retries=action.respawn_max_retries,
            required=_yes(action.required, scope) or action.on_exit is not None,
        )

    def _start(self, process: ProcessSpec, after_sec: float) -> None:
        self.steps.append(Start(process=process, after_sec=after_sec))


def _yes(value: Any, scope: Scope) -> bool:
    return value if isinstance(value, bool) else truth(value, scope)


def _words(prefix: str) -> list[str]:
    try:
        return shlex.split(prefix)
    except ValueError as error:
        raise LaunchError(f"prefix '{shown(prefix)}' is no command: {error}") from None


def _seconds(what: str, value: Any, scope: Scope) -> float:
    text = value if isinstance(value, int | float) else resolve(value, scope)
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not 0 <= number < math.inf:
        raise LaunchError(f"{what} must be a number of seconds, 0 or more, not '{shown(str(text))}'")
    return number
