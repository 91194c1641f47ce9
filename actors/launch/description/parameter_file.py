"""Parameter files with substitutions in them."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING

from actors.launch.description.conditions import to_bool
from actors.launch.description.substitutions import Substitution, resolve
from actors.launch.description.templates import template

if TYPE_CHECKING:
    from actors.launch.description.substitutions import LaunchContext, Text


@dataclass(frozen=True)
class ParameterFile(Substitution):
    """The path of a YAML file of parameters, in which there may be substitutions such as `$(var robot)`.

    Attributes:
        param_file: The file; a relative path starts at the folder of the launch file.
        allow_substs: Whether to evaluate substitutions in its text. Nodes then get a temporary file, which is
            removed when the launch has ended.
    """

    param_file: Text
    _: KW_ONLY
    allow_substs: bool | Text = False

    def perform(self, context: LaunchContext) -> str:
        path = PurePath(context.folder, resolve(self.param_file, context))
        if not to_bool(self.allow_substs, context):
            return str(path)
        # As in ROS 2 the text is evaluated before it is read as YAML: a substitution may be any part of it.
        text = resolve(template(context.library.text(str(path))), context)
        return context.library.temporary_file(path.name, text)
