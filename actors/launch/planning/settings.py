"""Settings: actions that change the context for the actions after them."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING, TypeVar

from actors.launch.description import actions
from actors.launch.description.conditions import to_bool
from actors.launch.description.substitutions import resolve
from actors.launch.errors import LaunchError
from actors.launch.planning.namespaces import prefix_namespace
from actors.launch.planning.node_arguments import parameter_texts
from proto.untrusted_text import escape
from proto.wire.names import normalize_namespace, validate_namespace

if TYPE_CHECKING:
    from collections.abc import Mapping

    from actors.launch.description.action import Setting
    from actors.launch.description.substitutions import LaunchContext, Text

T = TypeVar("T")


def apply_setting(action: Setting, context: LaunchContext) -> None:  # noqa: C901, PLR0912 - a table
    """Change a context as a setting says.

    Raises:
        LaunchError: A substitution has no value in the context, or a value is not valid.
        InvalidNamespaceError: A namespace is not valid.
    """
    match action:
        case actions.PushNamespace():
            context.namespace = prefix_namespace(context.namespace, resolve(action.namespace, context))
            validate_namespace(normalize_namespace(context.namespace or ""))
        case actions.SetLaunchConfiguration():
            context.launch_configurations[resolve(action.name, context)] = resolve(action.value, context)
        case actions.SetEnvironmentVariable():
            # Of the programs only: changing os.environ would change the launch itself.
            context.environment.update(variables({resolve(action.name, context): action.value}, context))
        case actions.UnsetEnvironmentVariable():
            context.environment.pop(resolve(action.name, context), None)
        case actions.AppendEnvironmentVariable():
            _append(action, context)
        case actions.SetParameter():
            context.parameters.update(parameter_texts({action.name: action.value}, context))
        case actions.SetRemap():
            # In order: the first rule that matches a name counts.
            context.remappings.append((resolve(action.src, context), resolve(action.dst, context)))
        case actions.SetParametersFromFile():
            path = str(PurePath(context.folder, resolve(action.filename, context)))
            context.parameter_files.append(context.library.parameter_file(path))
        case actions.PushLaunchConfigurations():
            context.saved_configurations.append(context.inner())
        case actions.PopLaunchConfigurations():
            context.restore(_last(action, context.saved_configurations))
        case actions.ResetLaunchConfigurations():
            # Evaluated first: the values may use the arguments that are forgotten.
            given = {name: resolve(value, context) for name, value in action.launch_configurations.items()}
            context.restore(context.initial())
            context.launch_configurations.update(given)
        case actions.UnsetLaunchConfiguration():
            context.launch_configurations.pop(resolve(action.name, context), None)
        case actions.PushEnvironment():
            context.saved_environments.append(dict(context.environment))
        case actions.PopEnvironment():
            context.environment = _last(action, context.saved_environments)
        case actions.ResetEnvironment():
            context.environment = dict(context.first_environment)
        case _:
            raise LaunchError(f"{type(action).__name__} is not an action that can be carried out")


def _last(action: Setting, saved: list[T]) -> T:
    # A context begins with empty stacks, so that a group cannot pop what was pushed outside of it.
    if not saved:
        raise LaunchError(f"{type(action).__name__}: nothing has been pushed in this group or file")
    return saved.pop()


def variables(given: Mapping[str, Text], context: LaunchContext) -> dict[str, str]:
    """Return environment variables and their values.

    Raises:
        LaunchError: A substitution has no value in the context, or the name or value is not valid.
    """
    found = {name: resolve(value, context) for name, value in given.items()}
    # The start of each process would fail with an error that does not name the action.
    for name, value in found.items():
        if not name or "=" in name or "\0" in name + value:
            raise LaunchError(f"There can be no environment variable '{escape(f'{name}={value}')}'")
    return found


def _append(action: actions.AppendEnvironmentVariable, context: LaunchContext) -> None:
    name = resolve(action.name, context)
    parts = [context.environment.get(name), resolve(action.value, context)]
    if to_bool(action.prepend, context):
        parts.reverse()
    value = resolve(action.separator, context).join(each for each in parts if each)
    context.environment.update(variables({name: value}, context))
