"""Sources: which processes a changed file belongs to."""

from __future__ import annotations

import os
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from actors.launch.planning.process_spec import ProcessSpec

SUFFIXES: Final = frozenset({".py", ".toml", ".yaml", ".yml"})
"""Suffixes of watched files in folders. A file that is a source itself is watched in any case."""
IGNORED_FOLDERS: Final = frozenset({"__pycache__", "node_modules", "site-packages", "venv"})
"""Folders that are not watched, beside those that begin with a dot."""
MAX_FOLDERS: Final = 1000
"""Limit of watched folders, each of which costs kernel memory."""


class Sources:
    """The source files of processes. All paths are real paths, without symbolic links.

    Args:
        launch_files: Files that describe the launch, and belong to no process. More may be added later.
    """

    def __init__(self, launch_files: Collection[str] = ()) -> None:
        self._launch_files = launch_files
        self._processes: dict[str, _Process] = {}

    def add(self, spec: ProcessSpec) -> bool:
        """Add a process; return whether it is new and has sources."""
        # Each restart reports the same process as started again.
        if spec.label in self._processes or not spec.sources:
            return False
        self._processes[spec.label] = _Process(spec)
        return True

    def forget(self, spec: ProcessSpec) -> None:
        """Remove a process."""
        self._processes.pop(spec.label, None)

    def is_launch_file(self, path: str) -> bool:
        """Return whether a real path is a launch file."""
        return path in map(os.path.realpath, self._launch_files)

    def labels_of(self, path: str) -> list[str]:
        """Return the labels of the processes that a real path belongs to.

        A script that a process runs belongs to that process only, although others have sources in its folder.
        """
        # Otherwise a folder of ten scripts would restart all ten when one of them is saved.
        own = [label for label, process in self._processes.items() if path in process.scripts]
        return own or [label for label, process in self._processes.items() if process.contains(path)]

    def folders(self) -> list[str]:
        """Return the folders to watch, at most `MAX_FOLDERS`, without their subfolders. This blocks."""
        # Copies: this runs in the thread of the watch, while the event loop adds processes.
        sources = [os.path.realpath(each) for each in tuple(self._launch_files)]
        for process in tuple(self._processes.values()):
            sources += process.sources
        found: dict[str, None] = {}
        for source in sources:
            for folder in _folders(source):
                if len(found) == MAX_FOLDERS:
                    return list(found)
                found[folder] = None
        return list(found)


class _Process:
    """The sources of a process, and the scripts in its command."""

    def __init__(self, spec: ProcessSpec) -> None:
        self.sources = tuple(map(os.path.realpath, spec.sources))
        self.scripts = {os.path.realpath(word) for word in spec.command if word.endswith(".py")}

    def contains(self, path: str) -> bool:
        return any(path == source or _counts(path, source) for source in self.sources)


def _counts(path: str, folder: str) -> bool:
    """Return whether a file is in a folder, and is watched there."""
    file = PurePath(path)
    if file.suffix not in SUFFIXES or not file.is_relative_to(folder):
        return False
    return not any(map(_is_ignored, file.relative_to(folder).parts))


def _is_ignored(name: str) -> bool:
    return name.startswith(".") or name in IGNORED_FOLDERS


def _folders(source: str) -> Iterator[str]:
    """Yield a folder and its subfolders, or the folder of a file."""
    path = Path(source)
    if not path.is_dir():
        if path.parent.is_dir():
            yield str(path.parent)
        return
    for folder, inner, _ in os.walk(source):
        inner[:] = sorted(name for name in inner if not _is_ignored(name))
        yield folder
