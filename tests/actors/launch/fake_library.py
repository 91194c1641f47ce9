"""A library that is made up, and scopes that have it: nothing is read or started."""

from __future__ import annotations

from itertools import count
from typing import TYPE_CHECKING, Any

from actors.launch.description.substitutions import LaunchContext
from actors.launch.errors import LaunchError, NoLaunchFileError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from actors.launch.description.description import LaunchDescription
    from actors.runtime.programs import Factory


class FakeLibrary:
    """Files and programs by name. Launch files are in /files; of a path in it, "/" is "_" in the name."""

    def __init__(self, **files: LaunchDescription) -> None:
        self._files = files
        self._numbers = count(1)
        self.temporary_files: dict[str, str] = {}

    @property
    def run_command(self) -> Sequence[str]:
        return ("callboard", "run")

    def description(self, path: str) -> LaunchDescription:
        name = path.removeprefix("/files/").replace("/", "_")
        if name not in self._files:
            raise NoLaunchFileError(f"No launch file '{path}'")
        return self._files[name]

    def program(self, package: str, executable: str) -> Sequence[str]:
        return (f"{package}:{executable}",)

    def python_program(self, command: Sequence[str]) -> Sequence[str]:
        return command

    def prefix(self, package: str) -> str:
        return f"/prefix/{package}"

    def installed_program(self, package: str, executable: str) -> str:
        return f"/prefix/lib/{package}/{executable}"

    def script(self, path: str) -> Sequence[str]:
        return ("python", path)

    def parameter_file(self, path: str) -> str:
        if path.endswith("missing.yaml"):
            raise LaunchError(f"No parameter file '{path}'")
        return path

    def factory(self, name: str) -> Factory:
        raise LaunchError(f"No node class '{name}'")

    def sources(self, *, package: str | None = None, script: str | None = None) -> Sequence[str]:
        return (f"/sources/{package or script}",)

    def share(self, package: str) -> str:
        return f"/share/{package}"

    def executable(self, name: str, environment: Mapping[str, str]) -> str:
        if name not in environment.get("PATH", "").split(":"):
            raise LaunchError(f"No program '{name}'")
        return f"/bin/{name}"

    def output_of(self, command: Sequence[str], environment: Mapping[str, str]) -> str:
        return f"{' '.join(command)} said"

    def text(self, path: str) -> str:
        return f"text of {path}"

    def temporary_file(self, name: str, text: str) -> str:
        self.temporary_files[name] = text
        return f"/temporary/{name}"

    def log_folder(self) -> str:
        return "/log/of/this/launch"

    def unique(self) -> str:
        return f"unique_{next(self._numbers)}"


def scope(**options: Any) -> LaunchContext:
    """Return a scope with an empty shelf."""
    return LaunchContext(library=FakeLibrary(), **options)
