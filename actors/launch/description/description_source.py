"""Sources of launch descriptions, under ROS 2's names.

IncludeLaunchDescription(PythonLaunchDescriptionSource([ThisLaunchFileDir(), "/camera.launch.py"]))
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import PurePath
from typing import TYPE_CHECKING, Protocol

from actors.launch.description.library import Library
from actors.launch.description.options import required
from actors.launch.description.substitutions import Substitution, resolve

if TYPE_CHECKING:
    from actors.launch.description.actions import IncludeLaunchDescription
    from actors.launch.description.description import LaunchDescription
    from actors.launch.description.substitutions import LaunchContext, Text


@dataclass(frozen=True)
class AnyLaunchDescriptionSource(Substitution):
    """A launch file, whose kind follows from its suffix."""

    launch_file_path: Text = field(metadata=required("The file."))

    def perform(self, context: LaunchContext) -> str:
        return resolve(self.launch_file_path, context)


class LaunchLibrary(Library, Protocol):
    """A library that also reads launch files. Substitutions need none, so they know only `Library`."""

    def description(self, path: str) -> LaunchDescription:
        """Return the description of a launch file.

        Raises:
            LaunchFileError: It cannot be read, fails, or returns no description.
        """
        ...


def included_context(action: IncludeLaunchDescription, context: LaunchContext) -> LaunchContext:
    """Return the context of the file that an action includes.

    Raises:
        LaunchError: A substitution has no value there.
    """
    path = PurePath(context.folder, resolve(action.launch_description_source, context))
    inner = context.inner()
    # One after the other, in the folder of the including file: an argument can use those before it.
    for name, value in action.given:
        inner.launch_configurations[name] = resolve(value, inner)
    inner.folder, inner.file = str(path.parent), str(path)
    return inner


PythonLaunchDescriptionSource = AnyLaunchDescriptionSource
