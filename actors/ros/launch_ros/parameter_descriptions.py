"""Parameters of nodes, and files of them."""

from __future__ import annotations

import tempfile
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any

from actors.launch import ParameterValue as ParameterValue
from actors.launch.description.conditions import to_bool
from actors.launch.description.substitutions import Substitution, resolve
from actors.launch.documents.templates import template

if TYPE_CHECKING:
    from actors.launch.description.substitutions import Scope, Text


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


class ParameterFile(Substitution):
    """A YAML file of parameters.

    Args:
        param_file: The file.
        allow_substs: Whether it can contain `$(var NAME)` and other substitutions of XML launch files. The
            result is a temporary file, which the launch leaves behind.
    """

    def __init__(self, param_file: Text, *, allow_substs: bool | Text = False) -> None:
        self._file, self._allow = param_file, allow_substs

    def perform(self, scope: Scope) -> str:
        """Return the path of a file without substitutions.

        Raises:
            LaunchError: It cannot be read, or a substitution has no value.
        """
        path = str(PurePath(scope.folder, resolve(self._file, scope)))
        if not to_bool(self._allow, scope):
            return path
        text = resolve(template(scope.library.text(path)), scope)
        with tempfile.NamedTemporaryFile("w", prefix="launch_params_", suffix=".yaml", delete=False) as file:
            file.write(text)
        return str(Path(file.name))
