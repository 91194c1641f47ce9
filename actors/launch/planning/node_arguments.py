"""The ROS arguments on the command line of a node: name, namespace, parameters, remappings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, cast

from actors.interfaces.yaml_writer import flow_text
from actors.launch.description.substitutions import resolve
from actors.launch.errors import LaunchError
from actors.launch.planning.namespaces import prefix_namespace
from actors.launch.planning.parameter_values import parameter_value
from actors.parameters.overrides import ARGUMENT_NAME
from proto.untrusted_text import escape
from proto.wire.names import full_node_name, normalize_namespace, validate_namespace, validate_node_name

if TYPE_CHECKING:
    from collections.abc import Iterator

    from actors.launch.description.process_actions import Node
    from actors.launch.description.substitutions import Scope, Text


def ros_arguments(node: Node, scope: Scope) -> list[str]:
    """Return `--ros-args` and the arguments after it; an empty list if there are none.

    Raises:
        LaunchError: A parameter or parameter file is not valid, or a substitution has no value.
        InvalidNameError: The name or namespace is not valid.
    """
    arguments = list(_arguments(node, scope))
    return ["--ros-args", *arguments] if arguments else []


def full_name(node: Node, scope: Scope) -> str | None:
    """Return the full name that a node will have; None if its program chooses it.

    Raises:
        LaunchError: A substitution has no value.
        InvalidNameError: The name or namespace is not valid.
    """
    name = _name(node, scope)
    return None if name is None else full_node_name(_namespace(node, scope) or "/", name)


def _arguments(node: Node, scope: Scope) -> Iterator[str]:
    node_name, namespace = _name(node, scope), _namespace(node, scope)
    if node_name is not None:
        yield from ("-r", f"__node:={node_name}")
    if namespace is not None:
        yield from ("-r", f"__ns:={namespace}")
    # The last of several values of a parameter counts, but the first of several rules for a name. So the
    # node's own come last: its parameters override those of `SetParameter`, and its rules do not override
    # `SetRemap`.
    for path in scope.parameter_files:
        yield from ("--params-file", path)
    for name, value in scope.parameters.items():
        yield from ("-p", f"{name}:={value}")
    for entry in cast("Sequence[Any]", node.parameters):
        if isinstance(entry, Mapping):
            for name, value in parameter_texts(cast("Mapping[Text, Any]", entry), scope):
                yield from ("-p", f"{name}:={value}")
        else:
            path = str(PurePath(scope.folder, resolve(entry, scope)))
            yield from ("--params-file", scope.library.parameter_file(path))
    for old, new in (*scope.remappings, *node.remappings):
        yield from ("-r", f"{resolve(old, scope)}:={resolve(new, scope)}")
    for each in node.ros_arguments:
        yield resolve(each, scope)


def _name(node: Node, scope: Scope) -> str | None:
    if node.name is None:
        return None
    name = resolve(node.name, scope)
    validate_node_name(name)
    return name


def _namespace(node: Node, scope: Scope) -> str | None:
    own = None if node.namespace is None else resolve(node.namespace, scope)
    namespace = prefix_namespace(scope.namespace, own)
    if namespace is None:
        return None
    namespace = normalize_namespace(namespace)
    validate_namespace(namespace)
    return namespace


def parameter_texts(values: Mapping[Text, Any], scope: Scope, prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield names of parameters, and their values as YAML that any node reads as the same values.

    Names in nested mappings are joined by dots.

    Raises:
        LaunchError: A value cannot be that of a parameter, or a substitution has no value.
    """
    for key, value in values.items():
        name = f"{prefix}{resolve(key, scope)}"
        if isinstance(value, Mapping):
            yield from parameter_texts(cast("Mapping[Text, Any]", value), scope, f"{name}.")
        else:
            if not ARGUMENT_NAME.fullmatch(name):
                # With a colon it would be the parameter of another node.
                raise LaunchError(f"Parameter '{escape(name)}': such a name can be in a parameter file only")
            try:
                yield name, flow_text(parameter_value(value, scope))
            except (LaunchError, ValueError) as error:
                raise LaunchError(f"Parameter '{escape(name)}': {error}") from None
