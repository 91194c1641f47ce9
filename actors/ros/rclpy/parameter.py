"""callboard's parameters, under rclpy's names."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TYPE_CHECKING, TypeAlias

from actors.parameters import types as native
from actors.parameters.errors import InvalidParameterFileError
from actors.parameters.overrides import load_parameter_file
from actors.parameters.types import Parameter as Parameter
from actors.ros.rclpy.imported_names import imported_names

if TYPE_CHECKING:
    from collections.abc import Sequence

    from actors.interfaces.rcl_interfaces.msg import Parameter as ParameterMessage
    from actors.interfaces.rcl_interfaces.msg import ParameterValue

AllowableParameterValue: TypeAlias = native.ParameterValue

PARAMETER_SEPARATOR_STRING = "."
_EVERY_NODE = "/**"

__getattr__ = imported_names(__name__, "ParameterType ParameterValue")


def get_parameter_value(string_value: str) -> ParameterValue:
    """Return the value that a string has by YAML's rules; what no parameter can hold is a string."""
    return Parameter("", value=native.parameter_value_from_string(string_value)).get_parameter_value()


def parameter_value_to_python(parameter_value: ParameterValue) -> Any:
    """Return the value of a message, a list of single bytes for an array of bytes; None if it has none.

    Raises:
        RuntimeError: There is no such type.
    """
    try:
        value = native.parameter_value_to_python(parameter_value)
    except ValueError as error:
        raise RuntimeError(str(error)) from None
    return [bytes((each,)) for each in value] if isinstance(value, bytes) else value


def parameter_dict_from_yaml_file(
    parameter_file: str,
    use_wildcard: bool = False,
    target_nodes: Sequence[str] | None = None,
    namespace: str = "",
) -> dict[str, ParameterMessage]:
    """Return the parameters in a file.

    Args:
        parameter_file: Its path.
        use_wildcard: Also take what it has for all nodes, `/**`; what it has for one node wins.
        target_nodes: Only take what it has for these nodes; None for those of all nodes.
        namespace: Prefix of the names; "" for none.

    Returns:
        The messages by name.

    Raises:
        FileNotFoundError: There is no such file.
        RuntimeError: It is no parameter file, or has nothing for a target node.
    """
    # Raises FileNotFoundError, as programs expect; the error of `load_parameter_file` is another one.
    Path(parameter_file).stat()
    try:
        entries = load_parameter_file(parameter_file)
    except InvalidParameterFileError as error:
        raise RuntimeError(str(error)) from None
    found = {each.pattern for each in entries}
    wanted = {f"/{name.strip('/')}" for name in target_nodes or ()} or found - {_EVERY_NODE}
    if missing := sorted(wanted - found):
        nodes = ", ".join(sorted(found))
        raise RuntimeError(f"{parameter_file} has no parameters of {', '.join(missing)}, only of {nodes}")
    chosen = [each for each in entries if use_wildcard and each.pattern == _EVERY_NODE]
    # After the wildcard's, so that what a node has for itself wins in the dict below.
    chosen += [each for each in entries if each.pattern in wanted]
    if not chosen:
        raise RuntimeError(f"{parameter_file} has none of the wanted parameters")
    names = [namespace + each.name for each in chosen]
    return {
        name: Parameter(name, value=each.value).to_parameter_msg()
        for name, each in zip(names, chosen, strict=True)
    }
