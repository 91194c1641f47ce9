"""The library of this machine: launch files, packages, scripts, node factories, programs."""

from __future__ import annotations

import importlib
import os
import re
import secrets
import shutil
import sys
import threading
import weakref
from functools import lru_cache
from pathlib import Path
from tempfile import mkdtemp
from types import ModuleType
from typing import TYPE_CHECKING, Any, Final

from actors.config import environment
from actors.errors import error_text
from actors.launch.description.description import LaunchDescription
from actors.launch.description.description_source import LaunchLibrary
from actors.launch.errors import LaunchError, LaunchFileError, NoLaunchFileError
from actors.launch.output.log_folder import LogFolder
from actors.launch.planning.error_location import line_in
from actors.launch.resources.command_output import command_output
from actors.parameters.errors import InvalidParameterFileError
from actors.parameters.overrides import load_parameter_file
from actors.regular_files import read_regular
from actors.tools.executables import find_package
from actors.tools.prefixes import is_python_program
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from actors.runtime.programs import Factory
    from actors.tools.executables import Executable, Package

FUNCTION: Final = "generate_launch_description"
DOCUMENT_SUFFIXES: Final = (".yaml", ".yml", ".toml", ".xml", ".launch")
SUFFIXES: Final = (".py", *DOCUMENT_SUFFIXES)
"""Of launch files."""
MAX_REMEMBERED: Final = 1024
"""Size of the caches of packages and programs."""
MAX_FILE_BYTES: Final = 1 << 20
"""Limit of launch files and text files; a larger one is taken for an error."""

_FACTORY_FORM: Final = "write it as node='package.module:Class'"
_PYTHON: Final = re.compile(r"python(3(\.\d+)?)?")
_ROS_2: Final = frozenset({"launch", "launch_ros", "launch_xml", "launch_yaml"})
"""Packages that launch files import in ROS 2."""


class Files(LaunchLibrary):
    """The library of this machine: its files, and the packages that are installed here.

    Args:
        runner: A command that runs a SCRIPT, or PACKAGE EXECUTABLE, in place of Python itself.
        run_command: What users type for the same.

    Attributes:
        launch_files: The paths of launch files that have been read.
    """

    def __init__(
        self, *, runner: Sequence[str] = (), run_command: Sequence[str] = ("callboard", "run")
    ) -> None:
        self._runner = tuple(runner)
        self._run_command = tuple(run_command)
        self.launch_files: list[str] = []
        # Functions of the description, and the log files, use this in threads.
        self._lock = threading.Lock()
        self._temporary: str | None = None
        self._log_folder: LogFolder | None = None
        # A launch may have the same program a thousand times, and each look-up of a package reads files.
        self._package = lru_cache(MAX_REMEMBERED)(_package)
        self._command = lru_cache(MAX_REMEMBERED)(self._find_command)
        self._modules = lru_cache(MAX_REMEMBERED)(self._find_modules)

    @property
    def run_command(self) -> Sequence[str]:
        return self._run_command

    def description(self, path: str) -> LaunchDescription:
        if path not in self.launch_files:
            self.launch_files.append(path)
        suffix = Path(path).suffix
        if suffix in DOCUMENT_SUFFIXES:
            from actors.launch.documents.reading import read_document  # noqa: PLC0415 - Python files need none

            return read_document(path, self._launch_file(path))
        if suffix != ".py":
            raise NoLaunchFileError(f"{path}: a launch file's name ends with one of {', '.join(SUFFIXES)}")
        function = getattr(_run(path, self._launch_file(path)), FUNCTION, None)
        if not callable(function):
            raise LaunchFileError(f"{path} has no function {FUNCTION}()")
        try:
            description = function()
        except (Exception, SystemExit) as error:
            raise _failed(path, error) from error
        if not isinstance(description, LaunchDescription):
            raise LaunchFileError(
                f"{path}: {FUNCTION}() must return a LaunchDescription, not {description!r}"
            )
        return LaunchDescription(description.actions, file=path)

    def factory(self, name: str) -> Factory:
        module_name, separator, attribute = name.partition(":")
        if not separator or not attribute or not all(map(str.isidentifier, module_name.split("."))):
            raise LaunchError(f"'{escape(name)}' is not the name of a node: {_FACTORY_FORM}")
        try:
            found: Any = importlib.import_module(module_name)
        except Exception as error:
            text = f"{type(error).__name__}: {error_text(error)}"
            raise LaunchError(f"Module '{module_name}' cannot be imported: {escape(text)}") from error
        for part in attribute.split("."):
            found = getattr(found, part, None)
            if found is None:
                raise LaunchError(f"Module '{module_name}' has no '{escape(attribute)}'")
        if not callable(found):
            raise LaunchError(f"{escape(name)} is neither a class nor a function, but {escape(repr(found))}")
        return found  # type: ignore[no-any-return]

    def program(self, package: str, executable: str) -> Sequence[str]:
        code = self._command(package, executable)  # also with a runner: the package must have the program
        if self._runner:
            return (*self._runner, package, executable)
        # -P: a module in the working folder must not replace one of the package.
        return (sys.executable, "-u", "-P", "-c", code)

    def python_program(self, command: Sequence[str]) -> Sequence[str]:
        if not self._runner:
            return command
        words = list(command)
        if _PYTHON.fullmatch(Path(words[0]).name):
            words = words[2:] if words[1:2] == ["-u"] else words[1:]
            runs = bool(words) and words[0].endswith(".py")
        else:
            runs = is_python_program(Path(words[0]))
        return (*self._runner, *words) if runs else command

    def prefix(self, package: str) -> str:
        return str(self._package(package).prefix())

    def installed_program(self, package: str, executable: str) -> str:
        path = self._program(package, executable).path
        if path is None:
            raise LaunchError(f"Program '{executable}' of package '{package}' has no file")
        return str(path)

    def script(self, path: str) -> Sequence[str]:
        if not Path(path).is_file():
            raise LaunchError(f"No script '{path}'")
        return (*(self._runner or (sys.executable, "-u")), path)

    def parameter_file(self, path: str) -> str:
        if not Path(path).is_file():
            raise LaunchError(f"No parameter file '{escape(path)}'")
        try:
            # Each node reads it again. Here an error ends the launch before anything has been started.
            load_parameter_file(path)
        except InvalidParameterFileError as error:
            raise LaunchError(f"Parameter file '{escape(path)}': {error.reason}") from None
        return path

    def sources(self, *, package: str | None = None, script: str | None = None) -> Sequence[str]:
        modules = () if package is None else self._modules(package)
        folder = () if script is None else (Path(script).resolve().parent,)
        return tuple(str(each) for each in (*modules, *folder))

    def share(self, package: str) -> str:
        folder = self._package(package).share()
        if folder is None:
            raise LaunchError(f"Package '{escape(package)}' has no folder")
        return str(folder)

    def executable(self, name: str, environment: Mapping[str, str]) -> str:
        found = shutil.which(name, path=environment.get("PATH", os.defpath))
        if found is None:
            raise LaunchError(f"No program '{escape(name)}'")
        return found

    def output_of(self, command: Sequence[str], environment: Mapping[str, str]) -> str:
        if not command:
            raise LaunchError("An empty string is not a command")
        program = self.executable(command[0], environment)
        return command_output((program, *command[1:]), environment)

    def text(self, path: str) -> str:
        try:
            return _content(_read, path, "file", LaunchError, LaunchError).decode()
        except UnicodeDecodeError:
            raise LaunchError(f"{escape(path)} is not UTF-8") from None

    def temporary_file(self, name: str, text: str) -> str:
        with self._lock:
            if self._temporary is None:
                self._temporary = mkdtemp(prefix="callboard-launch-")
                # Nodes that are restarted read the files again, so they are removed with this object.
                weakref.finalize(self, shutil.rmtree, self._temporary, ignore_errors=True)
            # A folder for each: two includes may substitute the same file differently.
            path = Path(mkdtemp(dir=self._temporary), name)
            path.write_text(text, encoding="utf-8")
        return str(path)

    def open_log_folder(self) -> LogFolder:
        """Return the log folder of this launch, which is created by the first call, in any thread.

        Raises:
            OSError: It cannot be created.
        """
        with self._lock:
            if self._log_folder is None:
                self._log_folder = LogFolder(Path(environment.state_folder(), "log"))
            return self._log_folder

    def log_folder(self) -> str:
        try:
            return str(self.open_log_folder().path)
        except OSError as error:
            raise LaunchError(f"The folder for log files cannot be created: {error}") from None

    def unique(self) -> str:
        return f"{os.getpid()}_{secrets.token_hex(4)}"

    def _launch_file(self, path: str) -> bytes:
        # The first is the user's. Those that it includes are found, for example in a package.
        read = _read if path == self.launch_files[0] else read_regular
        return _content(read, path, "launch file", NoLaunchFileError, LaunchFileError)

    def _find_modules(self, package: str) -> Sequence[Path]:
        return self._package(package).modules()

    def _find_command(self, package: str, executable: str) -> str:
        return self._program(package, executable).command()

    def _program(self, package: str, executable: str) -> Executable:
        found = self._package(package)
        program = found.executable(executable)
        if program is None:
            listed = ", ".join(each.name for each in found.executables())
            raise LaunchError(
                f"No program '{executable}' in package '{package}'; there is: {listed or 'none'}"
            )
        return program


def _package(name: str) -> Package:
    found = find_package(name)
    if found is None:
        raise LaunchError(f"No installed package '{escape(name)}'")
    return found


def _read(path: str, most: int) -> bytes:
    with Path(path).open("rb") as file:
        return file.read(most)


def _content(
    read: Callable[[str, int], bytes],
    path: str,
    what: str,
    missing: type[LaunchError],
    too_large: type[LaunchError],
) -> bytes:
    """Return the content of a file, or raise one of two errors."""
    try:
        content = read(path, MAX_FILE_BYTES + 1)
    except (OSError, ValueError) as error:
        raise missing(f"No {what} '{escape(path)}': {getattr(error, 'strerror', error)}") from None
    if len(content) > MAX_FILE_BYTES:
        raise too_large(f"{escape(path)} is larger than {MAX_FILE_BYTES} bytes")
    return content


def _run(path: str, source: bytes) -> ModuleType:
    """Run a launch file as a module. Python's own import would leave a folder with bytecode behind."""
    module = ModuleType(f"callboard launch file {path}")
    module.__file__ = path
    # Dataclasses with postponed annotations look their module up.
    sys.modules[module.__name__] = module
    try:
        exec(compile(source, path, "exec"), vars(module))  # noqa: S102 - running it is its purpose
    except (Exception, SystemExit) as error:
        raise _failed(path, error) from error
    return module


def _failed(path: str, error: BaseException) -> LaunchFileError:
    """Return an exception of a launch file as an error with its line."""
    if isinstance(error, LaunchFileError):
        return error  # of a file that this one has read; its text has the line already
    line = line_in(path, error)
    where = f"{path}, line {line}" if line else path
    text = error.msg if isinstance(error, SyntaxError) else error_text(error)
    if isinstance(error, ImportError) and (error.name or "").partition(".")[0] in _ROS_2:
        text += "; here it is: from actors.launch import Node, LaunchDescription, … (or launch it with --ros)"
    elif isinstance(error, ImportError) and (error.name or "").startswith("actors.launch."):
        text += "; all names of launch files are in actors.launch"
    kind = "" if isinstance(error, LaunchError) else f"{type(error).__name__}: "
    return LaunchFileError(f"{where}: {kind}{text}")
