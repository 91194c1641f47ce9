"""The packages of the checkouts: where they are, and an installation of them in a temporary folder."""

from __future__ import annotations

import shutil
import subprocess
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

BUILD_TIMEOUT_SEC = 600
GIT_TIMEOUT_SEC = 60


class Packages:
    """Packages in checkouts, which are neither changed nor written to.

    Args:
        folder: The folder with the checkouts, or one of them.
        work: An empty folder for copies and the installation.

    Attributes:
        site: Where they are installed.
    """

    def __init__(self, folder: Path, work: Path) -> None:
        self._folder = folder.resolve()
        self._work = work
        self.site = work / "site"
        found = (each.parent for each in self._folder.rglob("setup.py"))
        self._found = {name: each for each in found if (name := self._name(each))}

    @staticmethod
    def _name(folder: Path) -> str:
        """Return the name of the import package in a folder; "" if there is none."""
        inside = [each.parent.name for each in folder.glob("*/__init__.py") if each.parent.name != "test"]
        return inside[0] if len(inside) == 1 else ""

    def install(self, names: set[str]) -> set[str]:
        """Install packages with pip, without their dependencies; return those that are not there.

        Raises:
            SystemExit: pip has failed.
        """
        copies: list[str] = []
        for name in sorted(names & self._found.keys()):
            copy = self._work / "source" / name
            shutil.copytree(self._found[name], copy)  # building writes there
            copies.append(str(copy))
        if copies:
            self._pip("--no-index", "--no-deps", "--no-build-isolation", *copies)
        return names - self._found.keys()

    def install_requirements(self, requirements: tuple[str, ...]) -> None:
        """Install what the packages need and ROS 2 does not have, from the package index.

        Raises:
            SystemExit: pip has failed.
        """
        self._pip(*requirements)

    def copy(self, package: str) -> None:
        """Copy a Python package that only CMake could install; do nothing if there is none."""
        found = next((each.parent for each in self._folder.rglob(f"{package}/__init__.py")), None)
        if found is not None:
            shutil.copytree(found, self.site / package)

    def has(self, name: str) -> bool:
        """Return whether a package is there."""
        return name in self._found

    def _pip(self, *arguments: str) -> None:
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        done = subprocess.run(
            [*pip, "--target", str(self.site), *arguments],
            capture_output=True,
            text=True,
            check=False,
            timeout=BUILD_TIMEOUT_SEC,
        )
        if done.returncode:
            raise SystemExit(f"pip cannot install the packages:\n{done.stdout}{done.stderr}")

    def collection(self, package: str) -> str:
        """Return the name of the checkout that a package is in."""
        return self._checkout(self._found[package]).name

    def collections(self) -> list[tuple[str, str]]:
        """Return the names and commits of the checkouts."""
        checkouts = {self._checkout(each) for each in self._found.values()}
        return sorted((each.name, _commit(each)) for each in checkouts)

    def _checkout(self, package: Path) -> Path:
        """Return the folder with `.git` above a package; without one, the part of the folder that has it."""
        for parent in package.parents:
            if (parent / ".git").exists():
                return parent
        return self._folder / package.relative_to(self._folder).parts[0]


def _commit(folder: Path) -> str:
    command = ["git", "-C", str(folder), "rev-parse", "--short=12", "HEAD"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=GIT_TIMEOUT_SEC)
    return done.stdout.strip() or "?"
