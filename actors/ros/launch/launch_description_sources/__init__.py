"""Launch files. The suffix of a file tells its language."""

from __future__ import annotations

from typing import TYPE_CHECKING

from actors.launch import (
    AnyLaunchDescriptionSource as AnyLaunchDescriptionSource,
    LaunchFileError as InvalidLaunchFileError,
    PythonLaunchDescriptionSource as PythonLaunchDescriptionSource,
)
from actors.ros.launch.library import ros_files

if TYPE_CHECKING:
    from actors.launch import LaunchDescription

FrontendLaunchDescriptionSource = AnyLaunchDescriptionSource
InvalidPythonLaunchFileError = InvalidLaunchFileError
InvalidFrontendLaunchFileError = InvalidLaunchFileError


def get_launch_description_from_any_launch_file(launch_file_path: str) -> LaunchDescription:
    """Return the description in a launch file.

    Raises:
        InvalidLaunchFileError: It cannot be read, fails, or describes nothing.
    """
    return ros_files().description(launch_file_path)


get_launch_description_from_python_launch_file = get_launch_description_from_any_launch_file
get_launch_description_from_frontend_launch_file = get_launch_description_from_any_launch_file
