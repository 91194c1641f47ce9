"""Writes parameter files, in the form that `overrides.load_parameter_file` reads."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from actors.interfaces.yaml_writer import block_text
from actors.parameters.file_parser import PARAMETERS_KEY
from actors.parameters.listing import SEPARATOR
from actors.parameters.types import ParameterType

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actors.parameters.types import Parameter


def parameter_tree(parameters: Iterable[Parameter]) -> dict[str, object]:
    """Return values by name, sorted: a mapping in which each level of a name is a mapping of its own.

    A name that continues the name of another parameter stays in one piece, and so does one with an empty
    level, because a parameter file cannot have an empty key.

    Args:
        parameters: The parameters; those without a value are left out.
    """
    tree: dict[str, object] = {}
    # Sorted, so that `a` comes before `a.b`: it is then known that `a` is a value, and cannot be a map as
    # well.
    for parameter in sorted(parameters, key=lambda each: each.name):
        if parameter.type_ is ParameterType.NOT_SET:
            continue
        level, rest = tree, parameter.name
        while SEPARATOR in rest and all(rest.split(SEPARATOR)):
            first, _, last = rest.partition(SEPARATOR)
            if not isinstance(level.setdefault(first, {}), dict):
                break
            level, rest = cast("dict[str, object]", level[first]), last
        level[rest] = parameter.value
    return tree


def parameter_file_text(node: str, parameters: Iterable[Parameter]) -> str:
    """Return a node's parameters as a parameter file, as `ros2 param dump` prints it.

    Args:
        node: The node's full name.
        parameters: Its parameters.
    """
    return block_text({node: {PARAMETERS_KEY: parameter_tree(parameters)}})
