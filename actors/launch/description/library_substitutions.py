"""Substitutions that use the library, and those with values that a launch has chosen."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import PurePath
from typing import TYPE_CHECKING

from actors.interfaces.yaml_reader import load_yaml
from actors.interfaces.yaml_scalars import rcl_scalar
from actors.launch.description.options import option, required
from actors.launch.description.substitutions import Substitution, resolve, split_command
from actors.launch.errors import LaunchError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from actors.launch.description.substitutions import LaunchContext, Text


@dataclass(frozen=True)
class Command(Substitution):
    """The output of a command on stdout, without the line ends at its end.

    The command is run when the description is planned, without a shell. Its stderr is shown only if it fails.
    """

    command: Text = field(
        metadata=required(
            "The command as users would type it: a shell's rules split it, so that a path with spaces"
            ' needs quotes: ["xacro \'", path, "\'"].'
        )
    )

    def perform(self, context: LaunchContext) -> str:
        text = resolve(self.command, context)
        try:
            words = split_command(text)
        except ValueError as error:
            raise LaunchError(f"'{escape(text)}' is not a command: {error}") from None
        return context.library.output_of(words, context.environment).rstrip("\r\n")


@dataclass(frozen=True)
class FindExecutable(Substitution):
    """The path of a program, found along PATH."""

    name: Text = field(metadata=required("The program's name."))

    def perform(self, context: LaunchContext) -> str:
        return context.library.executable(resolve(self.name, context), context.environment)


@dataclass(frozen=True)
class FindPackageShare(Substitution):
    """The folder of an installed package with its modules and data."""

    package: Text = field(metadata=required("The package's name."))

    def perform(self, context: LaunchContext) -> str:
        return context.library.share(resolve(self.package, context))


@dataclass(frozen=True)
class FindPackagePrefix(Substitution):
    """The folder of the environment that a package is installed in, such as /usr or a virtual environment."""

    package: Text = field(metadata=required("The package's name."))

    def perform(self, context: LaunchContext) -> str:
        return context.library.prefix(resolve(self.package, context))


@dataclass(frozen=True)
class ExecutableInPackage(Substitution):
    """The path of a program that was installed with a package."""

    executable: Text = field(metadata=required("The program's name."))
    package: Text = field(metadata=required("The package's name."))

    def perform(self, context: LaunchContext) -> str:
        package, executable = resolve(self.package, context), resolve(self.executable, context)
        return context.library.installed_program(package, executable)


@dataclass(frozen=True)
class FileContent(Substitution):
    """The content of a text file."""

    path: Text = field(
        metadata=required("The file; a relative path starts at the folder of the launch file.")
    )

    def perform(self, context: LaunchContext) -> str:
        return context.library.text(str(PurePath(context.folder, resolve(self.path, context))))


@dataclass(frozen=True)
class LaunchLogDir(Substitution):
    """The folder of the log files of this launch, which is created if it does not exist yet."""

    def perform(self, context: LaunchContext) -> str:
        return context.library.log_folder()


@dataclass(frozen=True)
class Parameter(Substitution):
    """The value of a parameter that `SetParameter` has set for all nodes."""

    name: Text = field(metadata=required("The parameter."))
    default: Text | None = option(None, "Its value if it is not set; None: that is an error.")

    def perform(self, context: LaunchContext) -> str:
        name = resolve(self.name, context)
        if name not in context.parameters:
            if self.default is None:
                raise LaunchError(f"No parameter '{escape(name)}' has been set for all nodes")
            return resolve(self.default, context)
        text = context.parameters[name]
        value = load_yaml(text, rules=rcl_scalar)
        # As ROS 2 writes them: truth values are Python's, for a PythonExpression.
        return str(value) if isinstance(value, str | bool) else text


@dataclass(frozen=True)
class AnonName(Substitution):
    """A unique name that begins with another, for a node that is started more than once."""

    name: Text = field(
        metadata=required("The beginning. The same beginning gives the same name everywhere in a launch.")
    )

    def perform(self, context: LaunchContext) -> str:
        name = resolve(self.name, context)
        if name not in context.anonymous:
            context.anonymous[name] = f"{name}_{context.library.unique()}"
        return context.anonymous[name]
