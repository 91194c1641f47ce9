"""The folder with the log files of one launch, beside those of earlier ones.

    ~/.local/state/callboard/log/2026-11-21T15-46-00Z-4711/launch.log
    ~/.local/state/callboard/log/latest                               a link to the newest

A launch holds a lock on its folder while it runs. When a launch begins, all but the newest folders are
removed, except those that are locked or contain files that no launch has written.
"""

from __future__ import annotations

import errno
import os
import re
import stat
from collections import OrderedDict
from contextlib import suppress
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Final

try:
    import fcntl
except ImportError:  # Windows: whether a launch runs is unknown, so all folders are kept
    fcntl = None  # type: ignore[assignment]

if TYPE_CHECKING:
    from pathlib import Path

MAX_FOLDERS: Final = 50
"""Number of folders that are kept."""
MAX_FILE_BYTES: Final = 64 * 1024 * 1024
"""A file that would become larger is renamed to `.1`, in place of an earlier one, and a new one is begun."""
MAX_OPEN_FILES: Final = 64
"""Beyond it, the least recently written file is closed. It is opened again for its next lines."""

LATEST: Final = "latest"

_FOLDER = re.compile(r"\d{4}-\d\d-\d\dT\d\d-\d\d-\d\dZ-\d+(-\d+)?")
_FILE = re.compile(r"[^/]+\.log(\.1)?")
_MAX_TRIES: Final = 100


class LogFolder:
    """The log folder of one launch, and its files. All methods may block.

    Args:
        root: The folder with the folders of all launches. It is created if it does not exist.

    Raises:
        OSError: The folder cannot be created.

    Attributes:
        path: The path of the new folder.
    """

    def __init__(self, root: Path) -> None:
        root.mkdir(mode=0o700, parents=True, exist_ok=True)
        self.path = _make(root)
        self._lock = _locked(self.path)
        self._files: OrderedDict[str, tuple[int, int]] = OrderedDict()
        _link(root, self.path.name)
        _remove_old(root)

    def write(self, name: str, data: bytes) -> None:
        """Append data to a file.

        Raises:
            OSError: Not all of the data could be written.
        """
        descriptor, size = self._opened(name)
        if size and size + len(data) > MAX_FILE_BYTES:
            self._close(name)
            path = self.path / name
            path.replace(path.with_name(f"{name}.1"))
            descriptor, size = self._opened(name)
        # The size is kept up to date within the loop: a full disk ends it with an exception.
        rest = memoryview(data)
        while rest:
            written = os.write(descriptor, rest)
            rest = rest[written:]
            size += written
            self._files[name] = (descriptor, size)

    def close(self) -> None:
        """Close all files and release the lock, so that later launches may remove the folder."""
        for name in tuple(self._files):
            self._close(name)
        if self._lock is not None:
            os.close(self._lock)
            self._lock = None

    def _opened(self, name: str) -> tuple[int, int]:
        """Return a file's descriptor and size."""
        if name in self._files:
            self._files.move_to_end(name)
            return self._files[name]
        if len(self._files) >= MAX_OPEN_FILES:
            self._close(next(iter(self._files)))
        descriptor = os.open(self.path / name, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
        self._files[name] = descriptor, os.fstat(descriptor).st_size
        return self._files[name]

    def _close(self, name: str) -> None:
        descriptor, _ = self._files.pop(name)
        os.close(descriptor)


def _make(root: Path) -> Path:
    # The time sorts them; the process id tells launches of the same second apart.
    begin = f"{datetime.now(UTC):%Y-%m-%dT%H-%M-%SZ}-{os.getpid()}"
    for number in range(1, _MAX_TRIES):
        path = root / (begin if number == 1 else f"{begin}-{number}")
        with suppress(FileExistsError):
            path.mkdir(mode=0o700)
            return path
    raise FileExistsError(errno.EEXIST, "too many log folders of this second", str(root / begin))


def _locked(folder: Path) -> int | None:
    """Lock a folder until the returned file descriptor is closed; None: this system has no such locks.

    Raises:
        OSError: Another process holds the lock, or the folder does not exist.
    """
    if fcntl is None:
        return None
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        raise
    return descriptor


def _link(root: Path, name: str) -> None:
    """Let the link point to the newest folder, if the system has links and no other file has its name."""
    # A new link replaces the old one at once: readers of `latest` never find nothing.
    latest, new = root / LATEST, root / f".{LATEST}-{os.getpid()}"
    if latest.exists() and not latest.is_symlink():
        return
    with suppress(OSError):
        new.unlink(missing_ok=True)
        new.symlink_to(name, target_is_directory=True)
        new.replace(latest)


def _remove_old(root: Path) -> None:
    with suppress(OSError):
        folders = sorted(each for each in root.iterdir() if _FOLDER.fullmatch(each.name))
        for each in folders[:-MAX_FOLDERS]:
            with suppress(OSError):
                _remove(each)


def _remove(folder: Path) -> None:
    lock = _locked(folder)
    if lock is None:
        return
    # Through the descriptor: a folder that somebody puts in its place meanwhile is not touched.
    try:
        names = os.listdir(lock)  # noqa: PTH208 - pathlib takes no descriptor
        if all(_FILE.fullmatch(name) and _is_file(name, lock) for name in names):
            for name in names:
                os.unlink(name, dir_fd=lock)
            folder.rmdir()
    finally:
        os.close(lock)


def _is_file(name: str, folder: int) -> bool:
    return stat.S_ISREG(os.stat(name, dir_fd=folder, follow_symlinks=False).st_mode)
