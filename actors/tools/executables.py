"""Installed packages and their programs.

A package is an installed distribution, an editable one included, or a package of ROS 2 (`prefixes.py`). Its
executables are its console scripts, and the Python programs in `lib/PACKAGE`.

    from actors.tools.executables import find_package, packages

    for package in packages():
        if package.is_listed:
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

from actors.regular_files import read_regular_text
from actors.tools.prefixes import INDEX, PACKAGES, package_prefix, prefixes, python_programs

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
        module: The module of its function; empty: it is the file.
        function: The function's path in the module: "main", or "Talker.main".
        path: The file that the installer wrote for it, or None.
    """

    package: str
    name: str
    module: str
    function: str
    path: Path | None

    def command(self) -> str:
        """Return the code with which `python -c` runs the program."""
        if not self.module:
            path = str(self.path)
            return f"import runpy, sys; sys.argv[0] = {path!r}; runpy.run_path({path!r}, run_name='__main__')"
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

    @property
    def is_listed(self) -> bool:
        """Whether it is one of the packages that people write for callboard: it uses it, or is of ROS 2."""
        return self.uses_callboard or self.ros_share() is not None

    def executables(self) -> list[Executable]:
        """Return its programs, sorted by name."""
        scripts = {each.name: each for each in self._installed.entry_points.select(group="console_scripts")}
        found = {
            name: Executable(self.name, name, each.module, each.attr, self._script(name))
            for name, each in scripts.items()
        }
        found = {**_programs(self.prefix(), self.name), **found}
        return [found[name] for name in sorted(found)]

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
        """Return the folder with its data, such as `launch`; None if it has none.

        Of a package of ROS 2 it is `share/PACKAGE`, of others the folder with its modules.
        """
        shared = self.ros_share()
        if shared is not None:
            return shared
        return next((folder for module in self._modules() for folder in _folders(module)), None)

    def ros_share(self) -> Path | None:
        """Return `share/PACKAGE` of a package of ROS 2; None if it is another one."""
        folders = (self.prefix(), package_prefix(self.name))
        shares = (each / "share" / self.name for each in folders if each is not None)
        return next((each for each in shares if (each / "package.xml").is_file()), None)

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
        for each in names:  # after pip install --target what is recorded is elsewhere
            target = self.prefix() / "bin" / each
            if target.is_file():
                return target
        for file in self._installed.files or ():
            if file.name in names and file.parent.name in ("bin", "Scripts"):
                return self._locate(str(file))
        usual = (Path(sysconfig.get_path("scripts")) / each for each in names)
        return next((path for path in usual if path.is_file()), None)

    def _locate(self, path: str) -> Path:
        return Path(str(self._installed.locate_file(path))).resolve()


class DataPackage(Package):
    """A package of ROS 2 that is no distribution: data, and programs in `lib/PACKAGE`.

    Args:
        prefix: The folder that it is installed in.
        name: Its name.
    """

    def __init__(self, prefix: Path, name: str) -> None:
        self.name = name
        self._prefix = prefix

    @property
    def version(self) -> str:
        """Its version, as `package.xml` says it; empty if it does not."""
        try:
            text = read_regular_text(self._prefix / "share" / self.name / "package.xml")
        except (OSError, UnicodeDecodeError):
            return ""
        found = re.search(r"<version[^>]*>\s*([^<\s]*)", text)
        return found[1] if found else ""

    @property
    def uses_callboard(self) -> bool:
        """False: its metadata is ROS 2's."""
        return False

    def executables(self) -> list[Executable]:
        """Return its programs, sorted by name."""
        return list(_programs(self._prefix, self.name).values())

    def prefix(self) -> Path:
        """Return the folder that it is installed in."""
        return self._prefix

    def share(self) -> Path | None:
        """Return the folder with its data; None if it has none."""
        return self.ros_share()

    def modules(self) -> list[Path]:
        """Return nothing: it has no modules."""
        return []


def _programs(prefix: Path, package: str) -> dict[str, Executable]:
    found = python_programs(prefix, package)
    return {name: Executable(package, name, "", "", path) for name, path in found.items()}


def packages() -> list[Package]:
    """Return all installed packages, sorted by name; of two with one name, the one that Python imports."""
    found: dict[str, Package] = {}
    for package in _each():
        found.setdefault(normalized(package.name), package)
    for prefix in prefixes():
        index = prefix / INDEX / PACKAGES
        for each in sorted(index.iterdir()) if index.is_dir() else ():
            found.setdefault(normalized(each.name), DataPackage(prefix, each.name))
    return [found[name] for name in sorted(found)]


def find_package(name: str) -> Package | None:
    """Return an installed package; None if no package has this name.

    Args:
        name: In any spelling: `my-package`, `my_package`.
    """
    try:
        found = distribution(name)
    except (PackageNotFoundError, ValueError):
        prefix = package_prefix(name)
        return None if prefix is None else DataPackage(prefix, name)
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
