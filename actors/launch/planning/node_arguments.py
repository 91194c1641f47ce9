"""The ROS arguments on the command line of a node: name, namespace, parameters, remappings."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, Final, cast

from actors.interfaces.yaml_writer import flow_text
from actors.launch.description.substitutions import resolve
from actors.launch.errors import LaunchError
from actors.launch.planning.namespaces import prefix_namespace
from actors.launch.planning.parameter_values import parameter_value
from actors.parameters.file_parser import PARAMETERS_KEY
from proto.untrusted_text import escape
from proto.wire.names import full_node_name, normalize_namespace, validate_namespace, validate_node_name

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from actors.launch.description.process_actions import Node
    from actors.launch.description.substitutions import LaunchContext, Text

_ARGUMENT_NAME: Final = re.compile(r"/?(?!__)[A-Za-z_]\w*([./](?!__)[A-Za-z_]\w*)*", re.ASCII)
"""Names that `-p` of rcl can have: others are syntax there, and one with a colon is another node's."""


def ros_arguments(node: Node, context: LaunchContext) -> list[str]:
    """Return `--ros-args` and the arguments after it; an empty list if there are none.

    Raises:
        LaunchError: A parameter or parameter file is not valid, or a substitution has no value.
        InvalidNameError: The name or namespace is not valid.
    """
    arguments = list(_arguments(node, context))
    return ["--ros-args", *arguments] if arguments else []


def full_name(node: Node, context: LaunchContext) -> str | None:
    """Return the full name that a node will have; None if its program chooses it.

    Raises:
        LaunchError: A substitution has no value.
        InvalidNameError: The name or namespace is not valid.
    """
    name = _name(node, context)
    return None if name is None else full_node_name(_namespace(node, context) or "/", name)


def _arguments(node: Node, context: LaunchContext) -> Iterator[str]:
    node_name, namespace = _name(node, context), _namespace(node, context)
    if node_name is not None:
        yield from ("-r", f"__node:={node_name}")
    if namespace is not None:
        yield from ("-r", f"__ns:={namespace}")
    # The last of several values of a parameter counts, but the first of several rules for a name. So the
    # node's own come last: its parameters override those of `SetParameter`, and its rules do not override
    # `SetRemap`.
    for path in context.parameter_files:
        yield from ("--params-file", path)
    yield from _parameter_arguments(context.parameters.items(), context)
    for entry in cast("Sequence[Any]", node.parameters):
        if isinstance(entry, Mapping):
            texts = parameter_texts(cast("Mapping[Text, Any]", entry), context)
            yield from _parameter_arguments(texts, context)
        else:
            path = str(PurePath(context.folder, resolve(entry, context)))
            yield from ("--params-file", context.library.parameter_file(path))
    for old, new in (*context.remappings, *node.remappings):
        yield from ("-r", f"{resolve(old, context)}:={resolve(new, context)}")
    for each in node.ros_arguments:
        yield resolve(each, context)


def _parameter_arguments(texts: Iterable[tuple[str, str]], context: LaunchContext) -> Iterator[str]:
    in_file: list[str] = []
    for name, value in texts:
        if _ARGUMENT_NAME.fullmatch(name):
            yield from ("-p", f"{name}:={value}")
        else:
            in_file.append(f"{flow_text(name)}: {value}")
    if in_file:
        text = f"/**: {{{PARAMETERS_KEY}: {{{', '.join(in_file)}}}}}\n"
        yield from ("--params-file", context.library.temporary_file("parameters.yaml", text))


def _name(node: Node, context: LaunchContext) -> str | None:
    if node.name is None:
        return None
    name = resolve(node.name, context)
    validate_node_name(name)
    return name


def _namespace(node: Node, context: LaunchContext) -> str | None:
    own = None if node.namespace is None else resolve(node.namespace, context)
    namespace = prefix_namespace(context.namespace, own)
    if namespace is None:
        return None
    namespace = normalize_namespace(namespace)
    validate_namespace(namespace)
    return namespace


def parameter_texts(
    values: Mapping[Text, Any], context: LaunchContext, prefix: str = ""
) -> Iterator[tuple[str, str]]:
    """Yield names of parameters, and their values as YAML that any node reads as the same values.

    Names in nested mappings are joined by dots.

    Raises:
        LaunchError: A value cannot be that of a parameter, or a substitution has no value.
    """
    for key, value in values.items():
        name = f"{prefix}{resolve(key, context)}"
        if isinstance(value, Mapping):
            yield from parameter_texts(cast("Mapping[Text, Any]", value), context, f"{name}.")
        else:
            if not name:
                raise LaunchError("The name of a parameter is empty")
            try:
                yield name, flow_text(parameter_value(value, context))
            except (LaunchError, ValueError) as error:
                raise LaunchError(f"Parameter '{escape(name)}': {error}") from None
