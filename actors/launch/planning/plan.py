"""The plan of a launch: the steps of a description, with given arguments and a given environment.

No I/O and no clock: a `LaunchLibrary` knows files and packages, and each step has the time when it is due.
Errors in a description are found here, before anything has been started, except in actions that functions in
timers and event handlers return, because these functions run later.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, TypeVar

from actors.launch.description.action import Action, Setting, known_actions
from actors.launch.description.actions import (
    DeclareLaunchArgument,
    EmitEvent,
    GroupAction,
    IncludeLaunchDescription,
    LogInfo,
    OpaqueFunction,
    RegisterEventHandler,
    Shutdown,
    TimerAction,
    UnsupportedAction,
)
from actors.launch.description.description import LaunchDescription, declared_arguments
from actors.launch.description.description_source import included_context
from actors.launch.description.event_handlers import OnProcessExit, OnStateTransition, ProcessHandler
from actors.launch.description.lifecycle import ChangeState, LifecycleTransition
from actors.launch.description.process_actions import ExecuteProcess, Node, RosBridge
from actors.launch.description.substitutions import LaunchContext, NoEventError, TextCount, resolve
from actors.launch.description.summaries import function_name
from actors.launch.errors import LaunchError, UnknownArgumentError
from actors.launch.planning.declarations import MAX_INCLUDED, MAX_INCLUDES, all_declared
from actors.launch.planning.dependencies import KnownNodes
from actors.launch.planning.error_location import with_location
from actors.launch.planning.lifecycle import change_state, lifecycle_transition
from actors.launch.planning.option_values import option_value
from actors.launch.planning.process_resolution import (
    LAUNCH_PREFIX,
    LAUNCH_PREFIX_FILTER,
    ending,
    make_spec,
)
from actors.launch.planning.process_spec import MAX_PROCESSES
from actors.launch.planning.reactions import call_function, call_reaction, triggers
from actors.launch.planning.settings import apply_setting
from actors.launch.planning.steps import AddHandler, Call, End, LogText, Start, all_steps
from actors.tools.suggestions import did_you_mean
from proto.errors import CallboardError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from actors.launch.description.action import EventHandler, Reaction
    from actors.launch.description.description_source import LaunchLibrary
    from actors.launch.description.process_actions import OutputMode
    from actors.launch.planning.events import Event
    from actors.launch.planning.steps import Step

T = TypeVar("T")


def make_plan(
    description: LaunchDescription,
    library: LaunchLibrary,
    *,
    arguments: Mapping[str, str],
    environment: Mapping[str, str],
    folder: str,
    output: OutputMode | None = None,
) -> list[Step]:
    """Return the steps of a description in order, including those for later.

    Args:
        description: The description.
        library: Finds files and packages.
        arguments: The launch arguments that were given.
        environment: The environment of programs.
        folder: The folder of the description's file.
        output: Where the lines of all processes go; None: as the description has it.

    Raises:
        UnknownArgumentError: An argument was given that the description neither declares nor uses.
        LaunchError: The description has another error; the text names the action and its file.
    """
    planner = _Planner(library, output)
    # Copies: actions change the context, and a launch may be planned again with the same arguments.
    context = LaunchContext(
        library=library,
        launch_configurations=dict(arguments),
        environment=dict(environment),
        first_environment=environment,
        folder=folder,
        file=description.file,
        used={LAUNCH_PREFIX, LAUNCH_PREFIX_FILTER},  # every description has them
    )
    outer = context.inner()  # as it is before the first action, for the search below
    steps = planner.plan(description.actions, context)
    known = planner.declared | {each.name for each in declared_arguments(description.actions)}
    # An argument that nothing declares may still be read with a default: then it is used.
    unknown = [name for name in arguments if name not in known | context.used]
    if unknown and not planner.partial:
        raise UnknownArgumentError(unknown[0], tuple(sorted(known)))
    if unknown:
        # A file that is not included now may declare it. A function may use it, but that is not likely.
        known |= {each.name for each in all_declared(description.actions, outer, library)}
    warnings = [
        f"No launch argument '{escape(name)}' is declared{did_you_mean(name, known)}"
        for name in unknown
        if name not in known
    ]
    return [LogText(text=text, warning=True) for text in (*warnings, *planner.warnings(steps))] + steps


class _Planner:
    """Plans the actions of a description, and later those that its functions return.

    Attributes:
        declared: The arguments that have been declared.
        partial: Whether actions may follow that are not known yet, so that warnings would be premature.
    """

    def __init__(self, library: LaunchLibrary, output: OutputMode | None) -> None:
        self.declared: set[str] = set()
        self.partial = False
        self._library = library
        self._output = output
        self._include_depth = 0
        self._includes_left = MAX_INCLUDED
        self._last_number = 0
        self._processes_left = MAX_PROCESSES
        # Depth of timers and handlers around the current action. In them functions are called when they are
        # due.
        self._deferred = 0
        # Whether the launch runs, so that what is planned now comes from a function.
        self._running = False
        self._nodes = KnownNodes()
        # Names that handlers refer to, checked when all processes are known.
        self._targets: list[str] = []

    def plan(self, actions: Iterable[Action], context: LaunchContext) -> list[Step]:
        """Return the steps of actions. Their settings change the context.

        Raises:
            LaunchError: An action has an error.
        """
        steps: list[Step] = []
        for action in actions:
            try:
                steps += self._plan_action(action, context)
            except NoEventError:
                raise  # to the handler around it, which is planned again with its event
            except CallboardError as error:
                if isinstance(error, LaunchError) and error.has_location:
                    raise
                raise with_location(error, action, context.file) from error
            except (KeyboardInterrupt, Exception):
                raise  # a bug: its traceback says more than the action
            except BaseException as error:  # of a substitution or condition, such as that of pytest.fail
                raise with_location(error, action, context.file) from error
        return steps

    def warnings(self, steps: Sequence[Step]) -> list[str]:
        """Return warnings about likely errors in a whole plan."""
        starts = [step.process for step in all_steps(steps) if isinstance(step, Start)]
        names = {name for each in starts for name in (each.name, each.label)}
        warnings = [
            f"An event handler is for '{escape(target)}', but no process has that name"
            for target in self._targets
            if target not in names and not self.partial
        ]
        labels: dict[str, str] = {}
        for step in steps:  # not those of handlers, which may start a node in place of another one
            if isinstance(step, Start) and step.process.node is not None:
                label, node = step.process.label, step.process.node
                first = labels.setdefault(node, label)
                if first != label:
                    warnings.append(f"Two nodes have the name {node}: {first} and {label}")
        return warnings

    def _plan_action(self, action: Action, context: LaunchContext) -> Iterable[Step]:
        if action.condition is None or action.condition.evaluate(context):
            return self._steps(action, context)
        # What it would have declared or started is unknown now, so warnings about that could be wrong.
        if isinstance(action, GroupAction | TimerAction | IncludeLaunchDescription | OpaqueFunction):
            self.partial = True
        return []

    def _steps(self, action: Action, context: LaunchContext) -> Iterable[Step]:  # noqa: C901, PLR0911, PLR0912 - a table
        match action:
            case Node() | ExecuteProcess() | RosBridge():
                return self._start(action, context)
            case DeclareLaunchArgument():
                self._declare(action, context)
            case LogInfo():
                return [LogText(text=resolve(action.msg, context))]
            case GroupAction():
                return self._group(action, context)
            case Setting():
                apply_setting(action, context)
            case IncludeLaunchDescription():
                return self._include(action, context)
            case TimerAction():
                return self._delay(action, context)
            case OpaqueFunction():
                return self._opaque(action, context)
            case RegisterEventHandler():
                return self._react(action.event_handler, context)
            case EmitEvent(event=ChangeState() as event):
                return [change_state(event, context)]
            case EmitEvent(event=Shutdown() as shutdown):
                return self.plan([shutdown], context)
            case LifecycleTransition():
                return lifecycle_transition(action, context)
            case Shutdown():
                return [End(reason=resolve(action.reason, context))]
            case UnsupportedAction():
                raise LaunchError(f"callboard has no {action.action_type}: {action.remedy}")
            # An action class of the user: what ROS 2 calls with the context.
            case _ if callable(execute := getattr(action, "execute", None)):
                return self._opaque(OpaqueFunction(function=execute), context)
            case _:
                raise LaunchError(f"{type(action).__name__} is not an action that can be carried out")
        return []

    def _delay(self, action: TimerAction, context: LaunchContext) -> list[Step]:
        later = option_value(action, "period", context)
        cancel = option_value(action, "cancel_on_shutdown", context)
        steps = self._deferring(action.actions, context.inner())
        # A timer in another one is cancelled with it: that one would have begun it.
        return [
            replace(
                step,
                after_sec=later + step.after_sec,
                cancel_on_shutdown=cancel or (step.after_sec > 0 and step.cancel_on_shutdown),
            )
            for step in steps
        ]

    def _declare(self, action: DeclareLaunchArgument, context: LaunchContext) -> None:
        name = action.name
        if not name:
            raise LaunchError("A launch argument needs a name")
        self.declared.add(name)
        # One that an outer file has set counts, so that a file can set arguments of those that it includes.
        if name not in context.launch_configurations:
            if action.default_value is None:
                about = f" ({action.description})" if action.description else ""
                raise LaunchError(f"Launch argument '{name}'{about} is required: give {name}:=…")
            context.launch_configurations[name] = resolve(action.default_value, context)
        value = context.launch_configurations[name]
        if action.choices is not None and value not in action.choices:
            raise LaunchError(
                f"Launch argument '{name}' must be one of {', '.join(action.choices)}, not '{escape(value)}'"
            )

    def _group(self, action: GroupAction, context: LaunchContext) -> list[Step]:
        # As in ROS 2: with `forwarding` an argument can use those before it. Otherwise all of them are
        # evaluated outside. A group that is not scoped could not forget what is outside.
        inner = outside = context.inner() if action.scoped else context
        if action.scoped and not action.forwarding:
            outside, inner = inner, context.initial()
            outside.environment = inner.environment
        for name, value in action.launch_configurations.items():
            inner.launch_configurations[name] = resolve(value, outside)
        return self.plan(action.actions, inner)

    def _include(self, action: IncludeLaunchDescription, context: LaunchContext) -> list[Step]:
        inner = included_context(action, context)
        path = str(inner.file)
        if self._include_depth == MAX_INCLUDES:
            raise LaunchError(f"{path} is {MAX_INCLUDES} files deep; does one include itself?")
        if self._includes_left == 0:
            raise LaunchError(f"The launch includes more than {MAX_INCLUDED} files, with {path}")
        self._includes_left -= 1
        self._include_depth += 1
        steps = self.plan(self._library.description(path).actions, inner)
        self._include_depth -= 1
        # In ROS 2's own format an include is not scoped: files set what later actions of the including one
        # use.
        if not action.scoped:
            context.adopt(inner)
        return steps

    def _start(self, action: Node | ExecuteProcess | RosBridge, context: LaunchContext) -> list[Step]:
        if self._processes_left == 0:
            raise LaunchError(f"The description has more than {MAX_PROCESSES} processes")
        self._processes_left -= 1
        self._last_number += 1  # never reused, so that a label means one process in all logs
        spec = make_spec(action, context, number=self._last_number, nodes=self._nodes)
        spec = replace(spec, output=self._output or spec.output, made_later=self._running)
        self._nodes.add(action, spec.node)
        # A Shutdown alone has made the process a required one, which needs no handler.
        if action.on_exit is not None and ending(action.on_exit) is None:
            handler = OnProcessExit(target_action=action, on_exit=action.on_exit)
            (reaction,) = self._react(handler, context)
            return [Start(process=spec, on_exit=reaction)]
        return [Start(process=spec)]

    def _react(self, handler: EventHandler, context: LaunchContext) -> list[AddHandler]:
        """Plan the reactions of a handler; those of a function are planned when it has been called."""
        target = None
        if isinstance(handler, ProcessHandler):
            target = handler.target_action
        elif isinstance(handler, OnStateTransition):
            target = handler.target_lifecycle_node
        # A handler that a function returns may name a process that has ended and been forgotten.
        if isinstance(target, str) and not self._running:
            self._targets.append(target)
        found = triggers(handler, context, self._nodes)
        # A context for each: the settings of one reaction must not apply to another.
        return [self._reaction(step, reaction, context.inner()) for reaction, step in found]

    def _reaction(self, step: AddHandler, reaction: Reaction, context: LaunchContext) -> AddHandler:
        if callable(reaction):
            self.partial = True

            def react(event: Event) -> list[Step]:
                inner = replace(
                    context.inner(), event=event, texts=TextCount()
                )  # or settings of each event would add up
                return self._replan(call_reaction(reaction, event, inner), inner)

            return replace(step, steps=react, calls=True)
        try:
            steps = self._deferring(known_actions(reaction), context)
        except NoEventError:  # it needs the event, so it is planned when that happens
            return self._reaction(step, partial(_ignore_event, known_actions(reaction)), context)

        return replace(step, steps=partial(_ignore_event, steps), preview=tuple(steps))

    def _opaque(self, action: OpaqueFunction, context: LaunchContext) -> list[Step]:
        """Call the function now; in a timer or handler, when that is due."""

        def call() -> Sequence[Action]:
            return call_function(action.function, (context, *action.args), action.kwargs, context.file)

        if not self._deferred:
            return self.plan(call(), context)
        self.partial = True
        return [Call(name=function_name(action.function), steps=lambda: self._replan(call(), context))]

    def _deferring(self, actions: Iterable[Action], context: LaunchContext) -> list[Step]:
        """Plan actions of a timer or handler, whose functions are not called yet."""
        self._deferred += 1
        try:
            return self.plan(actions, context)
        finally:
            self._deferred -= 1

    def _replan(self, actions: Iterable[Action], context: LaunchContext) -> list[Step]:
        """Plan the actions that a function has returned while the launch runs."""
        # A limit for each call: a launch that replaces its processes for weeks may start any number of them.
        self._processes_left, self._includes_left, self._running = MAX_PROCESSES, MAX_INCLUDED, True
        return self.plan(actions, context)


def _ignore_event(value: T, _event: Event) -> T:
    return value
