"""Substitutions that use the library, and those with values that a launch has chosen."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING

from actors.interfaces.yaml_reader import load_yaml
from actors.interfaces.yaml_scalars import rcl_scalar
from actors.launch.description.substitutions import Substitution, resolve, split_command
from actors.launch.errors import LaunchError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from actors.launch.description.substitutions import Scope, Text


@dataclass(frozen=True)
class Command(Substitution):
    """The output of a command on stdout, without the line ends at its end.

    The command is run when the description is planned, without a shell. Its stderr is shown only if it fails.

    Attributes:
        command: The command as users would type it: a shell's rules split it, so that a path with spaces
            needs quotes: ["xacro '", path, "'"].
    """

    command: Text

    def perform(self, scope: Scope) -> str:
        text = resolve(self.command, scope)
        try:
            words = split_command(text)
        except ValueError as error:
            raise LaunchError(f"'{escape(text)}' is not a command: {error}") from None
        return scope.library.output_of(words, scope.environment).rstrip("\r\n")


@dataclass(frozen=True)
class FindExecutable(Substitution):
    """The path of a program, found along PATH.

    Attributes:
        name: The program's name.
    """

    name: Text

    def perform(self, scope: Scope) -> str:
        return scope.library.executable(resolve(self.name, scope), scope.environment)


@dataclass(frozen=True)
class FindPackageShare(Substitution):
    """The folder of an installed package with its modules and data.

    Attributes:
        package: The package's name.
    """

    package: Text

    def perform(self, scope: Scope) -> str:
        return scope.library.share(resolve(self.package, scope))


@dataclass(frozen=True)
class FindPackagePrefix(Substitution):
    """The folder of the environment that a package is installed in, such as /usr or a virtual environment.

    Attributes:
        package: The package's name.
    """

    package: Text

    def perform(self, scope: Scope) -> str:
        return scope.library.prefix(resolve(self.package, scope))


@dataclass(frozen=True)
class ExecutableInPackage(Substitution):
    """The path of a program that was installed with a package.

    Attributes:
        executable: The program's name.
        package: The package's name.
    """

    executable: Text
    package: Text

    def perform(self, scope: Scope) -> str:
        package, executable = resolve(self.package, scope), resolve(self.executable, scope)
        return scope.library.installed_program(package, executable)


@dataclass(frozen=True)
class FileContent(Substitution):
    """The content of a text file.

    Attributes:
        path: The file; a relative path starts at the folder of the launch file.
    """

    path: Text

    def perform(self, scope: Scope) -> str:
        return scope.library.text(str(PurePath(scope.folder, resolve(self.path, scope))))


@dataclass(frozen=True)
class LaunchLogDir(Substitution):
    """The folder of the log files of this launch, which is created if it does not exist yet."""

    def perform(self, scope: Scope) -> str:
        return scope.library.log_folder()


@dataclass(frozen=True)
class Parameter(Substitution):
    """The value of a parameter that `SetParameter` has set for all nodes.

    Attributes:
        name: The parameter.
        default: Its value if it is not set; None: that is an error.
    """

    name: Text
    default: Text | None = None

    def perform(self, scope: Scope) -> str:
        name = resolve(self.name, scope)
        if name not in scope.parameters:
            if self.default is None:
                raise LaunchError(f"No parameter '{escape(name)}' has been set for all nodes")
            return resolve(self.default, scope)
        text = scope.parameters[name]
        value = load_yaml(text, rules=rcl_scalar)
        # As ROS 2 writes them: truth values are Python's, for a PythonExpression.
        return str(value) if isinstance(value, str | bool) else text


@dataclass(frozen=True)
class AnonName(Substitution):
    """A unique name that begins with another, for a node that is started more than once.

    Attributes:
        name: The beginning. The same beginning gives the same name everywhere in a launch.
    """

    name: Text

    def perform(self, scope: Scope) -> str:
        name = resolve(self.name, scope)
        if name not in scope.anonymous:
            scope.anonymous[name] = f"{name}_{scope.library.unique()}"
        return scope.anonymous[name]
