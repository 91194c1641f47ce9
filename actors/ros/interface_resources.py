"""callboard's interface packages as ROS 2 has them installed: folders with texts, and an index.

    ~/.cache/callboard/interfaces/DIGEST/share/std_msgs/msg/String.msg

`ament_index_python` finds the folder. It is written when a process first needs it, in half a second, and read
by all others: the texts are those of `callboard interface show`.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
from contextlib import suppress
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Final

from actors.config.environment import cache_folder
from actors.interfaces import catalog
from actors.tools.definitions import local_text
from actors.tools.prefixes import INDEX, PACKAGES

INTERFACES: Final = "rosidl_interfaces"
"""The type of resource that lists a package's interfaces: a line such as "msg/String.msg" for each."""
MAX_FOLDERS: Final = 3
"""How many folders are kept, the newest: each version of callboard has its own, of half a megabyte."""


def interface_prefix() -> Path:
    """Return the folder that callboard's interface packages are installed in.

    It is in the cache, or, where that cannot be written to, a temporary one of this process.

    Raises:
        OSError: Neither can be written to.
    """
    return _prefix(Path(cache_folder(), "interfaces"))


@cache
def _prefix(parent: Path) -> Path:
    folder = parent / _digest()
    if folder.is_dir():
        return folder
    try:
        parent.mkdir(parents=True, exist_ok=True)
        written = Path(mkdtemp(prefix=".", dir=parent))
    except OSError:
        return _temporary()
    try:
        _write(written)
        os.replace(written, folder)  # noqa: PTH105 - never a folder that is only half written
    except OSError:
        shutil.rmtree(written, ignore_errors=True)
        if not folder.is_dir():  # no other process has written it: the disk is full, for instance
            return _temporary()
    _remove_old(parent)
    return folder


def _temporary() -> Path:
    written = Path(mkdtemp(prefix="callboard-interfaces-"))
    atexit.register(shutil.rmtree, written, ignore_errors=True)
    _write(written)
    return written


def _digest() -> str:
    """Return a name that changes with the interfaces: from the sizes and times of their files."""
    root = Path(catalog.__file__).parent
    stats = ((each.relative_to(root).as_posix(), each.stat()) for each in sorted(root.glob("*/*/*.py")))
    text = "\n".join(f"{name} {stat.st_size} {stat.st_mtime_ns}" for name, stat in stats)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _write(prefix: Path) -> None:
    packages, interfaces = prefix / INDEX / PACKAGES, prefix / INDEX / INTERFACES
    packages.mkdir(parents=True)
    interfaces.mkdir()
    for package in catalog.standard_packages():
        files: list[str] = []
        for name in catalog.interfaces_of(package):
            file = prefix / "share" / f"{name}.{name.split('/')[1]}"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(local_text(name, comments=True) or "", encoding="utf-8")
            files.append(file.relative_to(prefix / "share" / package).as_posix())
        (packages / package).touch()
        (interfaces / package).write_text("\n".join(files), encoding="utf-8")


def _remove_old(parent: Path) -> None:
    """Remove all folders but the newest; one that another process still writes is among these."""
    folders: list[tuple[float, Path]] = []
    for each in parent.iterdir():
        with suppress(FileNotFoundError):  # another process has renamed or removed it
            folders.append((each.stat().st_mtime, each))
    for _, each in sorted(folders)[:-MAX_FOLDERS]:
        shutil.rmtree(each, ignore_errors=True)
