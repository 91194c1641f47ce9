"""Substitutions that ask the library: files, packages, programs, and names that nobody else has."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import PurePath
from typing import TYPE_CHECKING

from actors.launch.description.substitutions import Substitution, resolve
from actors.launch.errors import LaunchError
from proto.errors import escape

if TYPE_CHECKING:
    from actors.launch.description.substitutions import Scope, Text


@dataclass(frozen=True)
class Command(Substitution):
    """What a command writes to stdout, without the line ends at its end.

    It is run when the description is planned, without a shell. What it writes to stderr is shown only if it
    fails.

    Attributes:
        command: The command, as it would be typed: split at spaces, as a shell does it, so that a path with a
            space in it needs quotes: ["xacro '", path, "'"].
    """

    command: Text

    def perform(self, scope: Scope) -> str:
        text = resolve(self.command, scope)
        try:
            words = shlex.split(text)
        except ValueError as error:
            raise LaunchError(f"'{escape(text)}' is no command: {error}") from None
        return scope.library.output_of(words, scope.environment).rstrip("\r\n")


@dataclass(frozen=True)
class FindExecutable(Substitution):
    """The path of a program, found along PATH as it is there.

    Attributes:
        name: The program's name.
    """

    name: Text

    def perform(self, scope: Scope) -> str:
        return scope.library.executable(resolve(self.name, scope), scope.environment)


@dataclass(frozen=True)
class FindPackageShare(Substitution):
    """The folder of an installed package, which has its modules and data in it.

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
    """What a text file holds.

    Attributes:
        path: The file; a relative path is seen from the launch file's folder.
    """

    path: Text

    def perform(self, scope: Scope) -> str:
        return scope.library.text(str(PurePath(scope.folder, resolve(self.path, scope))))


@dataclass(frozen=True)
class AnonName(Substitution):
    """A name that nobody else has, for a node that is started more than once: "NAME_…".

    Attributes:
        name: What it begins with. The same name gives the same one everywhere in a launch.
    """

    name: Text

    def perform(self, scope: Scope) -> str:
        name = resolve(self.name, scope)
        if name not in scope.anonymous:
            scope.anonymous[name] = f"{name}_{scope.library.unique()}"
        return scope.anonymous[name]
