"""Parameters of nodes, and files of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from actors.launch import (
    ParameterFile as ParameterFile,
    ParameterValue as ParameterValue,
)

if TYPE_CHECKING:
    from actors.launch.description.substitutions import Text


class Parameter(dict["Text", Any]):
    """One parameter, for the `parameters` of a node.

    Args:
        name: Its name.
        value: Its value.
        value_type: Its type; None: as YAML reads it.
        description: Ignored.
    """

    def __init__(
        self, name: Text, value: Any, *, value_type: type[Any] | None = None, description: str | None = None
    ) -> None:
        key = tuple(name) if isinstance(name, list) else name
        super().__init__({key: value if value_type is None else ParameterValue(value, value_type=value_type)})
