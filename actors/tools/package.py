"""The files of a new package of nodes, ready to be installed, run, tested and built.

    from pathlib import Path
    from actors.tools.package import NewPackage

    new = NewPackage(
        name="my_robot",
        node_name="talker",
        maintainer_name="Me",
        maintainer_email="me@example.org",
        year=2026,
    )
    new.write(Path("src"))

It is an ordinary Python package: a pyproject.toml, whose scripts `callboard run` runs, and modules.
"""

from __future__ import annotations

import json
import keyword
import re
import sys
from dataclasses import dataclass
from importlib.resources import files
from string import Template
from typing import TYPE_CHECKING, Final

from actors.interfaces.catalog import is_standard
from actors.tools.licenses import license_text, spdx
from actors.tools.maintainer import EMAIL
from proto.errors import CallboardError
from proto.untrusted_text import escape

if TYPE_CHECKING:
    from pathlib import Path

NO_LICENSE: Final = "TODO: License declaration"
NO_DESCRIPTION: Final = "TODO: Package description"
VERSION: Final = "0.0.0"
MAX_NAME_LENGTH: Final = 100
MAX_DEPENDENCY_LENGTH: Final = 1000

_NAME: Final = re.compile(r"[a-z][a-z0-9]*(?:_[a-z0-9]+)*")
_TAKEN: Final = (
    "actors",
    "broker",
    "callboard",
    "msgpack",
    "msgspec",
    "packaging",
    "proto",
    "test",
    "tests",
    "uvloop",
    "yaml",
)
"""Names that would hide callboard, its dependencies, or the package's own tests."""
_ROS: Final = ("ament_index_python", "launch", "launch_ros", "rclpy", "ros2launch")
"""Dependencies of ROS 2 packages that callboard replaces, besides packages of message types."""
_PROGRAMS: Final = ("callboard", "pip", "pytest", "python", "python3")
"""Programs that a program of the same name would replace in the environment."""


class InvalidPackageError(CallboardError, ValueError):
    """An attribute of a new package is invalid; the text says what is valid."""


@dataclass(frozen=True, kw_only=True)
class NewPackage:
    """A new package.

    Attributes:
        name: Lowercase letters, digits and single underscores; the name of the folder, of the distribution
            and of the Python package in it.
        node_name: The name of a first node and its program; None for no node.
        description: One line.
        license_name: An SPDX identifier, or a custom name; `NO_LICENSE` for none.
        maintainer_name: The maintainer's name.
        maintainer_email: The maintainer's email address.
        dependencies: Requirements that pip installs with it, besides callboard, such as "numpy>=2".
        year: The first year of the copyright.

    Raises:
        InvalidPackageError: An attribute is invalid.
    """

    name: str
    node_name: str | None = None
    description: str = NO_DESCRIPTION
    license_name: str = NO_LICENSE
    maintainer_name: str
    maintainer_email: str
    dependencies: tuple[str, ...] = ()
    year: int

    def __post_init__(self) -> None:
        _check_package_name(self.name)
        if self.node_name is not None:
            _check_node_name(self.node_name)
        for what in ("description", "license_name", "maintainer_name", "maintainer_email"):
            text: str = getattr(self, what)
            if not text.isprintable() or not text.strip():
                spoken = what.replace("_", " ")
                raise InvalidPackageError(
                    f"Invalid {spoken} '{escape(text)}': write a line of printable text"
                )
        if not EMAIL.fullmatch(self.maintainer_email):
            raise InvalidPackageError(
                f"Invalid email address '{self.maintainer_email}': write one such as me@example.org"
            )
        for each in self.dependencies:
            _check_dependency(each)

    def license_text(self) -> str | None:
        """Return the text of its licence; None if callboard does not have it."""
        return license_text(self.license_name, holder=self.maintainer_name, year=self.year)

    def files(self) -> dict[str, str]:
        """Return the files: their texts by path in the package's folder, such as "my_robot/talker.py"."""
        made = {
            "pyproject.toml": self._fill("pyproject.toml"),
            "README.md": self._fill("README.md"),
            ".gitignore": self._fill("gitignore"),
        }
        text = self.license_text()
        if text is not None:
            made["LICENSE"] = text
        made[f"{self.name}/__init__.py"] = self._fill("init.py")
        if self.node_name is not None:
            made[f"{self.name}/{self.node_name}.py"] = self._fill("node.py")
        made[f"{self.name}/launch/README.md"] = self._fill("launch.md")
        if self.node_name is None:
            made[f"tests/test_{self.name}.py"] = self._fill("test_package.py")
        else:
            made[f"tests/test_{self.node_name}.py"] = self._fill("test_node.py")
        return made

    def write(self, parent: Path) -> list[str]:
        """Write the package into a new folder of its name.

        Args:
            parent: The folder to write to; it is created if necessary.

        Returns:
            The new folders and files, in order, as paths in `parent`. Paths of folders end with "/".

        Raises:
            FileExistsError: A file or folder of this name exists already. Nothing was written.
            OSError: Writing failed.
        """
        parent.mkdir(parents=True, exist_ok=True)
        (parent / self.name).mkdir()
        written = [f"{self.name}/"]
        for path, text in self.files().items():
            where = f"{self.name}/{path}"
            folder = f"{where.rpartition('/')[0]}/"
            if folder not in written:
                (parent / folder).mkdir()
                written.append(folder)
            (parent / where).write_text(text, encoding="utf-8")
            written.append(where)
        return written

    def _fill(self, template: str) -> str:
        source = files("actors.tools") / "templates" / "package" / f"{template}.txt"
        return Template(source.read_text(encoding="utf-8")).substitute(self._words())

    def _words(self) -> dict[str, str]:
        """Return the values of the names in the templates."""
        node = self.node_name or "talker"
        script = f'{node} = "{self.name}.{node}:main"'
        dependencies = ["callboard", *(each for each in self.dependencies if each != "callboard")]
        return {
            "package": self.name,
            "node": node,
            "class_name": "".join(word.capitalize() for word in node.split("_")),
            "version": VERSION,
            "text": self.description,
            "description": _toml(self.description),
            "maintainer_name": _toml(self.maintainer_name),
            "maintainer_email": _toml(self.maintainer_email),
            "dependencies": f"[{', '.join(map(_toml, dependencies))}]",
            "license": self._license_line(),
            "script": script if self.node_name else f"# {script}",
            "use": self._use(),
        }

    def _license_line(self) -> str:
        if self.license_name == NO_LICENSE:
            return f'# license = "Apache-2.0"  # {NO_LICENSE}'
        line = f"license = {_toml(spdx(self.license_name))}"
        return line if self.license_text() is None else f'{line}\nlicense-files = ["LICENSE"]'

    def _use(self) -> str:
        if self.node_name is None:
            return "Its programs stand in `pyproject.toml`, under `project.scripts`."
        return (
            "Run its node; `callboard broker` in another terminal is where nodes meet:\n\n"
            f"    callboard run {self.name} {self.node_name}"
        )


def comes_with_callboard(dependency: str) -> bool:
    """Return whether a dependency is a ROS 2 package that callboard replaces.

    Args:
        dependency: The package's name.
    """
    return dependency in _ROS or is_standard(dependency)


def suggested_name(name: str) -> str | None:
    """Return a valid package or node name that is similar, or None.

    Args:
        name: An invalid name.
    """
    spaced = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()
    made = re.sub(r"[^a-z0-9]+", "_", spaced).strip("_")
    return made if _NAME.fullmatch(made) else None


def _check_package_name(name: str) -> None:
    _check_name("package name", name)
    if name in _TAKEN or name in sys.stdlib_module_names:
        raise InvalidPackageError(
            f"Aborted since packages can't be named '{name}': it would hide another module of that name. "
            "Please choose a different package name."
        )


def _check_node_name(name: str) -> None:
    _check_name("node name", name)
    if name in _PROGRAMS:
        raise InvalidPackageError(
            f"Aborted since nodes can't be named '{name}': their programs would replace another one. "
            "Please choose a different node name."
        )


def _check_dependency(text: str) -> None:
    from packaging.requirements import InvalidRequirement, Requirement  # noqa: PLC0415 - seldom needed

    try:
        if len(text) > MAX_DEPENDENCY_LENGTH or not text.isprintable():
            raise InvalidRequirement
        Requirement(text)
    except InvalidRequirement:
        raise InvalidPackageError(
            f"Invalid dependency '{escape(text)}': write one such as numpy>=2"
        ) from None


def _check_name(kind: str, name: str) -> None:
    """Check that a name is valid for a module, a distribution and a node."""
    rule = ""
    if not _NAME.fullmatch(name):
        rule = "write lowercase letters, digits and single underscores, a letter first"
    elif len(name) > MAX_NAME_LENGTH:
        rule = f"write at most {MAX_NAME_LENGTH} characters"
    elif keyword.iskeyword(name):
        rule = "it is a word of Python's own"
    if rule:
        suggestion = suggested_name(name)
        hint = f"; did you mean '{suggestion}'?" if suggestion not in (None, name) else ""
        raise InvalidPackageError(f"Invalid {kind} '{escape(name)}': {rule}{hint}")


def _toml(text: str) -> str:
    """Return printable text as a TOML string, which is the same as in JSON."""
    return json.dumps(text, ensure_ascii=False)
