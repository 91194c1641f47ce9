"""Where a launch description comes from, as ROS 2's files say it.

IncludeLaunchDescription(PythonLaunchDescriptionSource([ThisLaunchFileDir(), "/camera.launch.py"]))
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from actors.launch.substitutions import Substitution, resolve

if TYPE_CHECKING:
    from actors.launch.substitutions import Scope, Text


@dataclass(frozen=True)
class AnyLaunchDescriptionSource(Substitution):
    """A launch file; what kind it is its name says.

    Attributes:
        launch_file_path: The file.
    """

    launch_file_path: Text

    def perform(self, scope: Scope) -> str:
        """Return the path."""
        return resolve(self.launch_file_path, scope)


PythonLaunchDescriptionSource = AnyLaunchDescriptionSource
