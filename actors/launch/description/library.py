"""What a description may ask of the machine, as an interface. `resources.files` implements it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from actors.runtime.programs import Factory


class Library(Protocol):
    """Files, packages and programs.

    Each method raises a LaunchError that says what is missing, or why it cannot be used.
    """

    @property
    def run_command(self) -> Sequence[str]:
        """What users type before a script, or a package and a program, to run it as the launch does."""
        ...

    def program(self, package: str, executable: str) -> Sequence[str]:
        """Return the command for a console script or program of an installed package."""
        ...

    def python_program(self, command: Sequence[str]) -> Sequence[str]:
        """Return a command; if it runs a Python file and the library has a runner, the runner runs it."""
        ...

    def prefix(self, package: str) -> str:
        """Return the folder of the environment that a package is installed in."""
        ...

    def installed_program(self, package: str, executable: str) -> str:
        """Return the path of a program that was installed with a package."""
        ...

    def script(self, path: str) -> Sequence[str]:
        """Return the command for a Python file."""
        ...

    def parameter_file(self, path: str) -> str:
        """Return the path of a YAML file of parameters that a node can read."""
        ...

    def factory(self, name: str) -> Factory:
        """Return the class or function with a name such as "package.module:Class".

        Its module is imported from Python's search path.
        """
        ...

    def sources(self, *, package: str | None = None, script: str | None = None) -> Sequence[str]:
        """Return the folders and files with a package's modules, or the folder of a script, for `--watch`."""
        ...

    def share(self, package: str) -> str:
        """Return the folder of a package's modules and data."""
        ...

    def executable(self, name: str, environment: Mapping[str, str]) -> str:
        """Return the path of a program that is found along the environment's PATH."""
        ...

    def output_of(self, command: Sequence[str], environment: Mapping[str, str]) -> str:
        """Run a command to its end and return its stdout. This blocks, within a limit."""
        ...

    def text(self, path: str) -> str:
        """Return the content of a UTF-8 file, within a limit of size."""
        ...

    def temporary_file(self, name: str, text: str) -> str:
        """Return the path of a new file with this name and text, which exists until the launch has ended."""
        ...

    def log_folder(self) -> str:
        """Return the folder of the log files of this launch, which is created if necessary."""
        ...

    def unique(self) -> str:
        """Return a unique word of letters, digits and underscores."""
        ...
