"""Installed packages and their programs.

A package is an installed distribution, an editable one included; its executables are its console scripts.

    from actors.tools.executables import find_package, packages

    for package in packages():
        if package.uses_callboard:
            print(package.name, [each.name for each in package.executables()])

    talker = find_package("my-package").executable("talker")  # `my_package` is the same package

No package is imported: all of this is read from metadata.
"""

from __future__ import annotations

import re
import sysconfig
from importlib.metadata import Distribution, PackageNotFoundError, distribution, distributions
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterator
    from importlib.machinery import ModuleSpec

_SELF: Final = "callboard"
_PROJECT: Final = re.compile(r"[A-Za-z0-9._-]+")
_OF_AN_EXTRA: Final = re.compile(r"\bextra\s*==")
_SITES: Final = ("site-packages", "dist-packages")


class Executable(NamedTuple):
    """A program of a package.

    Attributes:
        package: The package's name.
        name: The program's name.
        module: The module of its function.
        function: The function's path in the module: "main", or "Talker.main".
        path: The file that the installer wrote for it; None if there is none.
    """

    package: str
    name: str
    module: str
    function: str
    path: Path | None

    def command(self) -> str:
        """Return the code with which `python -c` runs the program."""
        top = self.function.partition(".")[0]
        return (
            f"import sys; from {self.module} import {top}; "
            f"sys.argv[0] = {self.name!r}; sys.exit({self.function}())"
        )


class Package:
    """An installed package.

    Args:
        installed: Its distribution.
        name: Its name, as in its metadata.

    Attributes:
        name: As given.
    """

    def __init__(self, installed: Distribution, name: str) -> None:
        self.name = name
        self._installed = installed

    @property
    def version(self) -> str:
        """Its version."""
        return self._installed.version

    @property
    def uses_callboard(self) -> bool:
        """Whether it depends on callboard, not only for one of its extras."""
        return any(
            (project := _PROJECT.match(each)) is not None
            and normalized(project[0]) == _SELF
            and not _OF_AN_EXTRA.search(each)
            for each in self._installed.requires or ()
        )

    def executables(self) -> list[Executable]:
        """Return its programs, sorted by name."""
        scripts = {each.name: each for each in self._installed.entry_points.select(group="console_scripts")}
        return [
            Executable(self.name, name, scripts[name].module, scripts[name].attr, self._script(name))
            for name in sorted(scripts)
        ]

    def executable(self, name: str) -> Executable | None:
        """Return one of its programs; None if it has none of this name.

        Args:
            name: The program's name.
        """
        return next((each for each in self.executables() if each.name == name), None)

    def prefix(self) -> Path:
        """Return the environment that it is installed in, such as /usr or a virtual environment."""
        site = self._locate("")
        if site.name in _SITES:
            for folder in site.parents:
                if folder.name.lower() in ("lib", "lib64"):
                    return folder.parent
        return site

    def share(self) -> Path | None:
        """Return the folder with its modules and data, such as `launch`; None if it has none."""
        return next((folder for module in self._modules() for folder in _folders(module)), None)

    def modules(self) -> list[Path]:
        """Return the folders and files of its modules, also of an editable installation."""
        found: dict[Path, None] = {}
        for module in self._modules():
            found.update(dict.fromkeys(_folders(module) or _file(module)))
        return list(found)

    def _modules(self) -> Iterator[ModuleSpec]:
        """Yield its top-level modules: that of its name, those it lists, and those of its programs."""
        listed = (self._installed.read_text("top_level.txt") or "").split()
        programs = (each.module.partition(".")[0] for each in self.executables())
        for name in dict.fromkeys((normalized(self.name).replace("-", "_"), *listed, *programs)):
            spec = find_spec(name)
            if spec is not None:
                yield spec

    def _script(self, name: str) -> Path | None:
        names = (name, f"{name}.exe")
        for file in self._installed.files or ():
            if file.name in names and file.parent.name in ("bin", "Scripts"):
                return self._locate(str(file))
        usual = (Path(sysconfig.get_path("scripts")) / each for each in names)
        return next((path for path in usual if path.is_file()), None)

    def _locate(self, path: str) -> Path:
        return Path(str(self._installed.locate_file(path))).resolve()


def packages() -> list[Package]:
    """Return all installed packages, sorted by name; of two with one name, the one that Python imports."""
    found: dict[str, Package] = {}
    for package in _each():
        found.setdefault(normalized(package.name), package)
    return [found[name] for name in sorted(found)]


def find_package(name: str) -> Package | None:
    """Return an installed package; None if there is none of this name.

    Args:
        name: In any spelling: `my-package`, `my_package`.
    """
    try:
        found = distribution(name)
    except (PackageNotFoundError, ValueError):
        return None
    return Package(found, _name(found) or name)


def normalized(name: str) -> str:
    """Return the normalised spelling of a package's name (PEP 503).

    Args:
        name: Any spelling.
    """
    return re.sub(r"[-_.]+", "-", name).lower()


def _folders(module: ModuleSpec) -> list[Path]:
    return [Path(each) for each in module.submodule_search_locations or ()]


def _file(module: ModuleSpec) -> list[Path]:
    return [Path(module.origin)] if module.has_location and module.origin else []


def _each() -> Iterator[Package]:
    for each in distributions():
        name = _name(each)
        if name is not None:
            yield Package(each, name)


def _name(installed: Distribution) -> str | None:
    """Return its name; None for a folder without metadata, which an interrupted installation leaves."""
    metadata: Any = installed.metadata
    name: str | None = metadata.get("Name")
    return name
