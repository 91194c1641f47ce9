"""Substitutions. Where ROS 2's have other arguments than callboard's, they are subclasses."""

from __future__ import annotations

from pathlib import PurePath
from typing import TYPE_CHECKING, Any, cast

from actors.launch import (
    AllSubstitution as AllSubstitution,
    AndSubstitution as AndSubstitution,
    AnonName as AnonName,
    AnySubstitution as AnySubstitution,
    BooleanSubstitution as BooleanSubstitution,
    Command as CallboardCommand,
    EnvironmentVariable as EnvironmentVariable,
    EqualsSubstitution as EqualsSubstitution,
    FileContent as FileContent,
    FindExecutable as FindExecutable,
    IfElseSubstitution as IfElseSubstitution,
    LaunchConfiguration as CallboardConfiguration,
    LaunchError,
    LaunchLogDir as LaunchLogDir,
    LocalSubstitution as LocalSubstitution,
    NotEqualsSubstitution as NotEqualsSubstitution,
    NotSubstitution as NotSubstitution,
    OrSubstitution as OrSubstitution,
    PathJoinSubstitution as PathJoinSubstitution,
    PythonExpression as CallboardExpression,
    TextSubstitution as TextSubstitution,
    ThisLaunchFile as ThisLaunchFile,
    ThisLaunchFileDir as ThisLaunchFileDir,
)
from actors.launch.description.substitutions import Substitution, resolve

if TYPE_CHECKING:
    from collections.abc import Iterable

    from actors.launch.description.substitutions import LaunchContext, Text


SubstitutionFailure = LaunchError


class LaunchConfiguration(CallboardConfiguration):
    """The value of an argument.

    Args:
        variable_name: The argument.
        default: Its value if it is neither declared nor given; numbers and truth values become strings.
    """

    def __init__(self, variable_name: Text, *, default: Any = None) -> None:
        if default is not None and not isinstance(default, str | PurePath | Substitution | list | tuple):
            default = str(default)
        super().__init__(variable_name, cast("Text | None", default))


class Command(CallboardCommand):
    """The output of a command on stdout.

    Args:
        command: The command.
        on_stderr: Ignored: its stderr is shown if it fails.
    """

    def __init__(self, command: Text, *, on_stderr: Text = "fail") -> None:
        super().__init__(command)


class PythonExpression(CallboardExpression):
    """The value of an expression in a small part of Python.

    Args:
        expression: The expression.
        python_modules: Ignored: callboard evaluates expressions without modules.
    """

    def __init__(self, expression: Text, python_modules: Iterable[Text] = ()) -> None:
        super().__init__(expression)


class StringJoinSubstitution(Substitution):
    """Strings joined with a delimiter.

    Args:
        substitutions: The strings.
        delimiter: The delimiter.
    """

    def __init__(self, substitutions: Iterable[Text], delimiter: Text = "") -> None:
        self._substitutions, self._delimiter = tuple(substitutions), delimiter

    def perform(self, context: LaunchContext) -> str:
        """Return the joined string."""
        return resolve(self._delimiter, context).join(resolve(each, context) for each in self._substitutions)


class PathSubstitution(PathJoinSubstitution):
    """A path, to which `/` adds parts: `PathSubstitution(FindPackageShare("p")) / "launch"`.

    Args:
        path: The path, or its parts.
    """

    def __init__(self, path: Text) -> None:
        super().__init__(path if isinstance(path, list | tuple) else (path,))

    def __truediv__(self, part: Text) -> PathSubstitution:
        """Return the path with another part at its end."""
        return PathSubstitution((*self.substitutions, part))
